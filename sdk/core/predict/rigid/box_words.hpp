#pragma once
// Vectors of 16-bit words for pairs of boxes: one pair in each word; one, eight or sixteen of them.
// Everything here is inlined always: see ../words/lanes.hpp.

#include "sdk/core/predict/rigid/word_pairs.hpp"

namespace tandem {

/// For machines without vectors, where eight words make much code.
using OneWord = std::int16_t __attribute__((vector_size(2)));
template <>
struct WordLanes<OneWord> {
  using Halves = std::uint16_t __attribute__((vector_size(2)));
};

/// The first, or the last, four words of each eight of a and b, in turn.
TANDEM_PART EightWords low_zip(EightWords a, EightWords b) {
  return __builtin_shufflevector(a, b, 0, 8, 1, 9, 2, 10, 3, 11);
}
TANDEM_PART EightWords high_zip(EightWords a, EightWords b) {
  return __builtin_shufflevector(a, b, 4, 12, 5, 13, 6, 14, 7, 15);
}
/// Eight words at `one`; of 16, those at `other` behind them.
TANDEM_INLINE void read_eights(EightWords& x, const std::int16_t* one, const std::int16_t* /*other*/) {
  x = read<EightWords>(one);
}
TANDEM_INLINE void write_eights(void* one, void* /*other*/, EightWords x) { write(one, x); }
#ifdef __AVX2__
TANDEM_INLINE SixteenWords low_zip(SixteenWords a, SixteenWords b) {
  return __builtin_shufflevector(a, b, 0, 16, 1, 17, 2, 18, 3, 19, 8, 24, 9, 25, 10, 26, 11, 27);
}
TANDEM_INLINE SixteenWords high_zip(SixteenWords a, SixteenWords b) {
  return __builtin_shufflevector(a, b, 4, 20, 5, 21, 6, 22, 7, 23, 12, 28, 13, 29, 14, 30, 15, 31);
}
TANDEM_INLINE void read_eights(SixteenWords& x, const std::int16_t* one, const std::int16_t* other) {
  x = __builtin_shufflevector(read<EightWords>(one), read<EightWords>(other), 0, 1, 2, 3, 4, 5, 6, 7, 8, 9,
                              10, 11, 12, 13, 14, 15);
}
TANDEM_INLINE void write_eights(void* one, void* other, SixteenWords x) {
  write(one, __builtin_shufflevector(x, x, 0, 1, 2, 3, 4, 5, 6, 7));
  write(other, __builtin_shufflevector(x, x, 8, 9, 10, 11, 12, 13, 14, 15));
}
#endif

/// The upper words of lanes: those of each four of a, then of b.
TANDEM_PART EightWords upper_words(Four a, Four b) {
  return __builtin_shufflevector(reinterpret_cast<EightWords>(a), reinterpret_cast<EightWords>(b), 1, 3, 5, 7,
                                 9, 11, 13, 15);
}
#ifdef __AVX2__
TANDEM_INLINE SixteenWords upper_words(Eight a, Eight b) {
  return __builtin_shufflevector(reinterpret_cast<SixteenWords>(a), reinterpret_cast<SixteenWords>(b), 1, 3,
                                 5, 7, 17, 19, 21, 23, 9, 11, 13, 15, 25, 27, 29, 31);
}
#endif

/// In each word all bits set where a * b < c * d, of numbers of 0 or more.
template <class W>
TANDEM_INLINE W less_product(W a, W b, W c, W d) {
  const W minus_d = -d;
  const auto differences = [](W x, W y) { return dot16(x, y); };
  return W(upper_words(differences(low_zip(a, c), low_zip(b, minus_d)),
                       differences(high_zip(a, c), high_zip(b, minus_d))) < 0);
}
TANDEM_INLINE OneWord one_word(std::int32_t x) { return OneWord{static_cast<std::int16_t>(word_range(x))}; }
TANDEM_PART OneWord add_sat16(OneWord a, OneWord b) { return one_word(a[0] + b[0]); }
TANDEM_PART OneWord sub_sat16(OneWord a, OneWord b) { return one_word(a[0] - b[0]); }
TANDEM_PART OneWord mul_q15(OneWord a, OneWord b) { return one_word((a[0] * b[0] + (1 << 14)) >> 15); }
TANDEM_PART OneWord less_product(OneWord a, OneWord b, OneWord c, OneWord d) {
  return OneWord{static_cast<std::int16_t>(a[0] * b[0] < c[0] * d[0] ? -1 : 0)};
}
TANDEM_INLINE bool any(OneWord x) { return x[0] != 0; }

}  // namespace tandem
