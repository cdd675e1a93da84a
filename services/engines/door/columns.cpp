#include "services/engines/door/columns.hpp"

#include <cstring>
#include <limits>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::engine::door {

Columns::Columns(const Layout& layout)
    : layout_(layout), alive_(layout.capacity), before_(layout.capacity), type_(layout.capacity) {}

std::span<const float> Columns::floats(std::span<const std::byte> slot, const Column& column,
                                       std::uint32_t axis, std::vector<float>& copy) const {
  TANDEM_ASSERT(column.element_bytes == 4 || column.element_bytes == 8);
  TANDEM_ASSERT(column.offset + (axis + 1) * column.element_bytes * layout_.padded <= slot.size());
  const std::byte* const from = slot.data() + column.offset + axis * column.element_bytes * layout_.padded;
  // Offsets are multiples of 64, and so is the address of a slot in shared memory.
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast)
  if (column.element_bytes == 4) return {reinterpret_cast<const float*>(from), layout_.capacity};
  copy.resize(layout_.capacity);
  for (std::size_t i = 0; i < copy.size(); ++i) {
    double value = 0;
    std::memcpy(&value, from + 8 * i, sizeof value);
    // Conversion of what no float can hold is undefined; infinity is refused as a place, and so is NaN.
    constexpr double kLargest = std::numeric_limits<float>::max();
    copy[i] = value > kLargest    ? std::numeric_limits<float>::infinity()
              : value < -kLargest ? -std::numeric_limits<float>::infinity()
                                  : static_cast<float>(value);
  }
  return copy;
}

void Columns::read(std::span<const std::byte> slot, bool with_events) {
  alive_.swap(before_);
  std::memcpy(alive_.data(), slot.data() + layout_.column("alive").offset, alive_.size());
  std::memcpy(type_.data(), slot.data() + layout_.column("type").offset, 2 * type_.size());
  events_.clear();
  for (std::uint32_t s = 0; with_events && s < alive_.size(); ++s) {
    if (alive_[s] == before_[s]) continue;
    if (before_[s] != 0) events_.push_back({Event::Kind::kDespawned, s});
    if (alive_[s] != 0) events_.push_back({Event::Kind::kSpawned, s});
  }
  std::size_t copy = 0;
  const auto take = [&](auto& axes, std::string_view name) {
    const Column& column = layout_.column(name);
    for (std::uint32_t axis = 0; axis < axes.size(); ++axis)
      axes[axis] = floats(slot, column, axis, copies_[copy++]);
  };
  take(bodies_.position, "position");
  take(bodies_.velocity, "velocity");
  if (layout_.columns.size() > 4) {
    take(bodies_.orientation, "orientation");
    take(bodies_.angular_velocity, "angular_velocity");
  }
  bodies_.alive = alive_;
  bodies_.type = type_;
}

}  // namespace tandem::engine::door
