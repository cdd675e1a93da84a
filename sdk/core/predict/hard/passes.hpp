#pragma once
// The passes over contacts, for vectors of four or eight contacts.
//
// Contacts are solved one wave after another. Within a wave all bodies are different, so that several
// contacts at a time give the same bits as one by one.
//
// For a contact with the unit normal n and the relative velocity u, the impulse p >= 0 (a change of u.n) of a
// sub-step is accumulated over its passes: p' = max(0, p + wanted - u.n). `wanted` is the least speed at
// which the bodies are to leave each other: -gap / h where they may still come nearer within the sub-step h,
// and 0.2 overlap / h where they overlap. Friction is accumulated along two tangents, each up to friction *
// p.
//
// Most contacts of bodies that are near but do not touch never push. Where none of a vector does, a pass
// leaves it after the first three products.

#include "sdk/core/predict/contact/lanes.hpp"
#include "sdk/core/predict/hard/solver.hpp"

namespace tandem {

/// All of these are inlined, because code for AVX2 must not be linked into other code.
template <class V>
struct HardPasses {
  using L = HardLaw;
  static constexpr std::size_t kWidth = kLanes<V>;
  // One loop goes over all parts of all groups, because compilers would unroll a loop within a group.
  static constexpr std::size_t kParts = HardGroup::kContacts / kWidth;
  TANDEM_INLINE static std::size_t lane(std::size_t part) { return part % kParts * kWidth; }
  struct Axes {
    V x, y, z;
  };

  // Each component of n is at most 2^12, of u below 2^17, so every sum of products stays below 2^31.
  TANDEM_INLINE static V normal_speed(const HardGroup& g, std::size_t at, const Axes& u) {
    return (read_words<V>(g.nx + at) * u.x + read_words<V>(g.ny + at) * u.y +
            read_words<V>(g.nz + at) * u.z) >>
           12;
  }

  // The rows of a, or of b, one in each lane of a quarter.
  TANDEM_INLINE static Rows<V> rows(const char* rows, const std::uint32_t* of) {
    constexpr std::size_t kOther = kWidth - 4;
    Rows<V> x{};
    read_rows(x.of0, rows + of[0], rows + of[kOther]);
    read_rows(x.of1, rows + of[1], rows + of[kOther + 1]);
    read_rows(x.of2, rows + of[2], rows + of[kOther + 2]);
    read_rows(x.of3, rows + of[3], rows + of[kOther + 3]);
    return x;
  }

  // The rows of both bodies. They are read once, and written from here: what lies between might be stores to
  // them, as far as a compiler knows. Only rows that nothing changes are those of several lanes.
  struct Both {
    Rows<V> a, b;
    TANDEM_INLINE Both(const HardGroup& g, std::size_t at, const char* of)
        : a(rows(of, g.a + at)), b(rows(of, g.b + at)) {}
    // a's minus b's.
    [[nodiscard]] TANDEM_INLINE Axes difference() const {
      const Rows<V> d = transposed(Rows<V>{a.of0 - b.of0, a.of1 - b.of1, a.of2 - b.of2, a.of3 - b.of3});
      return {d.of0, d.of1, d.of2};
    }
  };

  TANDEM_INLINE static void add_rows(char* w, const std::uint32_t* of, const Rows<V>& x,
                                     const Rows<V>& change) {
    constexpr std::size_t kOther = kWidth - 4;
    const V most = constant<V>(L::kMostSpeed);
    write_rows(w + of[0], w + of[kOther], within(x.of0 + change.of0, most));
    write_rows(w + of[1], w + of[kOther + 1], within(x.of1 + change.of1, most));
    write_rows(w + of[2], w + of[kOther + 2], within(x.of2 + change.of2, most));
    write_rows(w + of[3], w + of[kOther + 3], within(x.of3 + change.of3, most));
  }

  // Changes the velocities of the bodies by `whole` between them.
  TANDEM_INLINE static void apply(const HardGroup& g, std::size_t at, const Axes& whole, const Both& now,
                                  char* w) {
    const V share = read_words<V>(g.share + at);
    const Axes a{(whole.x * share + 2048) >> 12, (whole.y * share + 2048) >> 12,
                 (whole.z * share + 2048) >> 12};
    add_rows(w, g.a + at, now.a, transposed(Rows<V>{a.x, a.y, a.z, V{}}));
    add_rows(w, g.b + at, now.b, transposed(Rows<V>{a.x - whole.x, a.y - whole.y, a.z - whole.z, V{}}));
  }

  TANDEM_INLINE static void push_normal(const HardGroup& g, std::size_t at, V normal, const Both& now,
                                        char* w) {
    apply(g, at,
          {(normal * read_words<V>(g.nx + at) + 2048) >> 12, (normal * read_words<V>(g.ny + at) + 2048) >> 12,
           (normal * read_words<V>(g.nz + at) + 2048) >> 12},
          now, w);
  }

  // `along2` is along t2, `signed2` the same times the sign of nz.
  TANDEM_INLINE static void push(const HardGroup& g, std::size_t at, V normal, V along1, V along2, V signed2,
                                 const Both& now, char* w) {
    const V nx = read_words<V>(g.nx + at);
    const V ny = read_words<V>(g.ny + at);
    const V nz = read_words<V>(g.nz + at);
    const V t1y = read_words<V>(g.t1y + at);
    apply(g, at,
          {(normal * nx + along1 * read_words<V>(g.t1x + at) + signed2 * t1y + 2048) >> 12,
           (normal * ny + along1 * t1y + along2 * read_words<V>(g.t2y + at) + 2048) >> 12,
           (normal * nz - along1 * nx - signed2 * ny + 2048) >> 12},
          now, w);
  }

  // x, or -x where nz is negative.
  TANDEM_INLINE static V with_sign(const HardGroup& g, std::size_t at, V x) {
    const V minus = read_words<V>(g.nz + at) >> 31;
    return (x ^ minus) - minus;
  }

  // In the first sub-step nothing has moved.
  TANDEM_INLINE static void want(const HardMaterial& material, HardGroup& g, std::size_t at,
                                 const char* moved, std::int32_t substep) {
    V gap = read<V>(g.gap + at);
    if (substep > 1) {
      const Axes d = Both(g, at, moved).difference();
      gap = within(gap + normal_speed(g, at, {d.x >> 2, d.y >> 2, d.z >> 2}), constant<V>(L::kMostGap));
    }
    const V out = at_most((-gap * L::kPushOut) >> 8, constant<V>(L::kMostPushOut));
    const V room = at_most((material.slop - gap) * L::kSubsteps, V{});
    write<V>(g.wanted + at, gap < 0 ? out : room);
  }

  TANDEM_INLINE static void solve(const HardMaterial& material, HardGroup& g, std::size_t at, char* w) {
    const Both now(g, at, w);
    const Axes u = now.difference();
    const V before = read<V>(g.push + at);
    const V all = at_most(at_least(before + read<V>(g.wanted + at) - normal_speed(g, at, u), V{}),
                          constant<V>(L::kMostImpulse));
    if (!any(all | before)) return;
    const V nx = read_words<V>(g.nx + at);
    const V ny = read_words<V>(g.ny + at);
    const V t1y = read_words<V>(g.t1y + at);
    const V speed1 = (read_words<V>(g.t1x + at) * u.x + t1y * u.y - nx * u.z) >> 12;
    const V speed2 = (with_sign(g, at, t1y * u.x - ny * u.z) + read_words<V>(g.t2y + at) * u.y) >> 12;
    const V most = (all * material.friction) >> 12;
    const V before1 = read<V>(g.slide1 + at);
    const V before2 = read<V>(g.slide2 + at);
    const V slide1 = within(before1 - speed1, most);
    const V slide2 = within(before2 - speed2, most);
    write<V>(g.push + at, all);
    write<V>(g.slide1 + at, slide1);
    write<V>(g.slide2 + at, slide2);
    const V along2 = slide2 - before2;
    push(g, at, all - before, slide1 - before1, along2, with_sign(g, at, along2), now, w);
  }

  TANDEM_INLINE static void warm(const HardGroup& g, std::size_t at, char* w) {
    const V normal = read<V>(g.push + at);
    if (!any(normal)) return;
    const V along2 = read<V>(g.slide2 + at);
    push(g, at, normal, read<V>(g.slide1 + at), along2, with_sign(g, at, along2), Both(g, at, w), w);
  }

  TANDEM_INLINE static void relax(const HardGroup& g, std::size_t at, char* w) {
    const Both now(g, at, w);
    const V before = read<V>(g.push + at);
    const V wanted = at_most(read<V>(g.wanted + at), V{});
    const V all = at_most(at_least(before + wanted - normal_speed(g, at, now.difference()), V{}),
                          constant<V>(L::kMostImpulse));
    if (any(all | before)) push_normal(g, at, all - before, now, w);
  }

  /// Implements HardKernels::solve.
  TANDEM_INLINE static void solve_all(const HardMaterial& material, HardGroup* groups, std::size_t count,
                                      const HardMotions& motions) {
    char* const w = reinterpret_cast<char*>(motions.w);
    char* const moved = reinterpret_cast<char*>(motions.moved);
    const std::size_t parts = count * kParts;
    for (std::int32_t substep = 1; substep <= L::kSubsteps; ++substep) {
      for (std::size_t i = 0; i < motions.rows; ++i) {
        const Four all = read<Four>(motions.fall + i);
        const Four part = ((substep * all) >> 2) - (((substep - 1) * all) >> 2);
        const Four before = read<Four>(motions.w + i);
        if (substep > 1) write(motions.moved + i, read<Four>(motions.moved + i) + before);
        write(motions.w + i, within(before + part, constant<Four>(L::kMostSpeed)));
      }
      // The impulses of the sub-step before are the first guess.
      for (std::size_t i = 0; substep > 1 && i < parts; ++i) warm(groups[i / kParts], lane(i), w);
      const std::int32_t passes = substep == 1 ? L::kFirstPasses : L::kLaterPasses;
      for (std::int32_t pass = 0; pass < passes; ++pass) {
        for (std::size_t i = 0; i < parts; ++i) {
          HardGroup& g = groups[i / kParts];
          if (pass == 0) want(material, g, lane(i), moved, substep);
          solve(material, g, lane(i), w);
        }
      }
    }
    for (std::size_t i = 0; i < motions.rows; ++i)
      write(motions.moved + i, read<Four>(motions.moved + i) + read<Four>(motions.w + i));
    for (std::size_t i = 0; i < parts; ++i) relax(groups[i / kParts], lane(i), w);
  }

  // 2^24 / x, rounded down, for x of 2^12 to 2^13: a line through 1 / x, two steps of Newton, and what is
  // left.
  TANDEM_INLINE static V inverse(V x) {
    constexpr std::int32_t kWhole = 1 << 24;
    V q = 5783 - ((x * 1928) >> 12);  // 2^24 / x is 4096 at 2^12 and 2048 at 2^13
    q += (q * ((kWhole - x * q) >> 6)) >> 18;
    q += (q * ((kWhole - x * q) >> 6)) >> 18;
    const V left = kWhole - x * q;
    return q + (left < 0) - (left >= x);
  }

  // Eight integers of each contact.
  TANDEM_INLINE static Rows<V> half(const HardContact* contacts, const std::uint32_t* order,
                                    std::size_t from) {
    constexpr std::size_t kOther = kWidth - 4;
    const auto at = [contacts, order, from](std::size_t i) {
      return reinterpret_cast<const char*>(contacts + order[i]) + from;
    };
    Rows<V> x{};
    read_rows(x.of0, at(0), at(kOther));
    read_rows(x.of1, at(1), at(kOther + 1));
    read_rows(x.of2, at(2), at(kOther + 2));
    read_rows(x.of3, at(3), at(kOther + 3));
    return transposed(x);
  }

  /// Implements HardKernels::put.
  TANDEM_INLINE static void put_all(const HardContact* contacts, const std::uint32_t* order,
                                    HardGroup* groups, std::size_t count) {
    for (std::size_t i = 0; i < count * kParts; ++i) {
      HardGroup& g = groups[i / kParts];
      const std::size_t at = lane(i);
      const std::uint32_t* const own = order + i * kWidth;
      const Rows<V> first = half(contacts, own, 0);
      const Rows<V> second = half(contacts, own, 16);
      const V nx = first.of2;
      const V ny = first.of3;
      const V nz = second.of0;
      // Two tangents without a root: T. Duff et al., "Building an Orthonormal Basis, Revisited" (2017).
      const V minus = nz >> 31;
      const V inverse_z = inverse(L::kOne + ((nz ^ minus) - minus));
      const V x = (nx * inverse_z + 2048) >> 12;
      const V y = (ny * inverse_z + 2048) >> 12;
      const V xy = (x * ny + 2048) >> 12;
      const V t2 = L::kOne - ((ny * y + 2048) >> 12);
      write<V>(g.a + at, first.of0 * static_cast<std::int32_t>(sizeof(HardRow)));
      write<V>(g.b + at, first.of1 * static_cast<std::int32_t>(sizeof(HardRow)));
      write_words<V>(g.nx + at, nx);
      write_words<V>(g.ny + at, ny);
      write_words<V>(g.nz + at, nz);
      write_words<V>(g.t1x + at, L::kOne - ((nx * x + 2048) >> 12));
      write_words<V>(g.t1y + at, (-xy ^ minus) - minus);
      write_words<V>(g.t2y + at, (t2 ^ minus) - minus);
      write_words<V>(g.share + at, second.of2);
      write<V>(g.gap + at, second.of1);
      write<V>(g.wanted + at, V{});
      write<V>(g.push + at, V{});
      write<V>(g.slide1 + at, V{});
      write<V>(g.slide2 + at, V{});
    }
  }
};

}  // namespace tandem
