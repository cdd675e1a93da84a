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
constexpr CodecParameters kParameters{200, 16, 64};

void require(bool holds) {
  if (!holds) std::abort();
}

class Stream {
 public:
  Stream() : delta_(synthetic::make_delta("tracker", kCapacity, kParameters)), state_(kCapacity) {
    synthetic::Random random(1);
    state_ = start_ = synthetic::random_state(random, kCapacity);
    fresh_ = saved();
  }
  void restart() {
    require(delta_.codec().load(fresh_).has_value());
    delta_.restore_parameters(kParameters);
    state_ = start_;
  }
  void payload(std::span<const std::byte> bytes) {
    const auto before = saved();
    const State held = state_;
    const CodecParameters parameters = delta_.parameters();
    if (delta_.decode(state_, bytes)) {
      require(synthetic::broken_invariant(state_) == nullptr);
      return;
    }
    require(state_ == held && delta_.parameters() == parameters && saved() == before);
  }
  void edit(std::span<const std::byte> edits) {
    const auto before = saved();
    auto edited = before;
    ByteReader in(edits);
    while (in.remaining() >= 3) {
      const std::size_t at = in.get<std::uint16_t>();
      edited[at % edited.size()] = static_cast<std::byte>(in.get<std::uint8_t>());
    }
    const bool taken = delta_.codec().load(edited).has_value();
    require(saved() == (taken ? edited : before));
  }

 private:
  std::vector<std::byte> saved() const {
    std::vector<std::byte> bytes(delta_.codec().save_bound());
    ByteWriter out(bytes);
    delta_.codec().save(out);
    bytes.resize(out.size());
    return bytes;
  }
  DeltaCodec delta_;
  State start_{kCapacity};
  State state_;
  std::vector<std::byte> fresh_;
};

void try_stream(std::span<const std::byte> input) {
  static Stream stream;
  stream.restart();
  while (!input.empty()) {
    const auto n = std::to_integer<std::size_t>(input[0]);
    const bool is_payload = n < 128;
    const std::size_t size = std::min(is_payload ? n : 3 * (n - 128), input.size() - 1);
    const auto body = input.subspan(1, size);
    is_payload ? stream.payload(body) : stream.edit(body);
    input = input.subspan(1 + size);
  }
}

}  // namespace
}  // namespace tandem

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  tandem::try_stream(std::as_bytes(std::span(data, size)));
  return 0;
}
