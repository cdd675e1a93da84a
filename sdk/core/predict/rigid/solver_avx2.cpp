// solver.cpp for eight pairs at a time. No inline function of other headers is called here, because the
// linker might keep its AVX2 copy for all callers.
#include "sdk/core/predict/rigid/solver.hpp"

#ifdef __AVX2__

#include "sdk/core/predict/rigid/passes.hpp"

namespace tandem {
namespace {

void put(const RigidTouch* const* pairs, const RigidFound* found, const RigidMass* masses,
         const RigidRow* start, const RigidRow* fall, std::uint32_t substep_bits, RigidGroup& group,
         RigidContact* contacts) {
  RigidPasses<Eight>::put_all(pairs, found, masses, {start, fall, substep_bits}, group, contacts);
}

void solve(const RigidMaterial& material, const RigidGroup* groups, std::size_t count, RigidContact* contacts,
           const RigidMotions& motions) {
  RigidPasses<Eight>::solve_all(material, groups, count, contacts, motions);
}

}  // namespace

RigidKernels avx2_rigid_kernels() { return {put, solve}; }

}  // namespace tandem

#endif
