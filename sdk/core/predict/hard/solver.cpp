#include "sdk/core/predict/hard/solver.hpp"

#include "sdk/core/predict/hard/passes.hpp"

namespace tandem {
namespace {

#if defined(__wasm__) && !defined(__wasm_simd128__)
using Words = OneWordLane;
#else
using Words = EightWords;
#endif

void put(const HardContact* contacts, const std::uint32_t* order, HardGroup* groups, std::size_t count) {
  HardPut<Four>::put_all(contacts, order, groups, count);
}

void solve(const HardMaterial& material, HardGroup* groups, std::size_t count, const HardMotions& motions) {
  HardPasses<Words>::solve_all(material, groups, count, motions);
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
