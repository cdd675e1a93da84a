// boxes.cpp for 16 pairs at a time. No inline function of other headers is called here, because the linker
// might keep its AVX2 copy for all callers.
#include "sdk/core/predict/rigid/boxes.hpp"

#ifdef __AVX2__

#include "sdk/core/predict/rigid/boxes_in_words.hpp"
#include "sdk/core/predict/rigid/search.hpp"

namespace tandem {
namespace {

std::size_t keep_near(RigidBoxPair* pairs, std::size_t count, const RigidSolidWords* solids) {
  return RigidBoxes<SixteenWords>::keep_near(pairs, count, solids);
}

void touch_boxes(const RigidBoxPair* pairs, const RigidSolidWords* solids, RigidBoxPoints& points) {
  RigidBoxes<SixteenWords>::touch(pairs, solids, 0, points);
}

std::size_t find_near(const RigidBalls& balls, std::uint32_t a, std::uint32_t from, std::uint32_t to,
                      std::uint32_t* out) {
  return RigidSearch<Eight>::find(balls, a, from, to, out);
}

}  // namespace

RigidPairKernels avx2_rigid_pair_kernels() { return {keep_near, touch_boxes, find_near}; }

}  // namespace tandem

#endif
