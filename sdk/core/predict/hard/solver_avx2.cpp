// solver.cpp for sixteen contacts at a time. No inline function of other headers is called here, because the
// linker might keep its AVX2 copy for all callers.
#include "sdk/core/predict/hard/solver.hpp"

#ifdef __AVX2__

#include "sdk/core/predict/hard/passes.hpp"

namespace tandem {
namespace {

void put(const HardContact* contacts, const std::uint32_t* order, HardGroup* groups, std::size_t count) {
  HardPut<Eight>::put_all(contacts, order, groups, count);
}

void solve(const HardMaterial& material, HardGroup* groups, std::size_t count, const HardMotions& motions) {
  HardPasses<SixteenWords>::solve_all(material, groups, count, motions);
}

}  // namespace

HardKernels avx2_hard_kernels() { return {put, solve}; }

}  // namespace tandem

#endif
