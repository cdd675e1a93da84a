#pragma once
// The passes over contacts of `rigid`, for vectors of four or eight pairs of bodies, or one pair at a time.
//
// Contacts are solved one wave after another. Within a wave all bodies are different, so that several pairs
// at a time give the same bits as one by one. The points of a pair are solved one after the other, while the
// motions of its bodies stay in registers: first the impulse along the normal, as in `hard`, then both
// tangents.
//
// Motions and rows are words of 16 bits, two in a lane, because processors multiply these fastest.

#include "sdk/core/predict/rigid/solver.hpp"
#include "sdk/core/predict/rigid/words.hpp"

// In WebAssembly, where nothing is made for AVX2, the larger parts are called, because modules have to be
// small.
#ifdef __wasm__
#define TANDEM_LARGE [[gnu::noinline]]
#else
#define TANDEM_LARGE TANDEM_INLINE
#endif
#if defined(__wasm__) && !defined(__wasm_simd128__)
#define TANDEM_PART [[gnu::noinline]]
#else
#define TANDEM_PART TANDEM_INLINE
#endif

namespace tandem {

/// All of these are inlined, because code for AVX2 must not be linked into other code.
template <class V>
struct RigidPasses {
  using L = RigidSolverLaw;
  static constexpr std::size_t kWidth = kLanes<V>;
  static constexpr std::size_t kParts = RigidGroup::kPairs / kWidth;

  /// The motion of one body in each lane.
  struct Motion {
    V v_xy, v_z, w_xy, w_z;
  };

  TANDEM_INLINE static Motion read_motion(const char* rows, const std::uint32_t* of) {
    if constexpr (kWidth == 1) {
      return {read<V>(rows + of[0]), read<V>(rows + of[0] + 4), read<V>(rows + of[0] + 8),
              read<V>(rows + of[0] + 12)};
    } else {
      constexpr std::size_t kOther = kWidth - 4;
      Rows<V> x;
      read_rows(x.of0, rows + of[0], rows + of[kOther]);
      read_rows(x.of1, rows + of[1], rows + of[kOther + 1]);
      read_rows(x.of2, rows + of[2], rows + of[kOther + 2]);
      read_rows(x.of3, rows + of[3], rows + of[kOther + 3]);
      const Rows<V> t = transposed(x);
      return {t.of0, t.of1, t.of2, t.of3};
    }
  }
  TANDEM_INLINE static void write_motion(char* rows, const std::uint32_t* of, const Motion& motion) {
    if constexpr (kWidth == 1) {
      write(rows + of[0], motion);
    } else {
      constexpr std::size_t kOther = kWidth - 4;
      const Rows<V> t = transposed(Rows<V>{motion.v_xy, motion.v_z, motion.w_xy, motion.w_z});
      write_rows(rows + of[0], rows + of[kOther], t.of0);
      write_rows(rows + of[1], rows + of[kOther + 1], t.of1);
      write_rows(rows + of[2], rows + of[kOther + 2], t.of2);
      write_rows(rows + of[3], rows + of[kOther + 3], t.of3);
    }
  }

  // A row of two bodies is shorter than 2^13, and one of a body and the static geometry, whose normals may
  // have any length, than 2^14. So the sum is below 2^31.
  TANDEM_INLINE static V speed(const RigidImpulse& row, std::size_t at, const Motion& a, const Motion& b) {
    const V of_a = products(a.w_xy, read<V>(row.arm_a_xy + at)) + products(a.w_z, read<V>(row.arm_a_z + at));
    const V of_b = products(b.w_xy, read<V>(row.arm_b_xy + at)) + products(b.w_z, read<V>(row.arm_b_z + at));
    const V of_v = products(word_differences(a.v_xy, b.v_xy), read<V>(row.d_xy + at)) +
                   products(word_differences(a.v_z, b.v_z), read<V>(row.d_z + at));
    return (of_v + of_a - of_b) >> L::kBits;
  }

  // The impulse that brings the speed along a row to `wanted`.
  TANDEM_PART static V needed(const RigidImpulse& row, std::size_t at, V wanted, const Motion& a,
                              const Motion& b) {
    const V missing = within(wanted - speed(row, at, a, b), constant<V>(L::kMostWord));
    return (products(missing << 16, read<V>(row.d_z + at)) + (1 << (L::kInverseBits - 1))) >> L::kInverseBits;
  }

  // An impulse times 2^3 in both words: with it, word_parts() divides by 2^12.
  TANDEM_INLINE static V eightfold(V impulse) { return words_of(impulse << 3, impulse << 3); }
  TANDEM_INLINE static V shared(V impulse, const std::int32_t* share) {
    return eightfold((products(impulse & 0xFFFF, read<V>(share)) + L::kOne / 2) >> L::kBits);
  }

  TANDEM_PART static void apply(const RigidGroup& g, const RigidImpulse& row, std::size_t at, V impulse,
                                Motion& a, Motion& b) {
    const V both = eightfold(impulse);
    const V d_xy = read<V>(row.d_xy + at);
    const V d_z = read<V>(row.d_z + at) & 0xFFFF;
    if (g.alike) {
      const V xy = word_parts(both, d_xy);
      const V z = word_parts(both, d_z);
      a.v_xy = word_sums(a.v_xy, xy);
      a.v_z = word_sums(a.v_z, z);
      b.v_xy = word_differences(b.v_xy, xy);
      b.v_z = word_differences(b.v_z, z);
    } else {
      const V of_a = shared(impulse, g.share_a + at);
      const V of_b = shared(impulse, g.share_b + at);
      a.v_xy = word_sums(a.v_xy, word_parts(of_a, d_xy));
      a.v_z = word_sums(a.v_z, word_parts(of_a, d_z));
      b.v_xy = word_differences(b.v_xy, word_parts(of_b, d_xy));
      b.v_z = word_differences(b.v_z, word_parts(of_b, d_z));
    }
    a.w_xy = word_sums(a.w_xy, word_parts(both, read<V>(row.turn_a_xy + at)));
    a.w_z = word_sums(a.w_z, word_parts(both, read<V>(row.turn_a_z + at)));
    b.w_xy = word_differences(b.w_xy, word_parts(both, read<V>(row.turn_b_xy + at)));
    b.w_z = word_differences(b.w_z, word_parts(both, read<V>(row.turn_b_z + at)));
  }

  TANDEM_INLINE static void want(const RigidMaterial& material, RigidContact& c, std::size_t at, V way) {
    const V now = within(read<V>(c.gap + at) + way, constant<V>(L::kMostGap));
    const V out = at_most(((-now * L::kPushOut) << static_cast<int>(material.substep_bits)) >> 8,
                          constant<V>(material.most_push_out));
    const V room = at_most((material.slop - now) << static_cast<int>(material.substep_bits), V{});
    const V free = constant<V>(-L::kMostWord);
    write<V>(c.wanted + at, now < 0 ? out : now > constant<V>(material.near) ? free : room);
  }

  TANDEM_INLINE static void want_all(const RigidMaterial& material, const RigidGroup& g, std::size_t at,
                                     RigidContact* contacts, const RigidRow* way, std::int32_t substep) {
    if (substep == 1) {
      for (std::uint32_t i = 0; i < g.count; ++i) want(material, contacts[i], at, V{});
      return;
    }
    const char* const rows = reinterpret_cast<const char*>(way);
    const Motion a = read_motion(rows, g.a + at);
    const Motion b = read_motion(rows, g.b + at);
    for (std::uint32_t i = 0; i < g.count; ++i)
      want(material, contacts[i], at, speed(contacts[i].normal, at, a, b));
  }

  TANDEM_INLINE static void solve(const RigidMaterial& material, const RigidGroup& g, std::size_t at,
                                  RigidContact* contacts, char* now) {
    Motion a = read_motion(now, g.a + at);
    Motion b = read_motion(now, g.b + at);
    bool changed = false;
    for (std::uint32_t i = 0; i < g.count; ++i) {
      RigidContact& c = contacts[i];
      const V before = read<V>(c.normal.push + at);
      const V all = at_most(at_least(before + needed(c.normal, at, read<V>(c.wanted + at), a, b), V{}),
                            constant<V>(L::kMostImpulse));
      if (!any(all | before)) continue;
      changed = true;
      // What apply() takes has 13 bits; with a sharper limit of slides they are 0 where nothing pushes.
      const V change = within(all - before, constant<V>(L::kMostChange));
      const V push = before + change;
      apply(g, c.normal, at, change, a, b);
      write<V>(c.normal.push + at, push);
      V most = at_most((push * material.friction) >> L::kBits, constant<V>(L::kMostSlide));
      for (RigidImpulse& row : c.tangents) {
        const V slid = read<V>(row.push + at);
        const V slide = within(slid + needed(row, at, V{}, a, b), most);
        apply(g, row, at, slide - slid, a, b);
        write<V>(row.push + at, slide);
        most = most >> L::kAcrossBits;
      }
    }
    if (!changed) return;
    write_motion(now, g.a + at, a);
    write_motion(now, g.b + at, b);
  }

  TANDEM_INLINE static void relax(const RigidGroup& g, std::size_t at, RigidContact* contacts, char* now) {
    Motion a = read_motion(now, g.a + at);
    Motion b = read_motion(now, g.b + at);
    for (std::uint32_t i = 0; i < g.count; ++i) {
      RigidContact& c = contacts[i];
      const V before = read<V>(c.normal.push + at);
      const V wanted = at_most(read<V>(c.wanted + at), V{});
      const V all =
          at_most(at_least(before + needed(c.normal, at, wanted, a, b), V{}), constant<V>(L::kMostImpulse));
      apply(g, c.normal, at, within(all - before, constant<V>(L::kMostChange)), a, b);
    }
    write_motion(now, g.a + at, a);
    write_motion(now, g.b + at, b);
  }

  // The motions at the start of a sub-step: what fell, and again what the impulses of the one before did.
  TANDEM_INLINE static void begin(const RigidMaterial& material, const RigidMotions& motions,
                                  std::int32_t substep) {
    const auto bits = static_cast<int>(material.substep_bits);
    for (std::size_t i = 0; i < motions.rows; ++i) {
      const Four now = read<Four>(motions.now + i);
      const Four fall = read<Four>(motions.fall + i);
      const Four low = low_word(fall);
      const Four high = high_word(fall);
      const Four part = words_of(((substep * low) >> bits) - (((substep - 1) * low) >> bits),
                                 ((substep * high) >> bits) - (((substep - 1) * high) >> bits));
      const Four base = word_sums(now, part);
      const Four before = read<Four>(motions.base + i);
      write(motions.base + i, base);
      write(motions.now + i, substep > 1 ? word_sums(base, word_differences(now, before)) : base);
    }
  }

  TANDEM_INLINE static void end(const RigidMaterial& material, const RigidMotions& motions) {
    const auto bits = static_cast<int>(material.substep_bits);
    for (std::size_t i = 0; i < motions.rows; ++i) {
      const Four now = read<Four>(motions.now + i);
      RigidMoved& moved = motions.moved[i];
      const Four low = read<Four>(moved.even) + low_word(now);
      const Four high = read<Four>(moved.odd) + high_word(now);
      write(moved.even, low);
      write(moved.odd, high);
      write(motions.way + i, words_of(low >> bits, high >> bits));
    }
  }

  /// Implements RigidKernels::solve.
  TANDEM_INLINE static void solve_all(const RigidMaterial& material, const RigidGroup* groups,
                                      std::size_t count, RigidContact* contacts,
                                      const RigidMotions& motions) {
    char* const now = reinterpret_cast<char*>(motions.now);
    const std::int32_t substeps = 1 << material.substep_bits;
    for (std::int32_t substep = 1; substep <= substeps; ++substep) {
      begin(material, motions, substep);
      const int passes = substep == 1 ? L::kFirstPasses : L::kLaterPasses;
      for (int pass = 0; pass < passes; ++pass) {
        for (std::size_t i = 0; i < count * kParts; ++i) {
          const RigidGroup& g = groups[i / kParts];
          const std::size_t at = i % kParts * kWidth;
          if (pass == 0) want_all(material, g, at, contacts + g.first, motions.way, substep);
          solve(material, g, at, contacts + g.first, now);
        }
      }
      end(material, motions);
    }
    for (std::size_t i = 0; i < count * kParts; ++i) {
      const RigidGroup& g = groups[i / kParts];
      relax(g, i % kParts * kWidth, contacts + g.first, now);
    }
  }

  struct Axes {
    V x, y, z;
  };
  struct Matrix {
    V xx, yy, zz, xy, yz, zx;
  };

  TANDEM_INLINE static Axes cross(const Axes& a, const Axes& b) {
    return {(a.y * b.z - a.z * b.y) >> L::kBits, (a.z * b.x - a.x * b.z) >> L::kBits,
            (a.x * b.y - a.y * b.x) >> L::kBits};
  }
  TANDEM_INLINE static V part(V sum, V share) {
    return (within(sum >> L::kInertiaBits, constant<V>(L::kMostWord)) * share) >> L::kBits;
  }
  TANDEM_PART static Axes turn(const Matrix& m, const Axes& x, V share) {
    return {part(m.xx * x.x + m.xy * x.y + m.zx * x.z, share),
            part(m.xy * x.x + m.yy * x.y + m.yz * x.z, share),
            part(m.zx * x.x + m.yz * x.y + m.zz * x.z, share)};
  }
  TANDEM_INLINE static void write_axes(std::int32_t* xy, std::int32_t* z, const Axes& x) {
    write<V>(xy, words_of(x.x, x.y));
    write<V>(z, x.z & 0xFFFF);
  }
  TANDEM_INLINE static Axes read_axes(const std::int32_t (*from)[RigidGroup::kPairs], std::size_t at) {
    return {read<V>(from[0] + at), read<V>(from[1] + at), read<V>(from[2] + at)};
  }
  TANDEM_INLINE static Matrix read_matrix(const std::int32_t (*from)[RigidGroup::kPairs], std::size_t at) {
    return {read<V>(from[0] + at), read<V>(from[1] + at), read<V>(from[2] + at),
            read<V>(from[3] + at), read<V>(from[4] + at), read<V>(from[5] + at)};
  }

  // The input of put_row() for a group: one pair of bodies in each lane.
  struct Pairs {
    std::int32_t inertia_a[6][RigidGroup::kPairs], inertia_b[6][RigidGroup::kPairs];
    std::int32_t n[3][RigidGroup::kPairs], slip[3][RigidGroup::kPairs], arm_a[3][RigidGroup::kPairs],
        arm_b[3][RigidGroup::kPairs];
  };

  TANDEM_LARGE static void put_row(const RigidGroup& g, const Pairs& pairs, const Axes& d, std::size_t at,
                                   RigidImpulse& row) {
    const V share_a = read<V>(g.share_a + at);
    const V share_b = read<V>(g.share_b + at);
    const Axes arm_a = cross(read_axes(pairs.arm_a, at), d);
    const Axes arm_b = cross(read_axes(pairs.arm_b, at), d);
    const Axes turn_a = turn(read_matrix(pairs.inertia_a, at), arm_a, share_a);
    const Axes turn_b = turn(read_matrix(pairs.inertia_b, at), arm_b, share_b);
    const V turns = (arm_a.x * turn_a.x + arm_a.y * turn_a.y + arm_a.z * turn_a.z + arm_b.x * turn_b.x +
                     arm_b.y * turn_b.y + arm_b.z * turn_b.z) >>
                    L::kBits;
    const V effect = at_least(share_a + share_b + turns, constant<V>(L::kOne));
    write<V>(row.d_xy + at, words_of(d.x, d.y));
    write<V>(row.d_z + at, words_of(d.z, inverse_of(effect, L::kBits + L::kInverseBits)));
    write_axes(row.arm_a_xy + at, row.arm_a_z + at, arm_a);
    write_axes(row.arm_b_xy + at, row.arm_b_z + at, arm_b);
    write_axes(row.turn_a_xy + at, row.turn_a_z + at, turn_a);
    write_axes(row.turn_b_xy + at, row.turn_b_z + at, turn_b);
    write<V>(row.push + at, V{});
  }

  TANDEM_INLINE static void put_contact(const RigidGroup& g, const Pairs& pairs, std::size_t at,
                                        RigidContact& c) {
    const Axes n = read_axes(pairs.n, at);
    const Axes slip = read_axes(pairs.slip, at);
    // Bodies that do not slide: any tangent, without a root: T. Duff et al., "Building an Orthonormal Basis,
    // Revisited" (2017).
    const V minus = n.z >> 31;
    const auto with_sign = [minus](V x) { return (x ^ minus) - minus; };
    constexpr std::int32_t kHalf = L::kOne / 2;
    const V inverse_z = inverse_of(L::kOne + with_sign(n.z), 2 * L::kBits);
    const V x = (n.x * inverse_z + kHalf) >> L::kBits;
    const V xy = (x * n.y + kHalf) >> L::kBits;
    const auto or_any = [none = (slip.x | slip.y | slip.z) == 0](V along, V any) {
      return none ? any : along;
    };
    const Axes along{or_any(slip.x, L::kOne - ((n.x * x + kHalf) >> L::kBits)),
                     or_any(slip.y, with_sign(-xy)), or_any(slip.z, -n.x)};
    put_row(g, pairs, n, at, c.normal);
    put_row(g, pairs, along, at, c.tangents[0]);
    put_row(g, pairs, cross(n, along), at, c.tangents[1]);
  }

  /// Implements RigidKernels::put.
  TANDEM_INLINE static void put_all(const RigidTouch* const* touches, const RigidFound* found,
                                    const RigidMass* masses, RigidGroup& g, RigidContact* contacts) {
    Pairs pairs;
    g.alike = true;
    g.count = 0;
    for (std::size_t k = 0; k < RigidGroup::kPairs; ++k) {
      const RigidTouch& touch = *touches[k];
      g.a[k] = touch.a * static_cast<std::uint32_t>(sizeof(RigidRow));
      g.b[k] = touch.b * static_cast<std::uint32_t>(sizeof(RigidRow));
      g.share_a[k] = touch.share_a;
      g.share_b[k] = touch.share_b;
      g.alike = g.alike && touch.share_a == L::kOne && touch.share_b == L::kOne;
      if (touch.count > g.count) g.count = touch.count;
      for (std::size_t m = 0; m < 6; ++m) {
        pairs.inertia_a[m][k] = masses[touch.a].inertia[m];
        pairs.inertia_b[m][k] = masses[touch.b].inertia[m];
      }
    }
    for (std::uint32_t i = 0; i < g.count; ++i) {
      for (std::size_t k = 0; k < RigidGroup::kPairs; ++k) {
        const bool is = i < touches[k]->count;
        const RigidFound& point = found[touches[k]->first + (is ? i : 0)];
        for (std::size_t m = 0; m < 3; ++m) {
          pairs.n[m][k] = is ? point.n[m] : 0;
          pairs.slip[m][k] = is ? point.slip[m] : 0;
          pairs.arm_a[m][k] = is ? point.arm_a[m] : 0;
          pairs.arm_b[m][k] = is ? point.arm_b[m] : 0;
        }
        contacts[i].gap[k] = is ? point.gap : L::kMostGap;  // this one never pushes
      }
      for (std::size_t at = 0; at < RigidGroup::kPairs; at += kWidth) put_contact(g, pairs, at, contacts[i]);
    }
  }
};

}  // namespace tandem
