#include "sdk/core/lattice/hash_avx2.hpp"

namespace tandem {

XXH_errorcode update_avx2(XXH3_state_t* state, const void* bytes, std::size_t size) {
  return XXH3_64bits_update(state, bytes, size);
}

}  // namespace tandem
