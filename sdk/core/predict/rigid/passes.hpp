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
#include "sdk/core/predict/rigid/word_pairs.hpp"

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

  /// The motions of both bodies of a pair: a's spin along z is the low word, b's the high one.
  struct Motions {
    V a_v_xy, a_v_z, a_w_xy, b_v_xy, b_v_z, b_w_xy, w_z;
  };
  TANDEM_INLINE static Motions read_motions(const char* rows, const RigidGroup& g, std::size_t at) {
    const Motion a = read_motion(rows, g.a + at);
    const Motion b = read_motion(rows, g.b + at);
    return {a.v_xy, a.v_z, a.w_xy, b.v_xy, b.v_z, b.w_xy, words_of(a.w_z, b.w_z)};
  }
  TANDEM_INLINE static void write_motions(char* rows, const RigidGroup& g, std::size_t at,
                                          const Motions& of) {
    write_motion(rows, g.a + at, {of.a_v_xy, of.a_v_z, of.a_w_xy, of.w_z & 0xFFFF});
    write_motion(rows, g.b + at, {of.b_v_xy, of.b_v_z, of.b_w_xy, (of.w_z >> 16) & 0xFFFF});
  }

  // A row of two bodies is shorter than 2^13, and one of a body and the static geometry, whose normals may
  // have any length, than 2^14. So the sum is below 2^31.
  TANDEM_INLINE static V speed(const RigidImpulse& row, std::size_t at, const Motions& of) {
    const V of_a = dot16(of.a_w_xy, read<V>(row.arm_a_xy + at));
    const V of_b = dot16(of.b_w_xy, read<V>(row.arm_b_xy + at));
    const V of_v = dot16(sub_sat16(of.a_v_xy, of.b_v_xy), read<V>(row.d_xy + at)) +
                   dot16(sub_sat16(of.a_v_z, of.b_v_z), read<V>(row.d_z + at));
    return (of_v + of_a - of_b + dot16(of.w_z, read<V>(row.arm_z + at))) >> L::kBits;
  }

  // The impulse that brings the speed along a row to `wanted`.
  TANDEM_PART static V needed(const RigidImpulse& row, std::size_t at, V wanted, const Motions& of) {
    const V missing = within(wanted - speed(row, at, of), constant<V>(L::kMaxWord));
    return (dot16(missing << 16, read<V>(row.d_z + at)) + (1 << (L::kInverseBits - 1))) >> L::kInverseBits;
  }

  // An impulse times 2^3 in both words: with it, mul_q15() divides by 2^12.
  TANDEM_INLINE static V eightfold(V impulse) { return twice_the_word(impulse << 3); }
  TANDEM_INLINE static V shared(V impulse, const std::int32_t* share) {
    return eightfold((dot16(impulse & 0xFFFF, read<V>(share)) + L::kOne / 2) >> L::kBits);
  }

  TANDEM_PART static void apply(const RigidGroup& g, const RigidImpulse& row, std::size_t at, V impulse,
                                Motions& of) {
    const V both = eightfold(impulse);
    const V d_xy = read<V>(row.d_xy + at);
    const V d_z = read<V>(row.d_z + at) & 0xFFFF;
    if (g.alike) {
      const V xy = mul_q15(both, d_xy);
      const V z = mul_q15(both, d_z);
      of.a_v_xy = add_sat16(of.a_v_xy, xy);
      of.a_v_z = add_sat16(of.a_v_z, z);
      of.b_v_xy = sub_sat16(of.b_v_xy, xy);
      of.b_v_z = sub_sat16(of.b_v_z, z);
    } else {
      const V of_a = shared(impulse, g.share_a + at);
      const V of_b = shared(impulse, g.share_b + at);
      of.a_v_xy = add_sat16(of.a_v_xy, mul_q15(of_a, d_xy));
      of.a_v_z = add_sat16(of.a_v_z, mul_q15(of_a, d_z));
      of.b_v_xy = sub_sat16(of.b_v_xy, mul_q15(of_b, d_xy));
      of.b_v_z = sub_sat16(of.b_v_z, mul_q15(of_b, d_z));
    }
    of.a_w_xy = add_sat16(of.a_w_xy, mul_q15(both, read<V>(row.turn_a_xy + at)));
    of.b_w_xy = sub_sat16(of.b_w_xy, mul_q15(both, read<V>(row.turn_b_xy + at)));
    of.w_z = add_sat16(of.w_z, high_negated(mul_q15(both, read<V>(row.turn_z + at))));
  }

  TANDEM_INLINE static void want(const RigidMaterial& material, RigidContact& c, std::size_t at, V way) {
    const V now = within(read<V>(c.gap + at) + way, constant<V>(L::kMaxGap));
    const V out = at_most(((-now * L::kPushOut) << static_cast<int>(material.substep_bits)) >> 8,
                          constant<V>(material.most_push_out));
    const V room = at_most((material.slop - now) << static_cast<int>(material.substep_bits), V{});
    const V free = constant<V>(-L::kMaxWord);
    write<V>(c.wanted + at, now < 0 ? out : now > constant<V>(material.near) ? free : room);
  }

  TANDEM_INLINE static void want_all(const RigidMaterial& material, const RigidGroup& g, std::size_t at,
                                     RigidContact* contacts, const RigidRow* way, std::int32_t substep) {
    if (substep == 1) {
      for (std::uint32_t i = 0; i < g.count; ++i) want(material, contacts[i], at, V{});
      return;
    }
    const char* const rows = reinterpret_cast<const char*>(way);
    const Motions of = read_motions(rows, g, at);
    for (std::uint32_t i = 0; i < g.count; ++i)
      want(material, contacts[i], at, speed(contacts[i].normal, at, of));
  }

  TANDEM_INLINE static void solve(const RigidMaterial& material, const RigidGroup& g, std::size_t at,
                                  RigidContact* contacts, char* now) {
    Motions of = read_motions(now, g, at);
    bool changed = false;
    for (std::uint32_t i = 0; i < g.count; ++i) {
      RigidContact& c = contacts[i];
      const V before = read<V>(c.normal.push + at);
      const V all = at_most(at_least(before + needed(c.normal, at, read<V>(c.wanted + at), of), V{}),
                            constant<V>(L::kMaxImpulse));
      if (!any(all | before)) continue;
      changed = true;
      // What apply() takes has 13 bits; with a sharper limit of slides they are 0 where nothing pushes.
      const V change = within(all - before, constant<V>(L::kMaxChange));
      const V push = before + change;
      apply(g, c.normal, at, change, of);
      write<V>(c.normal.push + at, push);
      V most = at_most((push * material.friction) >> L::kBits, constant<V>(L::kMaxSlide));
      for (RigidImpulse& row : c.tangents) {
        const V slid = read<V>(row.push + at);
        const V slide = within(slid + needed(row, at, V{}, of), most);
        apply(g, row, at, slide - slid, of);
        write<V>(row.push + at, slide);
        most = most >> L::kAcrossBits;
      }
    }
    if (changed) write_motions(now, g, at, of);
  }

  TANDEM_INLINE static void relax(const RigidGroup& g, std::size_t at, RigidContact* contacts, char* now) {
    Motions of = read_motions(now, g, at);
    bool changed = false;
    for (std::uint32_t i = 0; i < g.count; ++i) {
      RigidContact& c = contacts[i];
      const V before = read<V>(c.normal.push + at);
      const V wanted = at_most(read<V>(c.wanted + at), V{});
      const V all =
          at_most(at_least(before + needed(c.normal, at, wanted, of), V{}), constant<V>(L::kMaxImpulse));
      if (!any(all | before)) continue;
      changed = true;
      apply(g, c.normal, at, within(all - before, constant<V>(L::kMaxChange)), of);
    }
    if (changed) write_motions(now, g, at, of);
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
      const Four base = add_sat16(now, part);
      const Four before = read<Four>(motions.base + i);
      write(motions.base + i, base);
      write(motions.now + i, substep > 1 ? add_sat16(base, sub_sat16(now, before)) : base);
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

  TANDEM_INLINE static Axes cross(const Axes& a, const Axes& b, int bits = L::kBits) {
    return {(a.y * b.z - a.z * b.y) >> bits, (a.z * b.x - a.x * b.z) >> bits,
            (a.x * b.y - a.y * b.x) >> bits};
  }
  TANDEM_INLINE static V part(V sum, V share) {
    return (within(sum >> L::kInertiaBits, constant<V>(L::kMaxWord)) * share) >> L::kBits;
  }
  TANDEM_PART static Axes turn(const Matrix& m, const Axes& x, V share) {
    return {part(m.xx * x.x + m.xy * x.y + m.zx * x.z, share),
            part(m.xy * x.x + m.yy * x.y + m.yz * x.z, share),
            part(m.zx * x.x + m.yz * x.y + m.zz * x.z, share)};
  }
  // Eight integers of each of kWidth records.
  struct Record {
    Rows<V> first, last;
  };
  TANDEM_INLINE static Record read_records(const char* const* records) {
    Record x;
    if constexpr (kWidth == 1) {
      static_assert(sizeof x == sizeof(RigidFound) && sizeof x == sizeof(RigidMass));
      x = read<Record>(records[0]);
    } else {
      constexpr std::size_t kOther = kWidth - 4;
      Rows<V> half[2];
      for (std::size_t i = 0; i < 2; ++i) {
        const std::size_t at = 16 * i;
        read_rows(half[i].of0, records[0] + at, records[kOther] + at);
        read_rows(half[i].of1, records[1] + at, records[kOther + 1] + at);
        read_rows(half[i].of2, records[2] + at, records[kOther + 2] + at);
        read_rows(half[i].of3, records[3] + at, records[kOther + 3] + at);
      }
      x = {transposed(half[0]), transposed(half[1])};
    }
    return x;
  }
  TANDEM_INLINE static Matrix matrix_of(const Record& x) {
    return {x.first.of0, x.first.of1, x.first.of2, x.first.of3, x.last.of0, x.last.of1};
  }

  // The input of put_row(): one pair of bodies in each lane.
  struct Pairs {
    Matrix inertia_a, inertia_b;
    Axes n, arm_a, arm_b;
    Axes speed, spin_a, spin_b;  // a's less b's velocity, and spins, in the first sub-step
  };

  TANDEM_LARGE static void put_row(const RigidGroup& g, const Pairs& pairs, const Axes& d, std::size_t at,
                                   RigidImpulse& row) {
    const V share_a = read<V>(g.share_a + at);
    const V share_b = read<V>(g.share_b + at);
    const Axes arm_a = cross(pairs.arm_a, d);
    const Axes arm_b = cross(pairs.arm_b, d);
    const Axes turn_a = turn(pairs.inertia_a, arm_a, share_a);
    const Axes turn_b = turn(pairs.inertia_b, arm_b, share_b);
    const V turns = (arm_a.x * turn_a.x + arm_a.y * turn_a.y + arm_a.z * turn_a.z + arm_b.x * turn_b.x +
                     arm_b.y * turn_b.y + arm_b.z * turn_b.z) >>
                    L::kBits;
    const V effect = at_least(share_a + share_b + turns, constant<V>(L::kOne));
    write<V>(row.d_xy + at, words_of(d.x, d.y));
    write<V>(row.d_z + at, words_of(d.z, inverse_of(effect, L::kBits + L::kInverseBits)));
    write<V>(row.arm_a_xy + at, words_of(arm_a.x, arm_a.y));
    write<V>(row.arm_b_xy + at, words_of(arm_b.x, arm_b.y));
    write<V>(row.arm_z + at, words_of(arm_a.z, -arm_b.z));
    write<V>(row.turn_a_xy + at, words_of(turn_a.x, turn_a.y));
    write<V>(row.turn_b_xy + at, words_of(turn_b.x, turn_b.y));
    write<V>(row.turn_z + at, words_of(turn_a.z, turn_b.z));
    write<V>(row.push + at, V{});
  }

  // Where a slides on b at the start of the first sub-step; zeros if nowhere.
  TANDEM_LARGE static Axes direction_of_slip(const Pairs& pairs) {
    const Axes n = pairs.n;
    const Axes of_a = cross(pairs.spin_a, pairs.arm_a, L::kBits - L::kSlipBits);
    const Axes of_b = cross(pairs.spin_b, pairs.arm_b, L::kBits - L::kSlipBits);
    Axes u{(pairs.speed.x << L::kSlipBits) + of_a.x - of_b.x,
           (pairs.speed.y << L::kSlipBits) + of_a.y - of_b.y,
           (pairs.speed.z << L::kSlipBits) + of_a.z - of_b.z};
    const V limit = constant<V>(L::kMaxSlip - 1);
    const V beyond = (within(u.x, limit) ^ u.x) | (within(u.y, limit) ^ u.y) | (within(u.z, limit) ^ u.z);
    const auto scaled = [&](V x) { return beyond != 0 ? within(x >> L::kFastSlipBits, limit) : x; };
    u = {scaled(u.x), scaled(u.y), scaled(u.z)};
    const V apart = (n.x * u.x + n.y * u.y + n.z * u.z) >> L::kBits;
    const auto across = [apart](V x, V along) {
      return within(x - ((along * apart) >> L::kBits), constant<V>(2 * L::kMaxSlip));
    };
    const Axes slip{across(u.x, n.x), across(u.y, n.y), across(u.z, n.z)};
    const V far = root_of(slip.x * slip.x + slip.y * slip.y + slip.z * slip.z);
    const V least = constant<V>(L::kLeastSlip);
    const V inverse = inverse_of(at_least(far, least), 2 * L::kBits);
    const auto unit = [&](V x) { return far < least ? V{} : (x * inverse) >> L::kBits; };
    return {unit(slip.x), unit(slip.y), unit(slip.z)};
  }

  TANDEM_INLINE static void put_contact(const RigidGroup& g, const Pairs& pairs, std::size_t at,
                                        RigidContact& c) {
    const Axes n = pairs.n;
    const Axes slip = direction_of_slip(pairs);
    // Bodies that do not slide: any tangent, without a root: T. Duff et al., "Building an Orthonormal Basis,
    // Revisited" (2017).
    const V minus = n.z >> 31;
    const auto with_sign = [minus](V x) { return (x ^ minus) - minus; };
    constexpr std::int32_t kHalf = L::kOne / 2;
    const V inverse_z = inverse_near_one(L::kOne + with_sign(n.z));
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

  /// How bodies move at the start of the first sub-step.
  struct Start {
    const RigidRow *start, *fall;
    std::uint32_t substep_bits;
  };
  TANDEM_INLINE static Motion read_start(const Start& from, const std::uint32_t* of) {
    return read_motion(reinterpret_cast<const char*>(from.start), of);
  }
  TANDEM_INLINE static Axes velocity(const Start& from, const Motion& start, const std::uint32_t* of) {
    const Motion fall = read_motion(reinterpret_cast<const char*>(from.fall), of);
    const int bits = static_cast<int>(from.substep_bits);
    return {low_word(start.v_xy) + (low_word(fall.v_xy) >> bits),
            high_word(start.v_xy) + (high_word(fall.v_xy) >> bits),
            low_word(start.v_z) + (low_word(fall.v_z) >> bits)};
  }

  /// Implements RigidKernels::put.
  TANDEM_INLINE static void put_all(const RigidTouch* const* touches, const RigidFound* found,
                                    const RigidMass* masses, const Start& from, RigidGroup& g,
                                    RigidContact* contacts) {
    static constexpr RigidFound kNone{{}, {}, {}, {}, 0, L::kMaxGap, 0};  // never pushes
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
    }
    for (std::size_t at = 0; at < RigidGroup::kPairs; at += kWidth) {
      const char *of_a[kWidth], *of_b[kWidth], *of_point[kWidth];
      for (std::size_t k = 0; k < kWidth; ++k) {
        of_a[k] = reinterpret_cast<const char*>(masses + touches[at + k]->a);
        of_b[k] = reinterpret_cast<const char*>(masses + touches[at + k]->b);
      }
      Pairs pairs{matrix_of(read_records(of_a)), matrix_of(read_records(of_b)), {}, {}, {}, {}, {}, {}};
      const Motion a = read_start(from, g.a + at);
      const Motion b = read_start(from, g.b + at);
      const Axes v_a = velocity(from, a, g.a + at);
      const Axes v_b = velocity(from, b, g.b + at);
      const V most = constant<V>(L::kMaxWord);
      pairs.speed = {within(v_a.x - v_b.x, most), within(v_a.y - v_b.y, most), within(v_a.z - v_b.z, most)};
      pairs.spin_a = {low_word(a.w_xy), high_word(a.w_xy), low_word(a.w_z)};
      pairs.spin_b = {low_word(b.w_xy), high_word(b.w_xy), low_word(b.w_z)};
      for (std::uint32_t i = 0; i < g.count; ++i) {
        for (std::size_t k = 0; k < kWidth; ++k) {
          const RigidTouch& touch = *touches[at + k];
          of_point[k] = reinterpret_cast<const char*>(i < touch.count ? found + touch.first + i : &kNone);
        }
        const auto [first, last] = read_records(of_point);
        pairs.arm_a = {low_word(first.of0), high_word(first.of0), low_word(first.of1)};
        pairs.arm_b = {high_word(first.of1), low_word(first.of2), high_word(first.of2)};
        pairs.n = {low_word(last.of0), high_word(last.of0), low_word(last.of1)};
        write<V>(contacts[i].gap + at, last.of2);
        put_contact(g, pairs, at, contacts[i]);
      }
    }
  }
};

}  // namespace tandem
