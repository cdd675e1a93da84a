#include "sdk/core/predict/contact/pairs.hpp"

#include <cstring>

#include "sdk/core/predict/contact/cells.hpp"
#include "sdk/core/predict/contact/law.hpp"
#include "sdk/core/predict/words/words.hpp"

namespace tandem {
namespace {

inline FourBits load_at(const std::uint32_t* from) { return load<FourBits>(*from); }
inline void store(std::uint32_t* to, FourBits x) { std::memcpy(to, &x, sizeof x); }
inline FourBits apart(FourBits a, FourBits b) {
  return reinterpret_cast<FourBits>(reinterpret_cast<EightHalves>(a) - reinterpret_cast<EightHalves>(b));
}

// The square of the lower 16 bits plus that of the upper, both signed.
inline FourBits squared(FourBits x) {
  const auto words = reinterpret_cast<EightWords>(x);
  return bits_of(dot16(words, words));
}

// Indexed by four bits: the positions of the bits that are set, and their number.
struct Compression {
  FourBits positions;
  std::uint32_t count;
};
constexpr Compression kCompressions[16] = {
    {{0, 0, 0, 0}, 0}, {{0, 0, 0, 0}, 1}, {{1, 0, 0, 0}, 1}, {{0, 1, 0, 0}, 2},
    {{2, 0, 0, 0}, 1}, {{0, 2, 0, 0}, 2}, {{1, 2, 0, 0}, 2}, {{0, 1, 2, 0}, 3},
    {{3, 0, 0, 0}, 1}, {{0, 3, 0, 0}, 2}, {{1, 3, 0, 0}, 2}, {{0, 1, 3, 0}, 3},
    {{2, 3, 0, 0}, 2}, {{0, 2, 3, 0}, 3}, {{1, 2, 3, 0}, 3}, {{0, 1, 2, 3}, 4}};

// Finds the bodies near one body; `kLater`: also at their later places. Their number is hard to predict, so
// no branch depends on it.
template <bool kLater>
class Search {
 public:
  Search(const ContactGrid& grid, const ContactPairs& pairs)
      : xy_(grid.xy),
        later_xy_(grid.later_xy),
        z_(grid.z),
        near_squared_(same(grid.near_squared)),
        first_(pairs.first),
        second_(pairs.second),
        count_(pairs.count) {}

  [[nodiscard]] std::uint32_t count() const { return count_; }
  void start(std::uint32_t place) {
    self_ = same(place);
    self_xy_ = same(xy_[place]);
    self_z_ = same(z_[place]);
    if constexpr (kLater) self_later_xy_ = same(later_xy_[place]);
  }
  void among(std::uint32_t from, std::uint32_t to) {
    for (; from < to; from += 4) {
      const FourBits xy = apart(load_at(xy_ + from), self_xy_);
      const FourBits z = apart(load_at(z_ + from), self_z_);
      auto near = squared(xy) + squared(kLater ? z & 0xFFFFU : z) < near_squared_;
      if constexpr (kLater) {
        const FourBits later = apart(load_at(later_xy_ + from), self_later_xy_);
        near |= squared(later) + squared(z >> 16U) < near_squared_;
      }
      near &= FourBits{0, 1, 2, 3} < same(to - from);
      const Compression& compression = kCompressions[truths_of(reinterpret_cast<Four>(near))];
      store(first_ + count_, self_);
      store(second_ + count_, compression.positions + same(from));
      count_ += compression.count;
    }
  }

 private:
  const std::uint32_t *xy_, *later_xy_, *z_;
  FourBits near_squared_;
  std::uint32_t *first_, *second_;
  std::uint32_t count_;
  FourBits self_{}, self_xy_{}, self_z_{}, self_later_xy_{};
};

std::uint32_t find(const ContactGrid& grid, std::uint32_t place, std::uint32_t enough, ContactPairs& pairs) {
  return grid.later_xy != nullptr ? find_pairs<Search<true>>(grid, place, enough, pairs)
                                  : find_pairs<Search<false>>(grid, place, enough, pairs);
}

inline Four low_words(EightWords words) {
  return __builtin_convertvector(__builtin_shufflevector(words, words, 0, 1, 2, 3), Four);
}
inline Four high_words(EightWords words) {
  return __builtin_convertvector(__builtin_shufflevector(words, words, 4, 5, 6, 7), Four);
}

inline void add(ContactForce& force, Four change) {
  const Four sum = load<Four>(force) + change;
  std::memcpy(&force, &sum, sizeof sum);
}

// The pairs of a body are consecutive. The pairs processed at once are from four places far apart; otherwise
// each would wait for the sum that the previous one stores.
constexpr std::size_t kStride = ContactPairs::kBatch / 4;

// The forces of four pairs on the first body of each, one row per pair.
inline std::array<Four, 4> forces_of(const ContactLaw& law, const std::uint32_t* inverse_root,
                                     const ContactTouch* touches, const std::uint32_t* first,
                                     const std::uint32_t* second) {
  // The radius of the first is negated, so that the difference of the radii is their sum.
  constexpr EightHalves kSigns{1, 1, 1, 0xFFFF, 1, 1, 1, 1};
  std::array<EightHalves, 4> row;
  for (std::size_t k = 0; k < 4; ++k) {
    const auto a = load<EightHalves>(touches[first[k * kStride]].view);
    const auto b = load<EightHalves>(touches[second[k * kStride]].view);
    row[k] = b - a * kSigns;
  }
  const auto places = [](EightHalves a, EightHalves b) {
    return reinterpret_cast<Four>(__builtin_shufflevector(a, b, 0, 8, 1, 9, 2, 10, 3, 11));
  };
  const auto speeds = [](EightHalves a, EightHalves b) {
    return reinterpret_cast<Four>(__builtin_shufflevector(a, b, 4, 12, 5, 13, 6, 14, 7, 15));
  };
  const auto front = [](Four a, Four b) {
    return reinterpret_cast<EightWords>(__builtin_shufflevector(a, b, 0, 4, 1, 5));
  };
  const auto back = [](Four a, Four b) {
    return reinterpret_cast<EightWords>(__builtin_shufflevector(a, b, 2, 6, 3, 7));
  };
  const Four places01 = places(row[0], row[1]), places23 = places(row[2], row[3]);
  const Four speeds01 = speeds(row[0], row[1]), speeds23 = speeds(row[2], row[3]);
  const EightWords d_xy = front(places01, places23), d_z_reach = back(places01, places23);
  const EightWords u_xy = front(speeds01, speeds23), u_z = back(speeds01, speeds23);
  const std::array<Four, 3> d{low_words(d_xy), high_words(d_xy), low_words(d_z_reach)};
  const std::array<Four, 3> u{low_words(u_xy), high_words(u_xy), low_words(u_z)};
  const Four reach = high_words(d_z_reach);

  FourBits squared = bits_of(d[0] * d[0]) + bits_of(d[1] * d[1]) + bits_of(d[2] * d[2]);
  const auto meets = reinterpret_cast<FourBits>(squared < bits_of(reach * reach));
  squared &= meets;
  const FourBits inverse = FourBits{inverse_root[squared[0] >> 16U], inverse_root[squared[1] >> 16U],
                                    inverse_root[squared[2] >> 16U], inverse_root[squared[3] >> 16U]} &
                           meets;
  // Half way to the middle of the table's entry: its slope is twice the root's.
  const FourBits middle = (squared + ((squared & 0xFFFF0000U) | 0x8000U)) >> 1U;
  const Four distance = value_of((middle >> 12U) * inverse >> 18U);
  Four overlap = reach - distance;
  overlap &= overlap > 0;
  std::array<Four, 3> n;
  for (std::size_t i = 0; i < 3; ++i) n[i] = d[i] * value_of(inverse) >> 18;
  n[1] += (squared == 0U) & (1 << 12);

  const std::array<Four, 3> f = contact_force(law, overlap, n, u);
  const Four all = value_of(meets);
  const Rows<Four> force = transposed({f[0] & all, f[1] & all, f[2] & all, Four{}});
  return {force.of0, force.of1, force.of2, force.of3};
}

void add_forces(const ContactLaw& law, const std::uint32_t* inverse_root, const ContactPairs& pairs,
                ContactTouch* touches) {
  for (std::uint32_t begin = 0; begin < pairs.count; begin += ContactPairs::kBatch) {
    for (std::size_t k = 0; k < kStride; ++k) {
      const std::uint32_t* const first = pairs.first + begin + k;
      const std::uint32_t* const second = pairs.second + begin + k;
      const std::array<Four, 4> f = forces_of(law, inverse_root, touches, first, second);
      for (std::size_t i = 0; i < 4; ++i) {
        add(touches[first[i * kStride]].force, f[i]);
        add(touches[second[i * kStride]].force, -f[i]);
      }
    }
  }
}

}  // namespace

ContactKernels portable_contact_kernels() { return {find, add_forces}; }

ContactKernels fastest_contact_kernels() {
#ifdef TANDEM_CONTACT_AVX2
  if (__builtin_cpu_supports("avx2") != 0) return avx2_contact_kernels();
#endif
  return portable_contact_kernels();
}

}  // namespace tandem
