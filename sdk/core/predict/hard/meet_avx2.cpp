// meet.cpp for four pairs at a time. No inline function of other headers is called here, because the linker
// might keep its AVX2 copy for all callers.
#include "sdk/core/predict/hard/meet.hpp"

#ifdef __AVX2__

#include <immintrin.h>

#include "sdk/core/lattice/fixed_point.hpp"

namespace tandem {
namespace {

using Four = __m128i;  // of 32 bits
using Wide = __m256i;  // four of 64 bits
constexpr std::uint32_t kAtOnce = 4;

inline Wide same(std::int64_t x) { return _mm256_set1_epi64x(x); }
inline Wide wide(Four x) { return _mm256_cvtepi32_epi64(x); }
inline Wide sum(Wide a, Wide b) { return _mm256_add_epi64(a, b); }
inline Wide minus(Wide a, Wide b) { return _mm256_sub_epi64(a, b); }
inline Wide greater(Wide a, Wide b) { return _mm256_cmpgt_epi64(a, b); }
// Products of the lower halves, with and without sign.
inline Wide signed_product(Wide a, Wide b) { return _mm256_mul_epi32(a, b); }
inline Wide product(Wide a, Wide b) { return _mm256_mul_epu32(a, b); }
// x >> bits with its sign, for |x| < 2^60.
inline Wide shifted(Wide x, Four bits) {
  const Wide bias = same(std::int64_t{1} << 60);
  return minus(_mm256_srl_epi64(sum(x, bias), bits), _mm256_srl_epi64(bias, bits));
}
inline Four lower_halves(Wide x) {
  return _mm256_castsi256_si128(_mm256_permutevar8x32_epi32(x, _mm256_setr_epi32(0, 2, 4, 6, 0, 2, 4, 6)));
}
inline unsigned bits_set(Wide mask) {
  return static_cast<unsigned>(_mm256_movemask_pd(_mm256_castsi256_pd(mask)));
}

inline void transpose(Four& a, Four& b, Four& c, Four& d) {
  const Four ab_low = _mm_unpacklo_epi32(a, b);
  const Four ab_high = _mm_unpackhi_epi32(a, b);
  const Four cd_low = _mm_unpacklo_epi32(c, d);
  const Four cd_high = _mm_unpackhi_epi32(c, d);
  a = _mm_unpacklo_epi64(ab_low, cd_low);
  b = _mm_unpackhi_epi64(ab_low, cd_low);
  c = _mm_unpacklo_epi64(ab_high, cd_high);
  d = _mm_unpackhi_epi64(ab_high, cd_high);
}

// Four pairs: the difference of places wraps at 2^31 alone, which has the same square.
struct Pairs {
  Four d[3]{}, u[3]{};
  Four radii{};

  Pairs(const ContactBody* bodies, const std::uint32_t* first, const std::uint32_t* second) {
    const Four signs = _mm_setr_epi32(1, 1, 1, -1);  // so that the difference of the radii is their sum
    Four row[4], speed[4];
    for (unsigned k = 0; k < kAtOnce; ++k) {
      const auto* const a = reinterpret_cast<const Four*>(bodies + first[k]);
      const auto* const b = reinterpret_cast<const Four*>(bodies + second[k]);
      row[k] = _mm_sub_epi32(_mm_load_si128(a), _mm_sign_epi32(_mm_load_si128(b), signs));
      speed[k] = _mm_sub_epi32(_mm_load_si128(a + 1), _mm_load_si128(b + 1));
    }
    transpose(row[0], row[1], row[2], row[3]);
    transpose(speed[0], speed[1], speed[2], speed[3]);
    for (unsigned i = 0; i < 3; ++i) {
      d[i] = row[i];
      u[i] = speed[i];
    }
    radii = row[3];
  }
  [[nodiscard]] Wide squared() const {
    Wide all = {};
    for (const Four& x : d) all = sum(all, signed_product(wide(x), wide(x)));
    return all;
  }
};

// Bit k is set if pair k may touch. Nearly all pairs do, so all of them are computed to the end.
unsigned near_of(const HardReach& reach, const Pairs& p, Wide squared) {
  const Four way = _mm_srli_epi32(
      _mm_add_epi32(_mm_add_epi32(_mm_abs_epi32(p.u[0]), _mm_abs_epi32(p.u[1])), _mm_abs_epi32(p.u[2])), 6);
  const Wide most = wide(_mm_add_epi32(_mm_add_epi32(p.radii, _mm_set1_epi32(reach.reach)), way));
  // A sum of squares from 2^63 on is negative here.
  return bits_set(_mm256_andnot_si256(greater(Wide{}, squared), greater(product(most, most), squared)));
}

// Bit k is set if a contact may change a body of pair k.
unsigned movable(const HardBodies& of, const std::uint32_t* first, const std::uint32_t* second) {
  unsigned bits = 0;
  for (unsigned k = 0; k < kAtOnce; ++k)
    bits |= static_cast<unsigned>((of.mobility[first[k]] | of.mobility[second[k]]) != 0) << k;
  return bits;
}

// Two vectors at a time, by turns: what follows is one long chain, in which each step waits for the one
// before.
struct Two {
  Wide of[2];
};
template <class Operation>
inline Two each(Operation operation) {
  return {{operation(0), operation(1)}};
}

// Moves x up by an even number of bits, until it is at least 2^62, and adds the number to `up`.
template <int kBits>
inline void move_up(Two& x, Two& up) {
  const Two by = each([&](int k) {
    return _mm256_and_si256(_mm256_cmpeq_epi64(_mm256_srli_epi64(x.of[k], 64 - kBits), Wide{}), same(kBits));
  });
  x = each([&](int k) { return _mm256_sllv_epi64(x.of[k], by.of[k]); });
  up = each([&](int k) { return sum(up.of[k], by.of[k]); });
}

struct Distance {
  Two root, inverse;  // 2^40 / root, rounded down
};

inline Wide looked_up(Wide m) {
  alignas(32) std::uint64_t at[kAtOnce];
  _mm256_store_si256(reinterpret_cast<Wide*>(at), _mm256_srli_epi64(m, 24));
  const std::uint16_t* const table = reinterpret_cast<const std::uint16_t*>(&kInverseRoots);
  return _mm256_setr_epi64x(table[at[0]], table[at[1]], table[at[2]], table[at[3]]);
}

// As quick_root(), for x from 2^19 to 2^56 - 1: so the inverse is below 2^31.
inline Distance distance(const Two& x) {
  Two m = each([&](int k) { return _mm256_slli_epi64(x.of[k], 8); });
  Two up = each([&](int) { return same(8); });
  move_up<32>(m, up);
  move_up<16>(m, up);
  move_up<8>(m, up);
  move_up<4>(m, up);
  move_up<2>(m, up);
  m = each([&](int k) { return _mm256_srli_epi64(m.of[k], 32); });
  const Two half = each([&](int k) { return _mm256_srli_epi64(up.of[k], 1); });
  const Two first = each([&](int k) { return looked_up(m.of[k]); });
  const Wide three = same(std::int64_t{3} << 30);
  const Two missing = each([&](int k) {
    return minus(three, _mm256_srli_epi64(product(product(first.of[k], first.of[k]), m.of[k]), 32));
  });
  Two r = each([&](int k) { return _mm256_srli_epi64(product(first.of[k], missing.of[k]), 16); });
  const Two twice = each([&](int k) { return _mm256_srli_epi64(product(r.of[k], r.of[k]), 30); });
  const Two left =
      each([&](int k) { return minus(three, _mm256_srli_epi64(product(twice.of[k], m.of[k]), 32)); });
  r = each([&](int k) { return _mm256_srli_epi64(product(r.of[k], left.of[k]), 31); });
  Two root =
      each([&](int k) { return _mm256_srlv_epi64(product(m.of[k], r.of[k]), sum(half.of[k], same(30))); });
  root = each([&](int k) { return sum(root.of[k], greater(product(root.of[k], root.of[k]), x.of[k])); });
  root = each([&](int k) {
    const Wide next = sum(root.of[k], same(1));
    return minus(root.of[k], _mm256_andnot_si256(greater(product(next, next), x.of[k]), same(-1)));
  });
  // The inverse of the root before it was rounded; each step squares what is missing. r may be a little too
  // large, but nothing here has a sign.
  const Wide whole = same(std::int64_t{1} << 40);
  Two inverse =
      each([&](int k) { return minus(_mm256_srlv_epi64(r.of[k], minus(same(22), half.of[k])), same(4)); });
  for (int step = 0; step < 2; ++step) {
    inverse = each([&](int k) {
      const Wide rest = minus(whole, product(inverse.of[k], root.of[k]));
      return sum(inverse.of[k], _mm256_srli_epi64(product(rest, inverse.of[k]), 40));
    });
  }
  for (int step = 0; step < 2; ++step) {
    inverse = each([&](int k) {
      const Wide rest = minus(whole, product(inverse.of[k], root.of[k]));
      return minus(inverse.of[k], _mm256_andnot_si256(greater(root.of[k], rest), same(-1)));
    });
  }
  return {root, inverse};
}

// Four pairs whose distance is known. Returns the bits of those that touch.
struct Found {
  Four head[kAtOnce], tail[kAtOnce];
};
inline unsigned contacts_of(const HardReach& reach, const Pairs& p, Wide root, Wide inverse,
                            const std::uint32_t* first, const std::uint32_t* second, Found& found) {
  const Four shift = _mm_cvtsi32_si128(static_cast<int>(reach.shift));
  Four n[3];
  Wide speed = {};
  for (unsigned k = 0; k < 3; ++k) {
    const Wide whole = sum(signed_product(wide(p.d[k]), inverse), same(1 << 27));
    n[k] = lower_halves(_mm256_srli_epi64(whole, 28));
    speed = sum(speed, signed_product(wide(p.u[k]), wide(n[k])));
  }
  speed = shifted(speed, _mm_cvtsi32_si128(12));
  const Wide gap = _mm256_slli_epi64(minus(root, wide(p.radii)), 6);
  const Wide later = sum(gap, _mm256_and_si256(speed, greater(Wide{}, speed)));
  const Wide most_gap = same(HardLaw::kMaxWord);
  Wide in_units = shifted(gap, shift);
  in_units = _mm256_blendv_epi8(in_units, most_gap, greater(in_units, most_gap));
  const Wide least = minus(Wide{}, most_gap);
  in_units = _mm256_blendv_epi8(in_units, least, greater(least, in_units));
  found = {{_mm_loadu_si128(reinterpret_cast<const __m128i_u*>(first)),
            _mm_loadu_si128(reinterpret_cast<const __m128i_u*>(second)), n[0], n[1]},
           {n[2], lower_halves(in_units), Four{},
            lower_halves(_mm256_srli_epi64(greater(later, same(reach.met)), 63))}};
  transpose(found.head[0], found.head[1], found.head[2], found.head[3]);
  transpose(found.tail[0], found.tail[1], found.tail[2], found.tail[3]);
  return bits_set(greater(same(std::int64_t{reach.reach} * 64), later));
}

std::uint32_t meet(const HardReach& reach, const HardBodies& of, const ContactPairs& pairs,
                   HardContact* found) {
  // What is read behind the pairs are bodies, too.
  constexpr std::uint32_t kEach = 2 * kAtOnce;
  for (unsigned k = 0; k < kEach; ++k) pairs.first[pairs.count + k] = pairs.second[pairs.count + k] = 0;
  const HardMeet one_by_one = portable_hard_meet();
  std::uint32_t count = 0;
  for (std::uint32_t i = 0; i < pairs.count; i += kEach) {
    std::uint32_t* const first = pairs.first + i;
    std::uint32_t* const second = pairs.second + i;
    const std::uint32_t left = pairs.count - i < kEach ? pairs.count - i : kEach;
    const Pairs p[2] = {{of.bodies, first, second}, {of.bodies, first + kAtOnce, second + kAtOnce}};
    const Two squared = each([&](int k) { return p[k].squared(); });
    const auto bits_of = [&](auto of_four) { return of_four(0) | of_four(1) << kAtOnce; };
    unsigned near = bits_of([&](int k) { return near_of(reach, p[k], squared.of[k]); }) & ((1U << left) - 1);
    const unsigned close = bits_of([&](int k) { return bits_set(greater(same(1 << 19), squared.of[k])); });
    if ((close & near) != 0) {
      count += one_by_one(reach, of, {first, second, left}, found + count);
      continue;
    }
    if (of.any_fixed)
      near &= movable(of, first, second) | movable(of, first + kAtOnce, second + kAtOnce) << kAtOnce;
    if (near == 0) continue;
    const Distance far = distance(squared);
    for (unsigned part = 0; part < 2; ++part) {
      Found four;
      const unsigned touching =
          near >> (part * kAtOnce) & contacts_of(reach, p[part], far.root.of[part], far.inverse.of[part],
                                                 first + part * kAtOnce, second + part * kAtOnce, four);
      for (unsigned k = 0; k < kAtOnce; ++k) {
        auto* const to = reinterpret_cast<Four*>(found + count);
        _mm_store_si128(to, four.head[k]);
        _mm_store_si128(to + 1, four.tail[k]);
        count += (touching >> k) & 1U;
      }
    }
  }
  return count;
}

}  // namespace

HardMeet avx2_hard_meet() { return meet; }

}  // namespace tandem

#endif
