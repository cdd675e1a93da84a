// A stream of payloads for the codec `tracker`, and coder states that do not belong to it: each is refused
// with state and coder untouched, or taken without breaking them; what was taken can be saved and loaded.
//
// Input: per message a byte n; below 128 a payload of n bytes follows, otherwise n - 128 edits (position,
// 2 bytes, and value) of the coder's own saved state, which is then loaded.

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "tests/property/synthetic.hpp"

namespace tandem {
namespace {

constexpr std::uint32_t kCapacity = 12;
constexpr StreamParameters kParameters{{200, 16, 64}};

void require(bool holds) {
  if (!holds) std::abort();
}

struct Side {
  explicit Side(const Groups& groups)
      : delta(synthetic::make_delta("tracker", kCapacity, kParameters, {}, groups)),
        state(kCapacity, groups) {}
  void save(std::vector<std::byte>& bytes) const { bytes = synthetic::coder_state(delta.codec()); }
  DeltaCodec delta;
  State state;
};

// A decoder that is given everything, and a twin that is given only what the first one took: they end alike.
class Stream {
 public:
  explicit Stream(const Groups& groups) : side_(groups), twin_(groups) {
    synthetic::Random random(1);
    start_ = synthetic::random_state(random, kCapacity, 4, groups);
    side_.save(fresh_);
  }
  void restart() {
    for (Side* side : {&side_, &twin_}) {
      require(synthetic::load_coder_state(side->delta.codec(), fresh_, start_.alive()).has_value());
      side->delta.restore_parameters(kParameters);
      side->state = start_;
    }
  }
  void payload(std::span<const std::byte> bytes) {
    if (!synthetic::receive(side_.delta, side_.state, bytes)) return;
    require(synthetic::broken_invariant(side_.state) == nullptr);
    require(synthetic::receive(twin_.delta, twin_.state, bytes).has_value());
  }
  void edit(std::span<const std::byte> edits) {
    side_.save(edited_);
    ByteReader in(edits);
    while (in.remaining() >= 3) {
      const std::size_t at = in.get<std::uint16_t>();
      edited_[at % edited_.size()] = static_cast<std::byte>(in.get<std::uint8_t>());
    }
    if (synthetic::load_coder_state(side_.delta.codec(), edited_, side_.state.alive()))
      require(synthetic::load_coder_state(twin_.delta.codec(), edited_, twin_.state.alive()).has_value());
  }
  void end() {
    side_.save(edited_);
    twin_.save(saved_);
    require(edited_ == saved_ && side_.state == twin_.state);
    require(side_.delta.parameters() == twin_.delta.parameters());
  }

 private:
  Side side_, twin_;
  State start_{kCapacity};
  std::vector<std::byte> fresh_, edited_, saved_;
};

void try_stream(Stream& stream, std::span<const std::byte> input) {
  stream.restart();
  while (!input.empty()) {
    const auto n = std::to_integer<std::size_t>(input[0]);
    const bool is_payload = n < 128;
    const std::size_t size = std::min(is_payload ? n : 3 * (n - 128), input.size() - 1);
    const auto body = input.subspan(1, size);
    is_payload ? stream.payload(body) : stream.edit(body);
    input = input.subspan(1 + size);
  }
  stream.end();
}

}  // namespace
}  // namespace tandem

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static tandem::Stream stream({}), turning({.orientation = true});
  tandem::try_stream(stream, std::as_bytes(std::span(data, size)));
  tandem::try_stream(turning, std::as_bytes(std::span(data, size)));
  return 0;
}
