// contact_pairs.cpp eight at a time. Nothing inline of other headers is called here: the linker might keep
// the AVX2 copy for everybody.
#include "sdk/core/predict/contact_cells.hpp"

#ifdef __AVX2__

#include <immintrin.h>

namespace tandem {
namespace {

using Wide = __m256i;

// By eight bits: the positions of those set, one a byte.
struct Compressions {
  std::uint64_t of[256];
};
constexpr Compressions make_compressions() {
  Compressions table{};
  for (unsigned bits = 0; bits < 256; ++bits) {
    unsigned count = 0;
    for (unsigned i = 0; i < 8; ++i) {
      if ((bits >> i & 1U) != 0) table.of[bits] |= std::uint64_t{i} << (8 * count++);
    }
  }
  return table;
}
constexpr Compressions kCompressions = make_compressions();

inline Wide same(std::int32_t x) { return _mm256_set1_epi32(x); }
inline Wide same(std::uint32_t x) { return _mm256_set1_epi32(static_cast<int>(x)); }
inline Wide clamped(Wide x, Wide low, Wide high) { return _mm256_min_epi32(_mm256_max_epi32(x, low), high); }
inline Wide load(const std::uint32_t* from) {
  return _mm256_loadu_si256(reinterpret_cast<const __m256i_u*>(from));
}
inline void store(std::uint32_t* to, Wide x) { _mm256_storeu_si256(reinterpret_cast<__m256i_u*>(to), x); }

inline std::uint32_t collect(const ContactGrid& grid, std::uint32_t self, std::uint32_t from,
                             std::uint32_t to, std::uint32_t* first, std::uint32_t* second,
                             std::uint32_t count) {
  const Wide self_xy = same(grid.xy[self]);
  const Wide self_z = same(grid.z[self]);
  const Wide most = same(grid.near_squared - 1);
  std::uint32_t j = from;
  do {
    const Wide xy = _mm256_sub_epi16(load(grid.xy + j), self_xy);
    const Wide z = _mm256_sub_epi16(load(grid.z + j), self_z);
    const Wide squared = _mm256_add_epi32(_mm256_madd_epi16(xy, xy), _mm256_madd_epi16(z, z));
    const Wide near = _mm256_cmpeq_epi32(_mm256_min_epu32(squared, most), squared);
    // Without a branch: how many there are is as good as random.
    const auto bits = static_cast<std::uint64_t>(_mm256_movemask_ps(_mm256_castsi256_ps(near))) &
                      ((std::uint64_t{1} << (to - j)) - 1);
    const Wide places =
        _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(static_cast<long long>(kCompressions.of[bits])));
    store(first + count, same(self));
    store(second + count, _mm256_add_epi32(places, same(j)));
    count += static_cast<std::uint32_t>(_mm_popcnt_u64(bits));
    j += 8;
  } while (j < to);
  return count;
}

std::uint32_t find(const ContactGrid& grid, std::uint32_t place, ContactPairs& pairs) {
  return find_pairs(grid, place, pairs, [](auto... arguments) { return collect(arguments...); });
}

// Four rows of four, twice side by side, turned over.
inline void transpose(Wide& a, Wide& b, Wide& c, Wide& d) {
  const Wide ab_low = _mm256_unpacklo_epi32(a, b);
  const Wide ab_high = _mm256_unpackhi_epi32(a, b);
  const Wide cd_low = _mm256_unpacklo_epi32(c, d);
  const Wide cd_high = _mm256_unpackhi_epi32(c, d);
  a = _mm256_unpacklo_epi64(ab_low, cd_low);
  b = _mm256_unpackhi_epi64(ab_low, cd_low);
  c = _mm256_unpacklo_epi64(ab_high, cd_high);
  d = _mm256_unpackhi_epi64(ab_high, cd_high);
}

// Half a body of each of two: the first half is p and the radius, the second v and the slot.
inline Wide halves(const ContactBody& a, const ContactBody& b, unsigned half) {
  const auto* low = reinterpret_cast<const __m128i*>(&a) + half;
  const auto* high = reinterpret_cast<const __m128i*>(&b) + half;
  return _mm256_inserti128_si256(_mm256_castsi128_si256(_mm_load_si128(low)), _mm_load_si128(high), 1);
}

inline void add(ContactForce& force, __m128i change) {
  auto* const f = reinterpret_cast<__m128i*>(&force);
  _mm_store_si128(f, _mm_add_epi32(_mm_load_si128(f), change));
}
inline void subtract(ContactForce& force, __m128i change) {
  auto* const f = reinterpret_cast<__m128i*>(&force);
  _mm_store_si128(f, _mm_sub_epi32(_mm_load_si128(f), change));
}

// The gather instruction takes longer where its results must not be guessed ahead.
inline Wide looked_up(const std::uint32_t* table, Wide index) {
  alignas(32) std::uint32_t at[8];
  _mm256_store_si256(reinterpret_cast<Wide*>(at), index);
  const auto four = [&](unsigned i) {
    return _mm_set_epi32(static_cast<int>(table[at[i + 3]]), static_cast<int>(table[at[i + 2]]),
                         static_cast<int>(table[at[i + 1]]), static_cast<int>(table[at[i]]));
  };
  return _mm256_inserti128_si256(_mm256_castsi128_si256(four(0)), four(4), 1);
}

// The forces of eight pairs on the first of each, as in contact_pairs.cpp.
struct Forces {
  Wide row[4];  // pair k in the lower half of row k, pair k + 4 in the upper half
};

inline Forces forces_of(const ContactLaw& law, const std::uint32_t* inverse_root, const ContactBody* bodies,
                        const std::uint32_t* first, const std::uint32_t* second) {
  // The radius of the first is negated, so that the difference of the radii is their sum.
  const Wide signs = _mm256_set_epi32(-1, 1, 1, 1, -1, 1, 1, 1);
  Wide d[4], u[4];
  for (unsigned k = 0; k < 4; ++k) {
    const ContactBody& a = bodies[first[k]];
    const ContactBody& b = bodies[second[k]];
    const ContactBody& a4 = bodies[first[k + 4]];
    const ContactBody& b4 = bodies[second[k + 4]];
    d[k] = _mm256_sub_epi32(halves(b, b4, 0), _mm256_sign_epi32(halves(a, a4, 0), signs));
    u[k] = _mm256_sub_epi32(halves(b, b4, 1), halves(a, a4, 1));
  }
  transpose(d[0], d[1], d[2], d[3]);
  transpose(u[0], u[1], u[2], u[3]);

  const Wide shift = same(law.shift);
  const Wide farthest = same(1 << 14);
  for (unsigned i = 0; i < 3; ++i)
    d[i] = clamped(_mm256_srav_epi32(d[i], shift), _mm256_sub_epi32(Wide{}, farthest), farthest);
  const Wide reach = _mm256_srav_epi32(d[3], shift);
  Wide squared =
      _mm256_add_epi32(_mm256_add_epi32(_mm256_mullo_epi32(d[0], d[0]), _mm256_mullo_epi32(d[1], d[1])),
                       _mm256_mullo_epi32(d[2], d[2]));
  const Wide touching = _mm256_cmpgt_epi32(_mm256_mullo_epi32(reach, reach), squared);
  squared = _mm256_and_si256(squared, touching);
  const Wide inverse = looked_up(inverse_root, _mm256_srli_epi32(squared, 16));
  const Wide distance = _mm256_srli_epi32(_mm256_mullo_epi32(_mm256_srli_epi32(squared, 12), inverse), 18);
  const Wide overlap = _mm256_max_epi32(_mm256_sub_epi32(reach, distance), Wide{});

  const Wide speed_shift = same(law.shift + 4);
  const Wide fastest = same(1 << 16);
  Wide n[3];
  for (unsigned i = 0; i < 3; ++i) {
    n[i] = _mm256_srai_epi32(_mm256_mullo_epi32(d[i], inverse), 18);
    u[i] = clamped(_mm256_srav_epi32(u[i], speed_shift), _mm256_sub_epi32(Wide{}, fastest), fastest);
  }
  n[1] = _mm256_add_epi32(n[1], _mm256_and_si256(_mm256_cmpeq_epi32(squared, Wide{}), same(1 << 12)));

  const Wide along = _mm256_srai_epi32(
      _mm256_add_epi32(_mm256_add_epi32(_mm256_mullo_epi32(u[0], n[0]), _mm256_mullo_epi32(u[1], n[1])),
                       _mm256_mullo_epi32(u[2], n[2])),
      12);
  const Wide hardest = same(1 << 18);
  const Wide push =
      clamped(_mm256_add_epi32(_mm256_srai_epi32(_mm256_mullo_epi32(same(law.spring), overlap), 10),
                               _mm256_srai_epi32(_mm256_mullo_epi32(same(law.shear), along), 11)),
              _mm256_sub_epi32(Wide{}, hardest), hardest);
  Forces f{};
  for (unsigned i = 0; i < 3; ++i) {
    const Wide drag = _mm256_srai_epi32(_mm256_mullo_epi32(same(law.drag), u[i]), 11);
    const Wide along_n = _mm256_srai_epi32(_mm256_mullo_epi32(push, n[i]), 12);
    f.row[i] = _mm256_and_si256(_mm256_sub_epi32(drag, along_n), touching);
  }
  transpose(f.row[0], f.row[1], f.row[2], f.row[3]);
  return f;
}

void add_forces(const ContactLaw& law, const std::uint32_t* inverse_root, const ContactBody* bodies,
                const ContactPairs& pairs, ContactForce* forces) {
  // The last eight are filled up with pairs of a body with itself, which add up to nothing.
  for (std::uint32_t k = pairs.count; k % 8 != 0; ++k) pairs.first[k] = pairs.second[k] = 0;
  for (std::uint32_t k = 0; k < pairs.count; k += 8) {
    const std::uint32_t* const first = pairs.first + k;
    const std::uint32_t* const second = pairs.second + k;
    const Forces f = forces_of(law, inverse_root, bodies, first, second);
    for (unsigned i = 0; i < 4; ++i) {
      const __m128i low = _mm256_castsi256_si128(f.row[i]);
      const __m128i high = _mm256_extracti128_si256(f.row[i], 1);
      add(forces[first[i]], low);
      subtract(forces[second[i]], low);
      add(forces[first[i + 4]], high);
      subtract(forces[second[i + 4]], high);
    }
  }
}

}  // namespace

ContactKernels avx2_contact_kernels() { return {find, add_forces}; }

}  // namespace tandem

#endif
