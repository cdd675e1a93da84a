#include "sdk/core/predict/rigid/solver.hpp"

#include "sdk/core/predict/rigid/passes.hpp"

namespace tandem {
namespace {

#if defined(__wasm__) && !defined(__wasm_simd128__)
using Lanes = OneLane;
#else
using Lanes = Four;
#endif

void put(const RigidTouch* const* pairs, const RigidFound* found, const RigidMass* masses,
         const RigidRow* start, const RigidRow* fall, std::uint32_t substep_bits, RigidGroup& group,
         RigidContact* contacts) {
  RigidPasses<Lanes>::put_all(pairs, found, masses, {start, fall, substep_bits}, group, contacts);
}

void solve(const RigidMaterial& material, const RigidGroup* groups, std::size_t count, RigidContact* contacts,
           const RigidMotions& motions) {
  RigidPasses<Lanes>::solve_all(material, groups, count, contacts, motions);
}

}  // namespace

RigidKernels portable_rigid_kernels() { return {put, solve}; }

RigidKernels fastest_rigid_kernels() {
#ifdef TANDEM_CONTACT_AVX2
  if (__builtin_cpu_supports("avx2") != 0) return avx2_rigid_kernels();
#endif
  return portable_rigid_kernels();
}

}  // namespace tandem
