#pragma once
// The loops over the engine's columns. Plain loops that vectorise.

#include <cstdint>
#include <span>

#include "sdk/core/lattice/state.hpp"

namespace tandem::host {

/// Rounds one column of floats (times `scale`) to integers, saturating at +-limit. Sets `off` to 1 (never
/// clears it) if a value is NaN or its magnitude exceeds `off_bound` (units of `in`). Spans have equal
/// length.
void quantise_column(std::span<const float> in, double scale, std::int32_t limit, float off_bound,
                     std::span<std::int32_t> out, std::span<std::int32_t> off);

/// What the engine says of some slots, and what the mirror had of them.
struct SlotColumns {
  const std::uint8_t* alive;
  const std::uint16_t* type;
  const std::uint8_t* was_alive;
  const TypeId* had_type;
  const std::uint8_t* expelled;
  const std::uint8_t* marks;
  const std::int32_t* off;
};
struct SlotNews {
  bool restless;         ///< something may have to be recorded of a slot
  std::uint32_t hidden;  ///< slots whose body clients must not see
};
/// Writes to `shown` whether clients may see the body, and to `told` all bits where its values count.
SlotNews look_at_slots(const SlotColumns& slots, std::uint32_t count, TypeId type_count, std::uint8_t* shown,
                       std::int32_t* told);

/// Replaces a column's values with `values`, 0 where `told` is 0. Returns whether any differs; writes nothing
/// if not. Changes `values`.
bool replace(std::int32_t* values, const std::int32_t* told, std::uint32_t count, std::int32_t* column);

}  // namespace tandem::host
