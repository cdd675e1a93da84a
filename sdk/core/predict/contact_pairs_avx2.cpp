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

// Without a branch: how many are near is as good as random.
inline void collect(const ContactGrid& grid, const ContactRuns& runs, ContactPairs& pairs) {
  const std::uint32_t* const xy = grid.xy;
  const std::uint32_t* const z = grid.z;
  std::uint32_t* const first = pairs.first;
  std::uint32_t* const second = pairs.second;
  std::uint32_t count = pairs.count;
  const Wide most = same(grid.near_squared - 1);
  const std::uint32_t size = runs.size();
  for (std::uint32_t r = 0; r < size; ++r) {
    const ContactRun& run = runs[r];
    const Wide apart_xy = _mm256_sub_epi16(load(xy + run.from), same(xy[run.self]));
    const Wide apart_z = _mm256_sub_epi16(load(z + run.from), same(z[run.self]));
    const Wide squared =
        _mm256_add_epi32(_mm256_madd_epi16(apart_xy, apart_xy), _mm256_madd_epi16(apart_z, apart_z));
    const Wide near = _mm256_cmpeq_epi32(_mm256_min_epu32(squared, most), squared);
    const std::uint32_t bits =
        static_cast<std::uint32_t>(_mm256_movemask_ps(_mm256_castsi256_ps(near))) & ((1U << run.count) - 1);
    const Wide places =
        _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(static_cast<long long>(kCompressions.of[bits])));
    store(first + count, same(run.self));
    store(second + count, _mm256_add_epi32(places, same(run.from)));
    count += static_cast<std::uint32_t>(_mm_popcnt_u32(bits));
  }
  pairs.count = count;
}

std::uint32_t find(const ContactGrid& grid, std::uint32_t place, std::uint32_t enough, ContactPairs& pairs) {
  return find_pairs(grid, place, enough, pairs, collect);
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
                        const std::uint32_t* first, const std::uint32_t* second, std::size_t stride) {
  // The radius of the first is negated, so that the difference of the radii is their sum.
  const Wide signs = _mm256_set_epi32(-1, 1, 1, 1, -1, 1, 1, 1);
  Wide d[4], u[4];
  for (unsigned k = 0; k < 4; ++k) {
    const ContactBody& a = bodies[first[k * stride]];
    const ContactBody& b = bodies[second[k * stride]];
    const ContactBody& a4 = bodies[first[(k + 4) * stride]];
    const ContactBody& b4 = bodies[second[(k + 4) * stride]];
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
  // A body's pairs follow each other. Those worked on at once are from eight places far apart, or each would
  // wait for the sum that the one before it stores.
  constexpr std::uint32_t kAtOnce = 1024;
  for (std::uint32_t begin = 0; begin < pairs.count; begin += kAtOnce) {
    const std::uint32_t left = pairs.count - begin;
    const std::size_t stride = (left < kAtOnce ? left : kAtOnce) / 8;
    for (std::size_t k = 0; k < stride; ++k) {
      const std::uint32_t* const first = pairs.first + begin + k;
      const std::uint32_t* const second = pairs.second + begin + k;
      const Forces f = forces_of(law, inverse_root, bodies, first, second, stride);
      for (unsigned i = 0; i < 4; ++i) {
        const __m128i low = _mm256_castsi256_si128(f.row[i]);
        const __m128i high = _mm256_extracti128_si256(f.row[i], 1);
        add(forces[first[i * stride]], low);
        subtract(forces[second[i * stride]], low);
        add(forces[first[(i + 4) * stride]], high);
        subtract(forces[second[(i + 4) * stride]], high);
      }
    }
  }
}

}  // namespace

ContactKernels avx2_contact_kernels() { return {find, add_forces}; }

}  // namespace tandem

#endif
