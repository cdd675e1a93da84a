#include "sdk/core/codec/errors.hpp"

#include <algorithm>

namespace tandem {

void mark_suspects(const State& state, const State& target, const Block& block, std::int32_t threshold,
                   std::span<std::uint8_t, kBlockSlots> marks) {
  // A body within threshold / sqrt(3) on every axis is within the threshold. 37837 / 2^16 is just below 1 /
  // sqrt(3).
  const auto near = static_cast<std::uint32_t>((static_cast<std::uint64_t>(threshold) * 37837U) >> 16U);
  const std::int32_t* x0 = state.p(0).data() + block.first;
  const std::int32_t* y0 = state.p(1).data() + block.first;
  const std::int32_t* z0 = state.p(2).data() + block.first;
  const std::int32_t* x1 = target.p(0).data() + block.first;
  const std::int32_t* y1 = target.p(1).data() + block.first;
  const std::int32_t* z1 = target.p(2).data() + block.first;
  // Tests |a - b| > near in one unsigned comparison; differences of up to 2^31 wrap and still compare
  // correctly.
  const auto beyond = [near](std::int32_t a, std::int32_t b) {
    const std::uint32_t shifted = static_cast<std::uint32_t>(a) - static_cast<std::uint32_t>(b) + near;
    return static_cast<std::uint8_t>(shifted > 2 * near);
  };
  std::uint8_t* mark = marks.data();
  // A copy, because the compiler must assume that a store to a byte changes the block.
  const std::uint32_t slots = block.slots;
  for (std::uint32_t s = 0; s < slots; ++s) {
    mark[s] = static_cast<std::uint8_t>(beyond(x1[s], x0[s]) | beyond(y1[s], y0[s]) | beyond(z1[s], z0[s]));
  }
  const std::uint32_t whole = (block.slots + 7U) & ~7U;
  std::fill(marks.begin() + block.slots, marks.begin() + whole, std::uint8_t{0});
}

}  // namespace tandem
