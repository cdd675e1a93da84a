#pragma once
// The tracker codec's probabilities: the decisions that a block codes, each with its context. The same code
// serves the encoder, the decoder and the encoder's estimate of costs.

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/codec/codec.hpp"
#include "sdk/core/codec/range_coder.hpp"
#include "sdk/core/codec/selection.hpp"
#include "sdk/core/codec/tracker/filter.hpp"

namespace tandem {

/// Indices of the models. TrackerCounts counts the decisions in one delta: zeros and ones of each model.
struct TrackerModelIndex {
  static constexpr std::uint32_t kAges = 15, kLengths = 3, kShortAges = 5, kIntervals = 4, kSpeeds = 3,
                                 kLasts = 5, kRecents = 3, kLargest = 3, kClasses = 12, kShortClasses = 4;

  static constexpr std::uint32_t kFlag = 0;
  static constexpr std::uint32_t kFlagAtRest = kFlag + kAges * kAges * kLengths;
  static constexpr std::uint32_t kRest = kFlagAtRest + kAges;
  static constexpr std::uint32_t kSteps = kRest + 2 * kShortAges * kSpeeds;  ///< first model of the steps of
                                                                             ///< positions
  // Offsets from the first model of steps.
  static constexpr std::uint32_t kZero = 0;
  static constexpr std::uint32_t kSign = kZero + 3 * kShortAges * kIntervals * 3 * 2;
  static constexpr std::uint32_t kMagnitude = kSign + 3 * 27 * kIntervals;
  static constexpr std::uint32_t kPlace = kMagnitude + kLasts * kRecents * kLargest * kClasses;
  static constexpr std::uint32_t kEscape = kPlace + kClasses - kShortClasses;
  static constexpr std::uint32_t kStepModels = kEscape + 32;
  static constexpr std::uint32_t kOfPositions =
      kSteps + kStepModels;  ///< number of models in a stream without orientations
  static constexpr std::uint32_t kBoth = kOfPositions;
  static constexpr std::uint32_t kWhich = kBoth + 3 * kShortAges * kShortAges;
  static constexpr std::uint32_t kFine = kWhich + 3 * kShortAges * kShortAges;
  static constexpr std::uint32_t kTurnSteps = kFine + 1;  ///< first model of the steps of orientations
  static constexpr std::uint32_t kCount = kTurnSteps + kStepModels;
  static constexpr std::uint32_t kEven = kCount;     ///< for decisions without a model
  static constexpr std::uint32_t kDead = kEven + 1;  ///< for slots without a body: never a 1
  static constexpr std::uint32_t kAll = kDead + 4;   ///< decoders read four models side by side
};
using TrackerCounts = std::array<std::array<std::uint32_t, 2>, TrackerModelIndex::kAll>;

/// The probability of a 1 of each model, in 1/65536, and its weight. All blocks share the models. They stay
/// the same within a delta, so that blocks can be coded in parallel, and learn at its end.
struct TrackerModels {
  /// Limits of the probability in 1/65536. With them no decision costs more than 11 bits, and an expected one
  /// costs 0.0007 bits, so that the flags of a million bodies at rest take 90 bytes. A lower limit saves some
  /// of those and makes each surprise cost more.
  static constexpr std::uint32_t kLeast = 32, kMax = 65536 - kLeast;
  /// The initial probability of a flag and of a rest, 1/16, because most bodies need no correction. It is
  /// forgotten after the first deltas.
  static constexpr std::uint16_t kRare = 4096;

  TrackerModels();
  /// Updates the first `models` models. p1 becomes the mean of its old value, counted weight + 1 times, and
  /// of the decisions. The weight grows by their number, up to 255.
  void learn(const TrackerCounts& counts, std::uint32_t models);

  std::array<std::uint16_t, TrackerModelIndex::kAll> p1{};
  std::array<std::uint8_t, TrackerModelIndex::kCount> weight{};
};

/// The context of a body's steps: parts of the indices of their models.
struct TrackerContext {
  std::uint32_t steps = TrackerModelIndex::kSteps;  ///< index of the first model of its steps
  std::uint32_t rest = 0;                           ///< complete index of "is it put to rest"
  std::uint32_t zero = 0;                           ///< part of the index of "is this axis untouched"
  std::array<std::uint32_t, 3> magnitude{};   ///< part of the index of "is it of a longer class", per axis
  std::array<std::uint32_t, 3> sign{};        ///< complete index, per axis
  std::array<std::uint32_t, 3> moved_last{};  ///< 0, 1: whether the last correction moved this axis
};

/// The additional context of a body in a stream with orientations.
struct TrackerTurnContext {
  std::uint32_t choice = 0;  ///< part of the indices of "are both corrected" and "which"
  TrackerContext turn;       ///< context of the orientation's steps
};
/// `position`, `turn`: as remembered before the delta. They and `w` are zeros for a renewed body.
[[nodiscard]] TrackerTurnContext turn_context(const TrackerBody& position, const TrackerBody& turn,
                                              const Spin& w);

namespace tracker_detail {

// Fifteen runs of counts, each about as wide as a third of its start. The probability of a correction needs
// no finer ones.
inline constexpr std::array<std::uint8_t, 14> kLastOfRun{0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 40, 64, 128, 250};

}  // namespace tracker_detail

/// The bucket of a frame count 0 .. 255, for vector loops.
[[nodiscard]] constexpr std::uint8_t tracker_age_bucket(std::uint8_t count) {
  std::uint8_t bucket = 0;
  for (const std::uint8_t last : tracker_detail::kLastOfRun)
    bucket = static_cast<std::uint8_t>(bucket + (count > last ? 1 : 0));
  return bucket;
}
/// Buckets of frame counts 0 .. 255.
extern const std::array<std::uint8_t, 256> tracker_age_buckets;

namespace tracker_detail {

// The class of the longest of a body's last steps: 0 up to one, 1 two, 2 more.
inline std::uint32_t length_class(const TrackerSteps& steps) {
  std::int32_t longest = 0;
  for (const std::int32_t step : steps) longest = std::max({longest, step, -step});
  return static_cast<std::uint32_t>(longest > 1) + static_cast<std::uint32_t>(longest > 2);
}

}  // namespace tracker_detail

/// The values that a flag depends on in a stream with orientations: the younger correction, the shorter
/// interval (0: none), the longer steps.
[[nodiscard]] TrackerBody merged(const TrackerBody& position, const TrackerBody& turn);

/// The part of a flag's index that changes only when its body is corrected: 0 .. 44.
[[nodiscard]] inline std::uint8_t flag_history(const TrackerBody& body) {
  return static_cast<std::uint8_t>(tracker_age_buckets[body.interval] * TrackerModelIndex::kLengths +
                                   tracker_detail::length_class(body.steps));
}
/// The flag's index.
[[nodiscard]] inline std::uint32_t flag_model(std::uint32_t age, std::uint32_t history, bool rest) {
  if (rest) return TrackerModelIndex::kFlagAtRest + tracker_age_buckets[age + 1U];
  return TrackerModelIndex::kFlag +
         tracker_age_buckets[age + 1U] * (TrackerModelIndex::kAges * TrackerModelIndex::kLengths) + history;
}

/// Computes flag_model() of many slots from their columns; kDead if there is no body.
void list_flag_models(const std::uint8_t* ages, const std::uint8_t* histories, const std::uint8_t* rest,
                      const std::uint8_t* alive, std::span<std::uint16_t> models);

/// The contexts of all slots of a block, one byte per column. They are computed for all slots in one loop,
/// whether they are used or not. That takes less time than computing those of a tenth of the bodies one by
/// one.
class TrackerContexts {
 public:
  explicit TrackerContexts(std::uint32_t slots) : slots_(slots), bytes_(std::size_t{kColumns} * slots) {}

  /// `ages`, `intervals`, `steps`: columns of the bodies before the delta; v and c of the predicted state.
  void fill(const Block& block, const State& predicted, const std::array<const std::uint8_t*, 5>& bodies,
            std::int32_t threshold);
  /// Sets the context of a body that was renewed in this delta.
  void renew(Slot slot) {
    for (std::size_t i = 0; i < kColumns; ++i) column(i)[slot] = kRenewed[i];
  }
  [[nodiscard]] TrackerContext of(Slot slot) const {
    const std::uint8_t* at = bytes_.data() + slot;
    TrackerContext context;
    context.zero = *at & 31U;
    for (std::uint32_t axis = 0; axis < 3; ++axis) context.moved_last[axis] = (*at >> (5U + axis)) & 1U;
    const std::uint32_t sign = context.steps + TrackerModelIndex::kSign + (at[slots_] >> 4U);
    for (std::uint32_t axis = 0; axis < 3; ++axis) context.magnitude[axis] = *(at += slots_) & 15U;
    context.rest = TrackerModelIndex::kRest + bytes_[(kColumns - 1) * slots_ + slot];
    for (std::uint32_t axis = 0; axis < 3; ++axis)
      context.sign[axis] = sign + (axis * 27 + *(at += slots_)) * TrackerModelIndex::kIntervals;
    return context;
  }

 private:
  // The columns: zero, with moved_last from bit 5 on; magnitude for x, y, z, that of x with the common age of
  // all signs from bit 4 on; the rest of the sign's index for x, y, z: 0 .. 26; rest: 0 .. 29.
  static constexpr std::size_t kColumns = 8;
  static constexpr std::array<std::uint8_t, kColumns> kRenewed{0, 0, 0, 0, 13, 13, 13, 0};
  std::uint8_t* column(std::size_t i) { return bytes_.data() + i * slots_; }

  std::size_t slots_;
  std::vector<std::uint8_t> bytes_;
};

/// The index of "is this axis untouched", after `moved` axes that are not zero.
[[nodiscard]] inline std::uint32_t zero_model(const TrackerContext& context, std::uint32_t axis,
                                              std::uint32_t moved) {
  using Index = TrackerModelIndex;
  return context.steps + Index::kZero +
         ((axis * Index::kShortAges * Index::kIntervals + context.zero) * 3 + moved) * 2 +
         context.moved_last[axis];
}
/// The index of "is it of a longer class than the first", after axes of which the longest moves by `longest`
/// steps. The indices for longer classes follow it.
[[nodiscard]] inline std::uint32_t magnitude_model(const TrackerContext& context, std::uint32_t axis,
                                                   std::uint32_t longest) {
  const auto largest = static_cast<std::uint32_t>(longest > 0) + static_cast<std::uint32_t>(longest > 2);
  return context.steps + TrackerModelIndex::kMagnitude +
         (context.magnitude[axis] * TrackerModelIndex::kLargest + largest) * TrackerModelIndex::kClasses;
}

/// Reads decisions from bytes and counts them. The first argument is what an encoder would code.
struct DecisionDecoder {
  bool code(bool /*bit*/, std::uint32_t model) {
    const bool bit = range.get(models->p1[model]);
    ++(*counts)[model][bit ? 1 : 0];
    return bit;
  }
  bool code_sign(bool /*bit*/, std::uint32_t model) {
    const bool bit = range.get_masked(models->p1[model]);
    ++(*counts)[model][bit ? 1 : 0];
    return bit;
  }
  bool code_even(bool bit) { return code(bit, TrackerModelIndex::kEven); }
  RangeDecoder range;
  const TrackerModels* models = nullptr;
  TrackerCounts* counts = nullptr;
};

/// Counts the sizes of positions by the row of their models and by how far their classes went: one count a
/// size instead of one a decision. At the end they become the decisions that were coded.
class SizeCounts {
 public:
  static constexpr std::uint32_t kRows =
      TrackerModelIndex::kLasts * TrackerModelIndex::kRecents * TrackerModelIndex::kLargest;
  static constexpr std::uint32_t kNone = kRows;  ///< the row of axes that do not move

  void add(std::uint32_t row, std::uint32_t size_class) { ++ended_[row][size_class]; }
  void add_to(TrackerCounts& counts) const {
    using Index = TrackerModelIndex;
    for (std::uint32_t row = 0; row < kRows; ++row) {
      std::uint32_t longer = ended_[row][Index::kClasses];
      for (std::uint32_t size_class = Index::kClasses; size_class-- > 0;) {
        auto& [zeros, ones] = counts[Index::kSteps + Index::kMagnitude + row * Index::kClasses + size_class];
        zeros += ended_[row][size_class];
        ones += longer;
        longer += ended_[row][size_class];
      }
    }
  }

 private:
  std::array<std::array<std::uint32_t, TrackerModelIndex::kClasses + 1>, kRows + 1> ended_{};
};

/// Maximum number of bits that code_correction() writes.
inline constexpr std::size_t kMaxCorrectionBits =
    11 + 3 * (22 + (std::size_t{TrackerModelIndex::kClasses} + 31) * 11 + 31);

namespace tracker_detail {

// Numbers of steps are coded by class, two to an octave: 1, 2, 3, 4, 5-6, 7-8, 9-12, ... 49-64. Beyond the
// first four the place within the class follows: 2^bits numbers, of which the lower half is the likelier.
// Longer steps are rare.
struct SizeClass {
  std::uint8_t first, bits;
};
inline constexpr std::array<SizeClass, TrackerModelIndex::kClasses> kSizeClasses{
    {{1, 0}, {2, 0}, {3, 0}, {4, 0}, {5, 1}, {7, 1}, {9, 2}, {13, 2}, {17, 3}, {25, 3}, {33, 4}, {49, 4}}};
inline constexpr std::uint32_t kBeyondClasses = 65;

// The class of a size, at least 1. Beyond the last class it goes on in the same way.
constexpr std::uint32_t size_class(std::uint32_t size) {
  if (size <= 2) return size - 1;
  const auto octave = static_cast<std::uint32_t>(std::bit_width(size - 1)) - 1;
  return 2 * octave + (((size - 1) >> (octave - 1)) & 1U);
}

// Codes x >= 0: the number of bits of x + 1 in unary, then those bits without the first.
template <class Coder>
bool code_escape(Coder& coder, std::uint32_t models, std::uint32_t& x) {
  const std::uint64_t wanted = std::uint64_t{x} + 1;
  unsigned bits = 0;
  while (bits < 31 && coder.code((wanted >> (bits + 1)) != 0, models + bits)) ++bits;
  std::uint64_t value = 1;
  for (unsigned i = bits; i-- > 0;) {
    value = value << 1U | static_cast<std::uint64_t>(coder.code_even(((wanted >> i) & 1U) != 0));
  }
  x = static_cast<std::uint32_t>(value - 1);
  return value - 1 <= static_cast<std::uint64_t>(kMaxTrackerSteps) - kBeyondClasses;
}

}  // namespace tracker_detail

/// Codes one axis. `moved`: number of earlier axes that are not zero; `longest`: steps of the longest of
/// them. Returns as code_steps().
template <class Coder>
[[gnu::always_inline]] inline bool code_axis(Coder& coder, const TrackerContext& context, std::uint32_t axis,
                                             std::uint32_t moved, std::uint32_t longest,
                                             std::int32_t& steps) {
  const std::int32_t wanted = steps;
  const bool is_last_hope = axis == 2 && moved == 0;
  if (!is_last_hope && !coder.code(wanted != 0, zero_model(context, axis, moved))) {
    steps = 0;
    return true;
  }
  const bool negative = coder.code_sign(wanted < 0, context.sign[axis]);
  const auto length = static_cast<std::uint32_t>(wanted < 0 ? -wanted : wanted);
  const std::uint32_t wanted_class = length == 0 ? 0 : tracker_detail::size_class(length);
  const std::uint32_t base = magnitude_model(context, axis, longest);
  std::uint32_t found = 0;
  while (found < TrackerModelIndex::kClasses && coder.code(wanted_class > found, base + found)) ++found;
  std::uint32_t size = 0;
  if (found < TrackerModelIndex::kShortClasses) {
    size = found + 1;
  } else if (found < TrackerModelIndex::kClasses) {
    const auto [first, bits] = tracker_detail::kSizeClasses[found];
    const std::uint32_t place = length - first;
    const std::uint32_t models = context.steps + TrackerModelIndex::kPlace - TrackerModelIndex::kShortClasses;
    size = static_cast<std::uint32_t>(coder.code(((place >> (bits - 1U)) & 1U) != 0, models + found));
    for (unsigned bit = bits - 1U; bit-- > 0;)
      size = size << 1U | static_cast<std::uint32_t>(coder.code_even(((place >> bit) & 1U) != 0));
    size += first;
  } else {
    std::uint32_t beyond = length - std::min(length, tracker_detail::kBeyondClasses);
    Coder rare = coder;  // a copy, so that a call that is not inlined leaves `coder` in registers
    const bool good = tracker_detail::code_escape(rare, context.steps + TrackerModelIndex::kEscape, beyond);
    coder = rare;
    if (!good) return false;
    size = tracker_detail::kBeyondClasses + beyond;
  }
  steps = negative ? -static_cast<std::int32_t>(size) : static_cast<std::int32_t>(size);
  return true;
}

/// Codes the steps of one body, not all of them zero. `Coder` has code(bit, model) and code_even(bit), both
/// returning the bit. A decoder ignores the argument and fills `steps`. Returns false if a decoder read steps
/// beyond kMaxTrackerSteps.
template <class Coder>
bool code_steps(Coder& coder, const TrackerContext& context, TrackerSteps& steps) {
  Coder local = coder;  // a copy in registers, because counts are written through pointers in between
  std::uint32_t moved = 0, longest = 0;
  const auto code = [&](std::uint32_t axis) {
    const bool good = code_axis(local, context, axis, moved, longest, steps[axis]);
    moved += static_cast<std::uint32_t>(steps[axis] != 0);
    longest = std::max(longest, static_cast<std::uint32_t>(steps[axis] < 0 ? -steps[axis] : steps[axis]));
    return good;
  };
  const bool good = code(0) && code(1) && code(2);
  coder = local;
  return good;
}

/// Codes a correction. Returns as code_steps().
template <class Coder>
bool code_correction(Coder& coder, const TrackerContext& context, TrackerCorrection& correction) {
  correction.rest = coder.code(correction.rest, context.rest);
  return code_steps(coder, context, correction.steps);
}

/// Does the same in a stream with orientations.
template <class Coder>
bool code_correction(Coder& coder, const TrackerContext& context, const TrackerTurnContext& turn_context,
                     TrackerTurningCorrection& correction) {
  using Index = TrackerModelIndex;
  correction.rest = coder.code(correction.rest, context.rest);
  bool moves = is_some(correction.steps);
  bool turns = is_some(correction.turn);
  if (coder.code(moves && turns, Index::kBoth + turn_context.choice)) {
    moves = turns = true;
    correction.fine = coder.code(correction.fine, Index::kFine);
  } else {
    turns = coder.code(turns, Index::kWhich + turn_context.choice);
    moves = !turns;
    correction.fine = false;
  }
  if (!moves) correction.steps = {};
  if (!turns) correction.turn = {};
  return (!moves || code_steps(coder, context, correction.steps)) &&
         (!turns || code_steps(coder, turn_context.turn, correction.turn));
}

}  // namespace tandem
