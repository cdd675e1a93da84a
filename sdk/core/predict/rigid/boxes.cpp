#include "sdk/core/predict/rigid/boxes.hpp"

#include "sdk/core/predict/rigid/boxes_in_words.hpp"
#include "sdk/core/predict/rigid/search.hpp"

namespace tandem {
namespace {

#if defined(__wasm__) && !defined(__wasm_simd128__)
using Words = OneWord;
#else
using Words = EightWords;
#endif

std::size_t keep_near(RigidBoxPair* pairs, std::size_t count, const RigidSolidWords* solids) {
  return RigidBoxes<Words>::keep_near(pairs, count, solids);
}

void touch_boxes(const RigidBoxPair* pairs, const RigidSolidWords* solids, RigidBoxPoints& points) {
  using Boxes = RigidBoxes<Words>;
  for (std::size_t first = 0; first < RigidBoxPoints::kPairs; first += Boxes::kWidth)
    Boxes::touch(pairs, solids, first, points);
}

std::size_t find_near(const RigidBalls& balls, std::uint32_t a, std::uint32_t from, std::uint32_t to,
                      std::uint32_t* out) {
  return RigidSearch<Four>::find(balls, a, from, to, out);
}

}  // namespace

RigidPairKernels portable_rigid_pair_kernels() { return {keep_near, touch_boxes, find_near}; }

RigidPairKernels fastest_rigid_pair_kernels() {
#ifdef TANDEM_CONTACT_AVX2
  if (__builtin_cpu_supports("avx2") != 0) return avx2_rigid_pair_kernels();
#endif
  return portable_rigid_pair_kernels();
}

}  // namespace tandem
