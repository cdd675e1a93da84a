#include "sdk/core/predict/rigid/near.hpp"

#include <algorithm>

#include "sdk/core/lattice/assert.hpp"

namespace tandem {

RigidOrder::RigidOrder(std::uint32_t capacity)
    : side_bits_(2), cell_(capacity), cell_of_(capacity), slots_(capacity) {
  while ((1U << (3 * side_bits_)) < 2 * capacity) ++side_bits_;
  begin_.resize((std::size_t{1} << (3 * side_bits_)) + 1);
  left_.resize(begin_.size() - 1);
}

std::span<const std::uint32_t> RigidOrder::number(const State& state, std::uint32_t shift,
                                                  std::int64_t width) {
  const std::int64_t per_unit = (std::int64_t{1} << 32) / (width + 1);
  const auto last = static_cast<std::uint32_t>(left_.size() - 1);
  for (Slot s = 0; s < state.capacity(); ++s) {
    std::uint32_t cell = 0;
    for (std::size_t i = 0; i < kPositionChannels; ++i) {
      const std::int64_t x = std::int64_t{state.p(i)[s] >> shift} * per_unit >> 32;
      cell += static_cast<std::uint32_t>(x) << (i * side_bits_);
    }
    cell_[s] = state.alive()[s] != 0 ? cell & last : kNobody;
  }
  return cell_;
}

std::span<const Slot> RigidOrder::sort(std::span<const std::uint8_t> left_out) {
  TANDEM_ASSERT(left_out.empty() || left_out.size() == cell_.size());
  for (Slot s = 0; s < left_out.size(); ++s)
    if (left_out[s] != 0) cell_[s] = kNobody;
  const auto last = static_cast<std::uint32_t>(left_.size() - 1);
  std::fill(left_.begin(), left_.end(), std::uint8_t{0});
  std::uint32_t taken = 0;
  for (const std::uint32_t cell : cell_) {
    if (cell == kNobody) continue;
    std::uint8_t& held = left_[cell];
    if (held < kMaxInCell) ++held;
    ++taken;
  }
  paired_ = 0;
  for (std::uint32_t cell = 0; cell <= last; ++cell) {
    begin_[cell] = paired_;
    paired_ += left_[cell];
  }
  begin_[last + 1] = paired_;
  std::uint32_t others = paired_;
  for (Slot s = 0; s < cell_.size(); ++s) {
    if (cell_[s] == kNobody) continue;
    std::uint8_t& left = left_[cell_[s]];
    const std::uint32_t place = left > 0 ? begin_[cell_[s] + 1] - left : others++;
    if (left > 0) --left;
    slots_[place] = s;
    cell_of_[place] = cell_[s];
  }
  return std::span(slots_).first(taken);
}

}  // namespace tandem
