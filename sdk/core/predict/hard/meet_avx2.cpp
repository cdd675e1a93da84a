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

// Keeps the pairs that may touch.
std::uint32_t keep_near(const HardReach& reach, const HardBodies& of, const ContactPairs& pairs) {
  const Four reach_of_all = _mm_set1_epi32(reach.reach);
  std::uint32_t near = 0;
  for (std::uint32_t i = 0; i < pairs.count; i += kAtOnce) {
    const Pairs p(of.bodies, pairs.first + i, pairs.second + i);
    const Four way = _mm_srli_epi32(
        _mm_add_epi32(_mm_add_epi32(_mm_abs_epi32(p.u[0]), _mm_abs_epi32(p.u[1])), _mm_abs_epi32(p.u[2])), 6);
    const Wide most = wide(_mm_add_epi32(_mm_add_epi32(p.radii, reach_of_all), way));
    const Wide squared = p.squared();
    // A sum of squares from 2^63 on is negative here.
    const Wide is_near = _mm256_andnot_si256(greater(Wide{}, squared), greater(product(most, most), squared));
    const unsigned bits = bits_set(is_near);
    for (unsigned k = 0; k < kAtOnce; ++k) {
      const std::uint32_t a = pairs.first[i + k];
      const std::uint32_t b = pairs.second[i + k];
      pairs.first[near] = a;
      pairs.second[near] = b;
      near += (bits >> k) & static_cast<unsigned>((of.mobility[a] | of.mobility[b]) != 0) &
              static_cast<unsigned>(i + k < pairs.count);
    }
  }
  return near;
}

// Moves x up by an even number of bits, until it is at least 2^62, and adds the number to `up`.
template <int kBits>
inline void move_up(Wide& x, Wide& up) {
  const Wide by = _mm256_and_si256(_mm256_cmpeq_epi64(_mm256_srli_epi64(x, 64 - kBits), Wide{}), same(kBits));
  x = _mm256_sllv_epi64(x, by);
  up = sum(up, by);
}

struct Distance {
  Wide root, inverse;  // 2^40 / root, rounded down
};

// As quick_root(), for x from 2^19 to 2^56 - 1: so the inverse is below 2^31.
inline Distance distance(Wide x) {
  Wide m = _mm256_slli_epi64(x, 8);
  Wide up = same(8);
  move_up<32>(m, up);
  move_up<16>(m, up);
  move_up<8>(m, up);
  move_up<4>(m, up);
  move_up<2>(m, up);
  m = _mm256_srli_epi64(m, 32);
  const Wide half = _mm256_srli_epi64(up, 1);
  alignas(32) std::uint64_t at[kAtOnce];
  _mm256_store_si256(reinterpret_cast<Wide*>(at), _mm256_srli_epi64(m, 24));
  const std::uint16_t* const table = reinterpret_cast<const std::uint16_t*>(&kInverseRoots);
  Wide r = _mm256_setr_epi64x(table[at[0]], table[at[1]], table[at[2]], table[at[3]]);
  const Wide three = same(std::int64_t{3} << 30);
  r = _mm256_srli_epi64(product(r, minus(three, _mm256_srli_epi64(product(product(r, r), m), 32))), 16);
  const Wide twice = _mm256_srli_epi64(product(r, r), 30);
  r = _mm256_srli_epi64(product(r, minus(three, _mm256_srli_epi64(product(twice, m), 32))), 31);
  Wide root = _mm256_srlv_epi64(product(m, r), sum(half, same(30)));
  root = sum(root, greater(product(root, root), x));
  const Wide next = sum(root, same(1));
  root = minus(root, _mm256_andnot_si256(greater(product(next, next), x), same(-1)));
  // The inverse of the root before it was rounded; each step squares what is missing.
  const Wide whole = same(std::int64_t{1} << 40);
  Wide inverse = _mm256_srlv_epi64(r, minus(same(22), half));
  for (int step = 0; step < 2; ++step) {
    const Wide left = minus(whole, product(inverse, root));
    inverse = sum(inverse, _mm256_srli_epi64(product(left, inverse), 40));
  }
  for (int step = 0; step < 2; ++step) {
    const Wide left = minus(whole, product(inverse, root));
    inverse = minus(inverse, _mm256_andnot_si256(greater(root, left), same(-1)));
  }
  return {root, inverse};
}

std::uint32_t meet(const HardReach& reach, const HardBodies& of, const ContactPairs& pairs,
                   HardContact* found) {
  // What is read behind the pairs are bodies, too.
  for (unsigned k = 0; k < 2 * kAtOnce; ++k) pairs.first[pairs.count + k] = pairs.second[pairs.count + k] = 0;
  const std::uint32_t near = keep_near(reach, of, pairs);
  const HardMeet one_by_one = portable_hard_meet();
  const Four shift = _mm_cvtsi32_si128(static_cast<int>(reach.shift));
  const Wide most_gap = same(HardLaw::kMostGap);
  std::uint32_t count = 0;
  for (std::uint32_t i = 0; i < near; i += kAtOnce) {
    const std::uint32_t left = near - i < kAtOnce ? near - i : kAtOnce;
    const Pairs p(of.bodies, pairs.first + i, pairs.second + i);
    const Wide squared = p.squared();
    if (left < kAtOnce || bits_set(greater(same(1 << 19), squared)) != 0) {
      count += one_by_one(reach, of, {pairs.first + i, pairs.second + i, left}, found + count);
      continue;
    }
    const Distance far = distance(squared);
    Four n[3];
    Wide speed = {};
    for (unsigned k = 0; k < 3; ++k) {
      const Wide whole = sum(signed_product(wide(p.d[k]), far.inverse), same(1 << 27));
      n[k] = lower_halves(_mm256_srli_epi64(whole, 28));
      speed = sum(speed, signed_product(wide(p.u[k]), wide(n[k])));
    }
    speed = shifted(speed, _mm_cvtsi32_si128(12));
    const Wide gap = _mm256_slli_epi64(minus(far.root, wide(p.radii)), 6);
    const Wide later = sum(gap, _mm256_and_si256(speed, greater(Wide{}, speed)));
    const unsigned touching = bits_set(greater(same(std::int64_t{reach.reach} * 64), later));
    Wide in_units = shifted(gap, shift);
    in_units = _mm256_blendv_epi8(in_units, most_gap, greater(in_units, most_gap));
    const Wide least = minus(Wide{}, most_gap);
    in_units = _mm256_blendv_epi8(in_units, least, greater(least, in_units));
    Four head[4] = {_mm_loadu_si128(reinterpret_cast<const __m128i_u*>(pairs.first + i)),
                    _mm_loadu_si128(reinterpret_cast<const __m128i_u*>(pairs.second + i)), n[0], n[1]};
    Four tail[4] = {n[2], lower_halves(in_units), Four{},
                    lower_halves(_mm256_srli_epi64(greater(later, same(reach.met)), 63))};
    transpose(head[0], head[1], head[2], head[3]);
    transpose(tail[0], tail[1], tail[2], tail[3]);
    for (unsigned k = 0; k < kAtOnce; ++k) {
      auto* const to = reinterpret_cast<Four*>(found + count);
      _mm_store_si128(to, head[k]);
      _mm_store_si128(to + 1, tail[k]);
      count += (touching >> k) & 1U;
    }
  }
  return count;
}

}  // namespace

HardMeet avx2_hard_meet() { return meet; }

}  // namespace tandem

#endif
