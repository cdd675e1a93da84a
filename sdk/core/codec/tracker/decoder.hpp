#pragma once
// The tracker's decoder: reads sections of untrusted bytes into a TrackerDelta, two blocks side by side: on
// one thread their chains of decisions overlap. Few bits become branches, because a wrong guess stops both.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/codec/tracker/frame.hpp"

namespace tandem {

/// As RangeDecoder. All members are plain words, which compilers keep in registers, and decisions are masks.
/// On x86-64 conditional moves are written out, because compilers make branches of them.
struct LaneDecoder {
  LaneDecoder() = default;
  explicit LaneDecoder(std::span<const std::byte> in) : at(in.data()), end(in.data() + in.size()) {
    for (int i = 0; i < 4; ++i) code = (code << 8U) | next();
  }

  /// All bits of the result are the bit. `p1` of 0: reads a 0, which takes nothing.
  [[gnu::always_inline]] std::uint32_t get(std::uint32_t p1) {
    const std::uint32_t bound = share(range, p1);
    std::uint32_t rest = range - bound, one = 0;
#if defined(__x86_64__)
    std::uint32_t left = code;
    __asm__(
        "subl %[bound], %[left]\n\tcmovbl %[bound], %[rest]\n\tcmovbl %[code], %[left]\n\tsbbl %[one], %[one]"
        : [left] "+&r"(left), [rest] "+&r"(rest), [one] "=&r"(one)
        : [bound] "r"(bound), [code] "r"(code)
        : "cc");
    code = left;
    range = rest;
#else
    one = below(code, bound);
    code = std::min(code, code - bound);  // wraps for a 1
    range = rest ^ ((rest ^ bound) & one);
#endif
    fill();
    return one;
  }
  /// Reads decisions until one is a 0, at most kRun, and returns the number of ones. A 1 leaves its bound as
  /// the range, whatever the code is: so all bounds are computed, and the code is compared with each. Returns
  /// kRun + 1 and reads nothing if the range must be filled before the last decision.
  [[gnu::always_inline]] std::uint32_t get_ones(const std::uint16_t* p1) {
    const std::uint32_t first = share(range, p1[0]), second = share(first, p1[1]),
                        third = share(second, p1[2]), fourth = share(third, p1[3]);
    std::uint32_t before = range, bound = first, ones = 0;  // of the last decision
    pass(first, second, before, bound, ones);
    pass(second, third, before, bound, ones);
    pass(third, fourth, before, bound, ones);
    if (before < kLeastRange) return kRun + 1;
    const std::uint32_t last = code < fourth ? 1 : 0;
    if (last != 0) {
      range = fourth;
    } else {
      range = before - bound;
      code -= bound;
    }
    fill();
    return ones + last;
  }
  // If the decision of this bound is a 1: goes on to the next one.
  [[gnu::always_inline]] void pass(std::uint32_t of, std::uint32_t next_bound, std::uint32_t& before,
                                   std::uint32_t& bound, std::uint32_t& ones) const {
#if defined(__x86_64__)
    __asm__("cmpl %[of], %[code]\n\tcmovbl %[of], %[before]\n\tcmovbl %[next], %[bound]\n\tadcl $0, %[ones]"
            : [before] "+&r"(before), [bound] "+&r"(bound), [ones] "+&r"(ones)
            : [of] "r"(of), [code] "r"(code), [next] "r"(next_bound)
            : "cc");
#else
    const std::uint32_t one = below(code, of);
    before ^= (before ^ of) & one;
    bound ^= (bound ^ next_bound) & one;
    ones -= one;
#endif
  }
  /// Does the same with a branch on the bit, for bits that can be guessed.
  [[gnu::always_inline]] bool guess(std::uint32_t p1) {
    const std::uint32_t bound = share(range, p1);
    const bool one = code < bound;
    code -= one ? 0U : bound;
    range = one ? bound : range - bound;
    fill();
    return one;
  }
  /// A branch: a guess takes the shift out of the chain from one range to the next.
  [[gnu::always_inline]] void fill() {
    while (range < kLeastRange) {
      code = (code << 8U) | next();
      range <<= 8U;
    }
  }

  /// The bound of a decision.
  static std::uint32_t share(std::uint32_t range, std::uint32_t p1) {
    return static_cast<std::uint32_t>((std::uint64_t{range} * p1) >> 16U);
  }
  /// All bits are one if a < b. Compilers must not make a branch of it.
  static std::uint32_t below(std::uint32_t a, std::uint32_t b) {
    std::uint32_t mask = 0U - static_cast<std::uint32_t>(a < b);
    __asm__("" : "+r"(mask));
    return mask;
  }
  [[nodiscard]] std::uint32_t next() { return at == end ? 0U : std::to_integer<std::uint32_t>(*at++); }

  static constexpr std::uint32_t kLeastRange = 1U << 24U;
  static constexpr std::uint32_t kRun = 4;  ///< decisions of get_ones()
  std::uint32_t range = 0xFFFFFFFFU, code = 0;
  const std::byte* at = nullptr;
  const std::byte* end = nullptr;
};

/// Reads decisions for code_correction() and counts them.
struct LaneReader {
  bool code(bool /*bit*/, std::uint32_t model) { return count(decoder.guess(p1[model]), model); }
  bool code_sign(bool /*bit*/, std::uint32_t model) { return count(decoder.get(p1[model]) != 0, model); }
  bool code_even(bool /*bit*/) { return code_sign(false, TrackerModelIndex::kEven); }
  bool count(bool bit, std::uint32_t model) {
    ++(*counts)[model][bit ? 1 : 0];
    return bit;
  }

  LaneDecoder decoder;
  const std::uint16_t* p1 = nullptr;
  TrackerCounts* counts = nullptr;
};

/// A block that is being read.
struct DecodingLane {
  LaneDecoder decoder;
  Slot first = 0;
  std::uint32_t slots = 0;
  std::uint32_t corrected = 0;
  Slot* corrected_slots = nullptr;           ///< room for all slots
  TrackerCorrection* corrections = nullptr;  ///< of the corrected slots
  TrackerCounts* counts = nullptr;
  const std::uint16_t* flags = nullptr;  ///< their models, from the block's first slot on
};

/// Reads the flags of one lane or two. `guess`: bits become branches, which pays if few bodies are corrected.
void read_flags(std::span<DecodingLane> lanes, const std::uint16_t* p1, bool guess);

/// Reads the corrections of one lane or two of a stream without orientations: what code_correction() reads,
/// and counts the same decisions. Returns false if steps are beyond kMaxTrackerSteps.
[[nodiscard]] bool read_corrections(std::span<DecodingLane> lanes, const TrackerContexts& contexts,
                                    const std::uint16_t* p1);

class TrackerDecoder {
 public:
  /// A block with a section.
  struct Part {
    Block block;
    std::span<const std::byte> stream;
    const char* broken = nullptr;  ///< why the stream is invalid
  };

  explicit TrackerDecoder(std::uint32_t capacity) { busy_.reserve(block_count(capacity)); }

  /// Fills in frame.delta and returns the corrected slots, ascending. Changes nothing else. Errors:
  /// kMalformed with the reason.
  Result<std::span<const Slot>> decode(const TrackerFrame& frame, std::span<const Section> sections);

 private:
  std::vector<Part> busy_;  // the blocks with a section
};

}  // namespace tandem
