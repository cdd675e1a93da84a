#include "sdk/core/predict/hard/solver.hpp"

#include "sdk/core/predict/hard/passes.hpp"

namespace tandem {
namespace {

void put(const HardContact* contacts, const std::uint32_t* order, HardGroup* groups, std::size_t count) {
  HardPasses<Four>::put_all(contacts, order, groups, count);
}

void solve(const HardMaterial& material, HardGroup* groups, std::size_t count, const HardMotions& motions) {
  HardPasses<Four>::solve_all(material, groups, count, motions);
}

}  // namespace

HardKernels portable_hard_kernels() { return {put, solve}; }

HardKernels fastest_hard_kernels() {
#ifdef TANDEM_CONTACT_AVX2
  if (__builtin_cpu_supports("avx2") != 0) return avx2_hard_kernels();
#endif
  return portable_hard_kernels();
}

}  // namespace tandem
