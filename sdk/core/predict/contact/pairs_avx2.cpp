// pairs.cpp for eight pairs at a time. No inline function of other headers is called here, because the linker
// might keep its AVX2 copy for all callers.
#include "sdk/core/predict/contact/cells.hpp"

#ifdef __AVX2__

#include <immintrin.h>

namespace tandem {
namespace {

using Wide = __m256i;

// Indexed by eight bits: the positions of the bits that are set, one per byte.
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

// Indexed by a number up to three full cells: as many bits set, at most eight.
struct Firsts {
  std::uint8_t of[3 * ContactGrid::kMaxInCell + 1];
};
constexpr Firsts make_firsts() {
  Firsts table{};
  for (unsigned i = 0; i < sizeof table.of; ++i)
    table.of[i] = static_cast<std::uint8_t>(i < 8 ? (1U << i) - 1 : 255);
  return table;
}
constexpr Firsts kFirsts = make_firsts();

inline Wide same(std::int32_t x) { return _mm256_set1_epi32(x); }
inline Wide same(std::uint32_t x) { return _mm256_set1_epi32(static_cast<int>(x)); }
inline Wide clamped(Wide x, Wide low, Wide high) { return _mm256_min_epi32(_mm256_max_epi32(x, low), high); }
inline Wide load(const std::uint32_t* from) {
  return _mm256_loadu_si256(reinterpret_cast<const __m256i_u*>(from));
}
inline void store(std::uint32_t* to, Wide x) { _mm256_storeu_si256(reinterpret_cast<__m256i_u*>(to), x); }

inline Wide squared(Wide words) { return _mm256_madd_epi16(words, words); }

// Finds the bodies near one body; `kLater`: also at their later places. Their number is hard to predict, so
// no branch depends on it.
template <bool kLater>
class Search {
 public:
  Search(const ContactGrid& grid, const ContactPairs& pairs)
      : xy_(grid.xy),
        later_xy_(grid.later_xy),
        z_(grid.z),
        most_(same(grid.near_squared - 1)),
        first_(pairs.first),
        second_(pairs.second),
        count_(pairs.count) {}

  [[nodiscard]] std::uint32_t count() const { return static_cast<std::uint32_t>(count_); }
  void start(std::uint32_t place) {
    self_ = same(place);
    self_xy_ = same(xy_[place]);
    self_z_ = same(z_[place]);
    if constexpr (kLater) self_later_xy_ = same(later_xy_[place]);
  }
  void among(std::uint32_t from, std::uint32_t to) {
    const std::uint32_t left = to - from;
    among_eight(from, left);
    if (left > 8) *this = more(*this, from + 8, left - 8);
  }

 private:
  // Called seldom, so it is not inlined for every run. `search` is copied, so that the caller's stays in
  // registers.
  [[gnu::noinline]] static Search more(Search search, std::uint32_t from, std::uint32_t left) {
    for (; left > 8; from += 8, left -= 8) search.among_eight(from, left);
    search.among_eight(from, left);
    return search;
  }
  void among_eight(std::uint32_t from, std::uint32_t left) {
    const Wide apart_xy = _mm256_sub_epi16(load(xy_ + from), self_xy_);
    const Wide apart_z = _mm256_sub_epi16(load(z_ + from), self_z_);
    Wide apart{};
    if constexpr (!kLater) {
      apart = _mm256_add_epi32(squared(apart_xy), squared(apart_z));
    } else {
      const Wide now = _mm256_add_epi32(squared(apart_xy), squared(_mm256_and_si256(apart_z, same(0xFFFF))));
      const Wide later = _mm256_sub_epi16(load(later_xy_ + from), self_later_xy_);
      const Wide later_apart = _mm256_add_epi32(squared(later), squared(_mm256_srli_epi32(apart_z, 16)));
      apart = _mm256_min_epu32(now, later_apart);
    }
    const Wide near = _mm256_cmpeq_epi32(_mm256_min_epu32(apart, most_), apart);
    const std::uint32_t bits =
        static_cast<std::uint32_t>(_mm256_movemask_ps(_mm256_castsi256_ps(near))) & kFirsts.of[left];
    const Wide places =
        _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(static_cast<long long>(kCompressions.of[bits])));
    store(first_ + count_, self_);
    store(second_ + count_, _mm256_add_epi32(places, same(from)));
    count_ += static_cast<std::size_t>(_mm_popcnt_u32(bits));
  }

  const std::uint32_t *xy_, *later_xy_, *z_;
  Wide most_;
  std::uint32_t *first_, *second_;
  std::size_t count_;
  Wide self_{}, self_xy_{}, self_z_{}, self_later_xy_{};
};

std::uint32_t find(const ContactGrid& grid, std::uint32_t place, std::uint32_t enough, ContactPairs& pairs) {
  return grid.later_xy != nullptr ? find_pairs<Search<true>>(grid, place, enough, pairs)
                                  : find_pairs<Search<false>>(grid, place, enough, pairs);
}

// Transposes four rows of four, twice in parallel.
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

inline Wide both(const ContactView& a, const ContactView& b) {
  return _mm256_inserti128_si256(_mm256_castsi128_si256(_mm_load_si128(reinterpret_cast<const __m128i*>(&a))),
                                 _mm_load_si128(reinterpret_cast<const __m128i*>(&b)), 1);
}

// Multiplies words in the lower halves; the upper half of one does not count if the other's is 0.
inline Wide product(Wide a, Wide b) { return _mm256_madd_epi16(a, b); }
inline Wide lower(Wide words) { return _mm256_unpacklo_epi16(words, Wide{}); }
inline Wide upper(Wide words) { return _mm256_unpackhi_epi16(words, Wide{}); }
inline Wide with_sign(Wide word) { return _mm256_srai_epi32(_mm256_slli_epi32(word, 16), 16); }

inline void add(ContactForce& force, __m128i change) {
  auto* const f = reinterpret_cast<__m128i*>(&force);
  _mm_store_si128(f, _mm_add_epi32(_mm_load_si128(f), change));
}
inline void subtract(ContactForce& force, __m128i change) {
  auto* const f = reinterpret_cast<__m128i*>(&force);
  _mm_store_si128(f, _mm_sub_epi32(_mm_load_si128(f), change));
}

// The gather instruction takes longer on processors that must not speculate on its results.
inline Wide looked_up(const std::uint32_t* table, Wide index) {
  alignas(32) std::uint32_t at[8];
  _mm256_store_si256(reinterpret_cast<Wide*>(at), index);
  const auto four = [&](unsigned i) {
    return _mm_set_epi32(static_cast<int>(table[at[i + 3]]), static_cast<int>(table[at[i + 2]]),
                         static_cast<int>(table[at[i + 1]]), static_cast<int>(table[at[i]]));
  };
  return _mm256_inserti128_si256(_mm256_castsi128_si256(four(0)), four(4), 1);
}

// The pairs of a body are consecutive. The pairs processed at once are from eight places far apart; otherwise
// each would wait for the sum that the previous one stores.
constexpr std::size_t kStride = ContactPairs::kBatch / 8;

// The forces of eight pairs on the first body of each, as in pairs.cpp.
struct Forces {
  Wide row[4];  // pair k in the lower half of row k, pair k + 4 in the upper half
};

inline Forces forces_of(const ContactLaw& law, const std::uint32_t* inverse_root, const ContactTouch* touches,
                        const std::uint32_t* first, const std::uint32_t* second) {
  // The radius of the first is negated, so that the difference of the radii is their sum.
  const Wide signs = _mm256_set_epi16(1, 1, 1, 1, -1, 1, 1, 1, 1, 1, 1, 1, -1, 1, 1, 1);
  Wide rows[4];
  for (unsigned k = 0; k < 4; ++k) {
    const Wide a = both(touches[first[k * kStride]].view, touches[first[(k + 4) * kStride]].view);
    const Wide b = both(touches[second[k * kStride]].view, touches[second[(k + 4) * kStride]].view);
    rows[k] = _mm256_sub_epi16(b, _mm256_sign_epi16(a, signs));
  }
  const Wide places01 = _mm256_unpacklo_epi16(rows[0], rows[1]);
  const Wide places23 = _mm256_unpacklo_epi16(rows[2], rows[3]);
  const Wide speeds01 = _mm256_unpackhi_epi16(rows[0], rows[1]);
  const Wide speeds23 = _mm256_unpackhi_epi16(rows[2], rows[3]);
  const Wide d_xy = _mm256_unpacklo_epi32(places01, places23);
  const Wide d_z_reach = _mm256_unpackhi_epi32(places01, places23);
  const Wide u_xy = _mm256_unpacklo_epi32(speeds01, speeds23);
  const Wide u_z = _mm256_unpackhi_epi32(speeds01, speeds23);
  // Words in the lower halves, the upper ones 0.
  const Wide d[3] = {lower(d_xy), upper(d_xy), lower(d_z_reach)};
  const Wide u[3] = {lower(u_xy), upper(u_xy), lower(u_z)};
  const Wide reach = upper(d_z_reach);

  Wide squared =
      _mm256_add_epi32(_mm256_add_epi32(product(d[0], d[0]), product(d[1], d[1])), product(d[2], d[2]));
  const Wide apart = _mm256_cmpeq_epi32(_mm256_max_epu32(squared, product(reach, reach)), squared);
  squared = _mm256_andnot_si256(apart, squared);
  const Wide inverse = looked_up(inverse_root, _mm256_srli_epi32(squared, 16));
  const Wide entry = _mm256_or_si256(_mm256_and_si256(squared, same(0xFFFF0000U)), same(1 << 15));
  const Wide middle = _mm256_srli_epi32(_mm256_add_epi32(squared, entry), 1);
  const Wide distance = _mm256_srli_epi32(_mm256_mullo_epi32(_mm256_srli_epi32(middle, 12), inverse), 18);
  const Wide overlap = _mm256_max_epi32(_mm256_sub_epi32(reach, distance), Wide{});
  Wide n[3];
  for (unsigned i = 0; i < 3; ++i) n[i] = _mm256_srai_epi32(_mm256_mullo_epi32(with_sign(d[i]), inverse), 18);
  n[1] = _mm256_add_epi32(n[1], _mm256_and_si256(_mm256_cmpeq_epi32(squared, Wide{}), same(1 << 12)));

  const Wide along = _mm256_srai_epi32(
      _mm256_add_epi32(_mm256_add_epi32(product(u[0], n[0]), product(u[1], n[1])), product(u[2], n[2])), 11);
  const Wide hardest = same((1 << 15) - 1);
  const Wide push =
      clamped(_mm256_add_epi32(_mm256_srai_epi32(_mm256_mullo_epi32(same(law.spring), overlap), 11),
                               _mm256_srai_epi32(_mm256_mullo_epi32(same(law.shear), along), 11)),
              _mm256_sub_epi32(Wide{}, hardest), hardest);
  const Wide push_word = _mm256_and_si256(push, same(0xFFFF));
  const Wide drag = same(law.drag);
  Forces f{};
  for (unsigned i = 0; i < 3; ++i) {
    f.row[i] = _mm256_andnot_si256(apart, _mm256_sub_epi32(_mm256_srai_epi32(product(u[i], drag), 9),
                                                           _mm256_srai_epi32(product(push_word, n[i]), 11)));
  }
  transpose(f.row[0], f.row[1], f.row[2], f.row[3]);
  return f;
}

void add_forces(const ContactLaw& law, const std::uint32_t* inverse_root, const ContactPairs& pairs,
                ContactTouch* touches) {
  for (std::uint32_t begin = 0; begin < pairs.count; begin += ContactPairs::kBatch) {
    for (std::size_t k = 0; k < kStride; ++k) {
      const std::uint32_t* const first = pairs.first + begin + k;
      const std::uint32_t* const second = pairs.second + begin + k;
      const Forces f = forces_of(law, inverse_root, touches, first, second);
      for (unsigned i = 0; i < 4; ++i) {
        const __m128i low = _mm256_castsi256_si128(f.row[i]);
        const __m128i high = _mm256_extracti128_si256(f.row[i], 1);
        add(touches[first[i * kStride]].force, low);
        subtract(touches[second[i * kStride]].force, low);
        add(touches[first[(i + 4) * kStride]].force, high);
        subtract(touches[second[(i + 4) * kStride]].force, high);
      }
    }
  }
}

}  // namespace

ContactKernels avx2_contact_kernels() { return {find, add_forces}; }

}  // namespace tandem

#endif
