#include "sdk/core/predict/field_pairs.hpp"

#include "sdk/core/predict/field_pass.hpp"

namespace tandem {

void set_field_forces(const FieldLaw& law, const FieldGrid& grid, std::int32_t* const (&f)[3]) {
  set_forces(law, grid, f);
}

}  // namespace tandem
