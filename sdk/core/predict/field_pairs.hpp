#pragma once
// Forces between the bodies of the tier `field`, in 16 bits.

#include <array>
#include <cstdint>

namespace tandem {

/// Gains of one pass: K in 1/2^15, S and B + S in 1/2^16.
struct FieldLaw {
  std::int16_t spring = 0, shear = 0, drag = 0;
  std::int32_t shear_shift = 0;
};

/// The torus of cells, with the bodies that take part sorted by cell, x lowest in a cell's number.
struct FieldGrid {
  static constexpr std::uint32_t kMostInCell = 16;

  std::uint32_t side_bits;     ///< 2^side_bits cells a side
  const std::uint32_t* begin;  ///< by cell, and one more: places of its bodies
  /// By place, eight more readable: position in 1/8192 of the largest diameter (the low 16 bits), velocity in
  /// 1/16384 of it per frame.
  std::array<const std::int16_t*, 3> p, v;
};

/// Adds to `f`, by place, what the pairs change of v; sums wrap at 16 bits. Writes eight places beyond.
void add_field_forces(const FieldLaw& law, const FieldGrid& grid, const std::array<std::int16_t*, 3>& f);

}  // namespace tandem
