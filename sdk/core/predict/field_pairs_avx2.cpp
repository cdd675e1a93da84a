// Nothing inline of other headers is called here: the linker might keep the AVX2 copy for everybody.
#include "sdk/core/predict/field_pass.hpp"

namespace tandem {

void set_field_forces_avx2(const FieldLaw& law, const FieldGrid& grid, std::int32_t* const (&f)[3]) {
  set_forces(law, grid, f);
}

}  // namespace tandem
