#pragma once
// Forces between the bodies of the tier `field`, in 16 bits.

#include <cstdint>

namespace tandem {

/// Gains of one pass: K and B + S in 1/2^16, S in 1/2^(20 - shear_shift).
struct FieldLaw {
  std::int16_t spring = 0, shear = 0, drag = 0;
  std::int32_t shear_shift = 0;
};

/// The torus of cells, with the bodies that take part sorted by cell, x lowest in a cell's number.
struct FieldGrid {
  static constexpr std::uint32_t kMostInCell = 16;
  static constexpr std::uint32_t kBeyond = 16;  ///< places that are read and written behind the last body

  std::uint32_t side_bits;     ///< 2^side_bits cells a side
  const std::uint32_t* begin;  ///< by cell, and one more: places of its bodies
  /// By place: position in 1/8192 of the largest diameter (the low 16 bits), velocity in 1/16384 of it per
  /// frame.
  const std::int16_t* p[3];
  const std::int16_t* v[3];
};

using FieldForces = void(const FieldLaw& law, const FieldGrid& grid, std::int32_t* const (&f)[3]);

/// Sets `f`, by place, to what the pairs change of v, in 2^-30 of the largest
/// diameter per frame; sums wrap at 32 bits.
FieldForces set_field_forces;
#ifdef TANDEM_FIELD_AVX2
/// The same bits; only where the processor has AVX2.
FieldForces set_field_forces_avx2;
#endif

}  // namespace tandem
