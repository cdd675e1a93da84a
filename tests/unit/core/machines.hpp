#pragma once
// The kernels of machines that the tests do not run on: without vectors, one lane at a time.

#include "sdk/core/predict/hard/passes.hpp"
#include "sdk/core/predict/rigid/boxes_in_words.hpp"
#include "sdk/core/predict/rigid/passes.hpp"

namespace tandem {

inline RigidKernels rigid_one_by_one() {
  using Passes = RigidPasses<OneLane>;
  return {
      [](const RigidTouch* const* pairs, const RigidFound* found, const RigidMass* masses,
         const RigidRow* start, const RigidRow* fall, std::uint32_t substep_bits, RigidGroup& group,
         RigidContact* contacts) {
        Passes::put_all(pairs, found, masses, {start, fall, substep_bits}, group, contacts);
      },
      [](const RigidMaterial& material, const RigidGroup* groups, std::size_t count, RigidContact* contacts,
         const RigidMotions& motions) { Passes::solve_all(material, groups, count, contacts, motions); }};
}

inline RigidPairKernels rigid_pair_by_pair() {
  using Boxes = RigidBoxes<OneWord>;
  return {[](RigidBoxPair* pairs, std::size_t count, const RigidSolidWords* solids) {
            return Boxes::keep_near(pairs, count, solids);
          },
          [](const RigidBoxPair* pairs, const RigidSolidWords* solids, RigidBoxPoints& points) {
            for (std::size_t pair = 0; pair < RigidBoxPoints::kPairs; ++pair)
              Boxes::touch(pairs, solids, pair, points);
          },
          portable_rigid_pair_kernels().find_near};
}

inline HardKernels hard_one_by_one() {
  return {portable_hard_kernels().put,
          [](const HardMaterial& material, HardGroup* groups, std::size_t count, const HardMotions& motions) {
            HardPasses<OneWordLane>::solve_all(material, groups, count, motions);
          }};
}

}  // namespace tandem
