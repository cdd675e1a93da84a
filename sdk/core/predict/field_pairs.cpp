#include "sdk/core/predict/field_pairs.hpp"

#include "sdk/core/predict/field_pass.hpp"

namespace tandem {

void add_field_forces(const FieldLaw& law, const FieldGrid& grid, std::int16_t* const (&f)[3]) {
  add_forces(law, grid, f);
}

}  // namespace tandem
