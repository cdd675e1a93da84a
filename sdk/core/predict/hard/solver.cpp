// Contacts are solved one wave after another. Within a wave all bodies are different, so that four contacts
// at a time give the same bits as one by one.
//
// For a contact with the unit normal n and the relative velocity u, the impulse p >= 0 (a change of u.n) of a
// sub-step is accumulated over its passes: p' = max(0, p + wanted - u.n). `wanted` is the least speed at
// which the bodies are to leave each other: -gap / h where they may still come nearer within the sub-step h,
// and 0.2 overlap / h where they overlap. Friction is accumulated along two tangents, each up to friction *
// p.
#include "sdk/core/predict/hard/solver.hpp"

#include <cstring>

#include "sdk/core/lattice/vector_clones.hpp"

namespace tandem {
namespace {

using L = HardLaw;
using Axes = std::array<Four, 3>;

// All of these are inlined, because each copy for a processor needs its own.
#define TANDEM_INLINE [[gnu::always_inline]] inline

TANDEM_INLINE Four constant(std::int32_t x) { return Four{x, x, x, x}; }
TANDEM_INLINE Four at_most(Four x, Four limit) { return x > limit ? limit : x; }
TANDEM_INLINE Four at_least(Four x, Four limit) { return x < limit ? limit : x; }
TANDEM_INLINE Four within(Four x, Four limit) { return at_least(at_most(x, limit), -limit); }
TANDEM_INLINE Four row(const HardRow& from) {
  Four x;
  std::memcpy(&x, &from, sizeof x);
  return x;
}
TANDEM_INLINE void put(HardRow& to, Four x) { std::memcpy(to.of.data(), &x, sizeof x); }

// |n| = 2^12 and |u| < 2^17.8, so every sum of products stays below 2^30.
TANDEM_INLINE Four along(const Axes& n, const Axes& u) {
  return (n[0] * u[0] + n[1] * u[1] + n[2] * u[2]) >> 12;
}

// The difference of two rows, a's minus b's, of the four contacts.
TANDEM_INLINE Axes difference(const HardGroup& g, const HardRow* rows, std::int32_t shift) {
  std::array<Four, 4> d;
  for (std::size_t k = 0; k < 4; ++k) d[k] = (row(rows[g.a[k]]) - row(rows[g.b[k]])) >> shift;
  transpose(d);
  return {d[0], d[1], d[2]};
}

// Changes the velocities of all eight bodies.
TANDEM_INLINE void push(const HardGroup& g, Four normal, Four along1, Four along2, HardRow* w) {
  std::array<Four, 4> a{};
  std::array<Four, 4> b{};
  for (std::size_t i = 0; i < 3; ++i) {
    const Four whole = (normal * g.n[i] + along1 * g.t1[i] + along2 * g.t2[i] + 2048) >> 12;
    a[i] = (whole * g.share + 2048) >> 12;
    b[i] = whole - a[i];
  }
  transpose(a);
  transpose(b);
  for (std::size_t k = 0; k < 4; ++k) {
    put(w[g.a[k]], within(row(w[g.a[k]]) + a[k], constant(L::kMostSpeed)));
    put(w[g.b[k]], within(row(w[g.b[k]]) - b[k], constant(L::kMostSpeed)));
  }
}

TANDEM_INLINE void want(const HardMaterial& material, HardGroup& g, const HardRow* moved) {
  const Four gap = within(g.gap + along(g.n, difference(g, moved, 2)), constant(L::kMostGap));
  const Four out = at_most(-gap * L::kPushOut >> 8, constant(L::kMostPushOut));
  const Four room = at_most((material.slop - gap) * L::kSubsteps, Four{});
  g.wanted = gap < 0 ? out : room;
}

TANDEM_INLINE void solve(const HardMaterial& material, HardGroup& g, HardRow* w) {
  const Axes u = difference(g, w, 0);
  const Four all = at_most(at_least(g.push + g.wanted - along(g.n, u), Four{}), constant(L::kMostImpulse));
  const Four most = all * material.friction >> 12;
  const Four slide1 = within(g.slide1 - along(g.t1, u), most);
  const Four slide2 = within(g.slide2 - along(g.t2, u), most);
  push(g, all - g.push, slide1 - g.slide1, slide2 - g.slide2, w);
  g.push = all;
  g.slide1 = slide1;
  g.slide2 = slide2;
}

TANDEM_INLINE void relax(HardGroup& g, HardRow* w) {
  const Four wanted = at_most(g.wanted, Four{});
  const Four all =
      at_most(at_least(g.push + wanted - along(g.n, difference(g, w, 0)), Four{}), constant(L::kMostImpulse));
  push(g, all - g.push, Four{}, Four{}, w);
}

}  // namespace

void put_contact(const HardContact& contact, HardGroup& group, std::size_t at) {
  const Vec3i& n = contact.n;
  // Two tangents without a root: T. Duff et al., "Building an Orthonormal Basis, Revisited" (2017).
  const std::int32_t sign = n[2] < 0 ? -1 : 1;
  const std::int32_t inverse = (1 << 24) / (L::kOne + sign * n[2]);
  const std::int32_t x = (n[0] * inverse + 2048) >> 12;
  const std::int32_t y = (n[1] * inverse + 2048) >> 12;
  const std::int32_t xy = (x * n[1] + 2048) >> 12;
  const Vec3i t1{L::kOne - ((n[0] * x + 2048) >> 12), -sign * xy, -n[0]};
  const Vec3i t2{-xy, sign * (L::kOne - ((n[1] * y + 2048) >> 12)), -sign * n[1]};
  group.a[at] = contact.a;
  group.b[at] = contact.b;
  for (std::size_t i = 0; i < 3; ++i) {
    group.n[i][at] = n[i];
    group.t1[i][at] = t1[i];
    group.t2[i][at] = t2[i];
  }
  group.gap[at] = contact.gap;
  group.share[at] = contact.share;
  group.wanted[at] = group.push[at] = group.slide1[at] = group.slide2[at] = 0;
}

TANDEM_VECTOR_CLONES void solve_contacts(const HardMaterial& material, std::span<HardGroup> groups,
                                         const HardMotions& motions) {
  HardRow* const w = motions.w.data();
  HardRow* const moved = motions.moved.data();
  const HardRow* const fall = motions.fall.data();
  const std::size_t bodies = motions.fall.size();
  for (std::int32_t substep = 1; substep <= L::kSubsteps; ++substep) {
    for (std::size_t i = 0; i < bodies; ++i) {
      const Four all = row(fall[i]);
      const Four part = (substep * all >> 2) - ((substep - 1) * all >> 2);
      put(w[i], within(row(w[i]) + part, constant(L::kMostSpeed)));
    }
    // The impulses of the sub-step before are the first guess.
    for (HardGroup& g : substep > 1 ? groups : std::span<HardGroup>()) push(g, g.push, g.slide1, g.slide2, w);
    for (HardGroup& g : groups) {
      want(material, g, moved);
      solve(material, g, w);
    }
    for (std::int32_t pass = 1; pass < (substep == 1 ? L::kFirstPasses : L::kLaterPasses); ++pass)
      for (HardGroup& g : groups) solve(material, g, w);
    for (std::size_t i = 0; i < bodies; ++i) put(moved[i], row(moved[i]) + row(w[i]));
  }
  for (HardGroup& g : groups) relax(g, w);
}

}  // namespace tandem
