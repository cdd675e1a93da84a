#pragma once
// The passes over contacts, for vectors of eight or sixteen contacts, or one at a time.
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
// Everything is a word of 16 bits, because processors multiply most of these at a time. Most contacts of
// bodies that are near but do not touch never push. Where none of a vector does, a pass leaves it after the
// first three products.

#include "sdk/core/predict/hard/solver.hpp"
#include "sdk/core/predict/hard/word_rows.hpp"

namespace tandem {

/// All of these are inlined, because code for AVX2 must not be linked into other code. W: words.
template <class W>
struct HardPasses {
  using L = HardLaw;
  using Axes = WordAxes<W>;
  using Rows = WordRows<W>;
  static constexpr std::size_t kWidth = WordLanes<W>::kCount;
  // One loop goes over all parts of all groups, because compilers would unroll a loop within a group.
  static constexpr std::size_t kParts = HardGroup::kContacts / kWidth;
  TANDEM_INLINE static std::size_t lane(std::size_t part) { return part % kParts * kWidth; }

  TANDEM_INLINE static W all_of(std::int16_t x) { return W{} + x; }
  TANDEM_INLINE static W minus(W x) { return sub_sat16(W{}, x); }

  TANDEM_INLINE static W normal_speed(const HardGroup& g, std::size_t at, const Axes& u) {
    return add_sat16(add_sat16(mul_q15(u.x, read<W>(g.nx + at)), mul_q15(u.y, read<W>(g.ny + at))),
                     mul_q15(u.z, read<W>(g.nz + at)));
  }

  // The rows of both bodies. They are read once, and written from here: what lies between might be stores to
  // them, as far as a compiler knows. Only rows that nothing changes are those of several lanes.
  struct Both {
    Rows a, b;
    TANDEM_INLINE Both(const HardGroup& g, std::size_t at, const char* of) {
      read_rows(a, of, g.a + at);
      read_rows(b, of, g.b + at);
    }
    // a's minus b's.
    [[nodiscard]] TANDEM_INLINE Axes difference() const { return axes_of(sub_sat16(a, b)); }
  };

  // Changes the velocities of the bodies by `whole` between them.
  TANDEM_INLINE static void apply(const HardGroup& g, std::size_t at, const Axes& whole, const Both& now,
                                  char* w) {
    if (g.alike) {
      const Rows half = rows_of(mul_q15(whole, all_of(L::kHalf)));
      write_rows(add_sat16(now.a, half), w, g.a + at);
      write_rows(sub_sat16(now.b, half), w, g.b + at);
      return;
    }
    write_rows(add_sat16(now.a, rows_of(mul_q15(whole, read<W>(g.share_a + at)))), w, g.a + at);
    write_rows(sub_sat16(now.b, rows_of(mul_q15(whole, read<W>(g.share_b + at)))), w, g.b + at);
  }

  TANDEM_INLINE static void push_normal(const HardGroup& g, std::size_t at, W normal, const Both& now,
                                        char* w) {
    apply(g, at,
          {mul_q15(normal, read<W>(g.nx + at)), mul_q15(normal, read<W>(g.ny + at)),
           mul_q15(normal, read<W>(g.nz + at))},
          now, w);
  }

  TANDEM_INLINE static void push(const HardGroup& g, std::size_t at, W normal, W along1, W along2,
                                 const Both& now, char* w) {
    const W nx = read<W>(g.nx + at);
    const W ny = read<W>(g.ny + at);
    const W t1y = read<W>(g.t1y + at);
    apply(
        g, at,
        {add_sat16(add_sat16(mul_q15(normal, nx), mul_q15(along1, read<W>(g.t1x + at))),
                   mul_q15(along2, t1y)),
         add_sat16(add_sat16(mul_q15(normal, ny), mul_q15(along1, t1y)),
                   mul_q15(along2, read<W>(g.t2y + at))),
         sub_sat16(sub_sat16(mul_q15(normal, read<W>(g.nz + at)), mul_q15(along1, nx)), mul_q15(along2, ny))},
        now, w);
  }

  // In the first sub-step nothing has moved.
  TANDEM_INLINE static void want(const HardMaterial& material, HardGroup& g, std::size_t at, const char* way,
                                 std::int32_t substep) {
    W gap = read<W>(g.gap + at);
    if (substep > 1) gap = add_sat16(gap, normal_speed(g, at, Both(g, at, way).difference()));
    const W out = smaller(mul_q15(minus(gap), all_of(L::kPushOut)), all_of(L::kMaxPushOut));
    const W left = smaller(sub_sat16(all_of(material.slop), gap), W{});
    const W twice = add_sat16(left, left);
    write<W>(g.wanted + at, add_sat16(larger(out, W{}), add_sat16(twice, twice)));
  }

  TANDEM_INLINE static void solve(const HardMaterial& material, HardGroup& g, std::size_t at, char* w) {
    const Both now(g, at, w);
    const Axes u = now.difference();
    const W before = read<W>(g.push + at);
    const W all = larger(sub_sat16(add_sat16(before, read<W>(g.wanted + at)), normal_speed(g, at, u)), W{});
    if (!any(all | before)) return;
    const W nx = read<W>(g.nx + at);
    const W ny = read<W>(g.ny + at);
    const W t1y = read<W>(g.t1y + at);
    const W speed1 =
        sub_sat16(add_sat16(mul_q15(u.x, read<W>(g.t1x + at)), mul_q15(u.y, t1y)), mul_q15(u.z, nx));
    const W speed2 =
        sub_sat16(add_sat16(mul_q15(u.x, t1y), mul_q15(u.y, read<W>(g.t2y + at))), mul_q15(u.z, ny));
    const W most = mul_q15(all, all_of(material.friction));
    const W least = minus(most);
    const W before1 = read<W>(g.slide1 + at);
    const W before2 = read<W>(g.slide2 + at);
    const W slide1 = larger(smaller(sub_sat16(before1, speed1), most), least);
    const W slide2 = larger(smaller(sub_sat16(before2, speed2), most), least);
    write<W>(g.push + at, all);
    write<W>(g.slide1 + at, slide1);
    write<W>(g.slide2 + at, slide2);
    push(g, at, sub_sat16(all, before), sub_sat16(slide1, before1), sub_sat16(slide2, before2), now, w);
  }

  TANDEM_INLINE static void relax(const HardGroup& g, std::size_t at, char* w) {
    const Both now(g, at, w);
    const W before = read<W>(g.push + at);
    const W wanted = smaller(read<W>(g.wanted + at), W{});
    const W all = larger(sub_sat16(add_sat16(before, wanted), normal_speed(g, at, now.difference())), W{});
    if (any(all | before)) push_normal(g, at, sub_sat16(all, before), now, w);
  }

  using Wide = typename WordLanes<W>::Wide;

  // `at`: of the words of all rows.
  TANDEM_INLINE static void add_to_moved(const HardMotions& motions, std::size_t at, W now, bool set_way) {
    std::int32_t* const even = motions.moved_xz + at / 2;
    std::int32_t* const odd = motions.moved_y + at / 2;
    if constexpr (kWidth == 1) {
      std::int32_t& moved = at % 2 == 0 ? *even : *odd;
      moved += now.x;
      if (set_way) motions.way->of[at] = static_cast<std::int16_t>(moved >> 2);
    } else {
      const Wide lanes = reinterpret_cast<Wide>(now);
      const Wide low = read<Wide>(even) + ((lanes << 16) >> 16);
      const Wide high = read<Wide>(odd) + (lanes >> 16);
      write(even, low);
      write(odd, high);
      if (set_way) write(motions.way->of.data() + at, ((low >> 2) & 0xFFFF) | ((high >> 2) << 16));
    }
  }

  // The velocities at the start of a sub-step: what fell, and again what the impulses of the one before did.
  TANDEM_INLINE static void begin(const HardMotions& motions, std::int32_t substep) {
    const W now = all_of(static_cast<std::int16_t>(substep));
    const W before = all_of(static_cast<std::int16_t>(substep - 1));
    for (std::size_t at = 0; at < 4 * motions.rows; at += kWidth) {
      std::int16_t* const w = motions.w->of.data() + at;
      std::int16_t* const base = motions.base->of.data() + at;
      const W fall = read<W>(motions.fall->of.data() + at);
      const W part = (fall * now >> 2) - (fall * before >> 2);
      const W reached = read<W>(w);
      const W fallen = add_sat16(reached, part);
      if (substep > 1) {
        add_to_moved(motions, at, reached, true);
        write(w, add_sat16(fallen, sub_sat16(reached, read<W>(base))));
      } else {
        write(w, fallen);
      }
      write(base, fallen);
    }
  }

  /// Implements HardKernels::solve.
  TANDEM_INLINE static void solve_all(const HardMaterial& material, HardGroup* groups, std::size_t count,
                                      const HardMotions& motions) {
    char* const w = reinterpret_cast<char*>(motions.w);
    const char* const way = reinterpret_cast<const char*>(motions.way);
    const std::size_t parts = count * kParts;
    for (std::int32_t substep = 1; substep <= L::kSubsteps; ++substep) {
      begin(motions, substep);
      const std::int32_t passes = substep == 1 ? L::kFirstPasses : L::kLaterPasses;
      for (std::int32_t pass = 0; pass < passes; ++pass) {
        for (std::size_t i = 0; i < parts; ++i) {
          HardGroup& g = groups[i / kParts];
          if (pass == 0) want(material, g, lane(i), way, substep);
          solve(material, g, lane(i), w);
        }
      }
    }
    for (std::size_t at = 0; at < 4 * motions.rows; at += kWidth)
      add_to_moved(motions, at, read<W>(motions.w->of.data() + at), false);
    for (std::size_t i = 0; i < parts; ++i) relax(groups[i / kParts], lane(i), w);
  }
};

/// Puts contacts into groups, for vectors of four or eight contacts.
template <class V>
struct HardPut {
  using L = HardLaw;
  static constexpr std::size_t kWidth = kLanes<V>;
  static constexpr std::size_t kParts = HardGroup::kContacts / kWidth;

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

  // From 2^-12 to 2^-15.
  TANDEM_INLINE static void write_component(std::int16_t* to, V x) {
    write_words<V>(to, within(x << 3, constant<V>(L::kMaxWord)));
  }

  /// Implements HardKernels::put.
  TANDEM_INLINE static void put_all(const HardContact* contacts, const std::uint32_t* order,
                                    HardGroup* groups, std::size_t count) {
    V unlike{};
    for (std::size_t i = 0; i < count * kParts; ++i) {
      HardGroup& g = groups[i / kParts];
      const std::size_t at = i % kParts * kWidth;
      const std::uint32_t* const own = order + i * kWidth;
      const Rows<V> first = half(contacts, own, 0);
      const Rows<V> second = half(contacts, own, 16);
      const V nx = first.of2;
      const V ny = first.of3;
      const V nz = second.of0;
      // Two tangents without a root: T. Duff et al., "Building an Orthonormal Basis, Revisited" (2017).
      const V minus = nz >> 31;
      const V inverse_z = inverse_near_one(L::kOne + ((nz ^ minus) - minus));
      const V x = (nx * inverse_z + 2048) >> 12;
      const V y = (ny * inverse_z + 2048) >> 12;
      const V xy = (x * ny + 2048) >> 12;
      const V share = second.of2;
      write<V>(g.a + at, first.of0 * static_cast<std::int32_t>(sizeof(HardRow)));
      write<V>(g.b + at, first.of1 * static_cast<std::int32_t>(sizeof(HardRow)));
      write_component(g.nx + at, nx);
      write_component(g.ny + at, ny);
      write_component(g.nz + at, nz);
      write_component(g.t1x + at, L::kOne - ((nx * x + 2048) >> 12));
      write_component(g.t1y + at, (-xy ^ minus) - minus);
      write_component(g.t2y + at, L::kOne - ((ny * y + 2048) >> 12));
      write_words<V>(g.share_a + at, (share << 16) >> 16);
      write_words<V>(g.share_b + at, share >> 16);
      write_words<V>(g.gap + at, second.of1);
      for (std::int16_t* const words : {g.wanted, g.push, g.slide1, g.slide2})
        write_words<V>(words + at, V{});
      unlike |= share ^ (L::kHalf << 16 | L::kHalf);
      if (at + kWidth == HardGroup::kContacts) {
        g.alike = !any(unlike);
        unlike = V{};
      }
    }
  }
};

}  // namespace tandem
