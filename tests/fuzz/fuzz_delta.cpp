// Any payload, for every codec: refused with the state and the coder untouched, or applied without breaking
// it.

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "tests/property/synthetic.hpp"

namespace tandem {
namespace {

constexpr std::uint32_t kCapacity = 24;

void require(bool holds) {
  if (!holds) std::abort();
}

struct Target {
  explicit Target(const synthetic::Coded& coded)
      : parameters(synthetic::with_turn_steps({{200, 16, 64}}, coded.codec, coded.groups)),
        delta(synthetic::make_delta(coded.codec, kCapacity, parameters, {}, coded.groups)) {
    synthetic::Random random(1);
    before = synthetic::random_state(random, kCapacity, 4, coded.groups);
    state = before;
  }
  StreamParameters parameters;
  DeltaCodec delta;
  State before;
  State state;
};

void try_payload(std::span<const std::byte> input) {
  static std::vector<Target> targets = [] {
    std::vector<Target> made;
    for (const synthetic::Coded& coded : synthetic::all_coded()) made.emplace_back(coded);
    return made;
  }();
  if (input.empty()) return;
  Target& target = targets[std::to_integer<std::size_t>(input[0]) % targets.size()];
  target.delta.restore_parameters(target.parameters);
  target.state = target.before;
  const auto held = synthetic::coder_state(target.delta.codec());
  if (synthetic::receive(target.delta, target.state, input.subspan(1))) {
    require(synthetic::broken_invariant(target.state) == nullptr);
    // All that the delta did not touch is unchanged.
    std::vector<bool> touched(kCapacity);
    for (const Slot slot : target.delta.touched()) touched.at(slot) = true;
    for (Slot slot = 0; slot < kCapacity; ++slot) {
      require(touched[slot] || target.state.body(slot) == target.before.body(slot));
    }
  } else {
    require(target.state == target.before);
    require(target.delta.parameters() == target.parameters);
    require(synthetic::coder_state(target.delta.codec()) == held);
  }
}

}  // namespace
}  // namespace tandem

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  tandem::try_payload(std::as_bytes(std::span(data, size)));
  return 0;
}
