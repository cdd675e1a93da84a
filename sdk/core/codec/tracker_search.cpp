#include "sdk/core/codec/tracker_search.hpp"

#include <algorithm>
#include <bit>

#include "sdk/core/codec/delta.hpp"
#include "sdk/core/codec/residual.hpp"

namespace tandem {
namespace {

// A body within the threshold but beyond this share of it (1/256) goes early if the model half expects it
// anyway: a few more bits, a much smaller RMS error (RESEARCH.md).
constexpr std::int64_t kEarlyShare = 218;
constexpr std::uint32_t kEarlyProbability = 19661;
// Bits that an error of one threshold is worth.
constexpr std::uint64_t kErrorWorth = 14;
constexpr std::int64_t kMostDistance = TrackerSteppings::kMostDistance;
constexpr std::size_t kHeaderBytes = kSectionHeaderBytes + 2;
// A tried number of bodies this close (1/64) to the largest that fits is good enough.
constexpr std::uint32_t kTryPrecision = 64;

// log2(x / 2^12) in 1/256 bits, x in 1 .. 2^12, by repeated squaring: the same with every compiler.
constexpr std::uint32_t bits_256(std::uint32_t x) {
  const auto whole = static_cast<std::uint32_t>(std::bit_width(x)) - 1U;
  std::uint64_t mantissa = (std::uint64_t{x} << 32U) >> whole;  // 1 .. 2 in 32.32
  std::uint32_t log = whole << 8U;
  for (std::uint32_t i = 0; i < 8; ++i) {
    mantissa = (mantissa >> 2U) * (mantissa >> 2U) >> 28U;
    if (mantissa >= std::uint64_t{2} << 32U) {
      mantissa >>= 1U;
      log |= 128U >> i;
    }
  }
  return (12U << 8U) - log;
}
constexpr auto kBits = [] {
  std::array<std::uint16_t, 4096> table{};
  for (std::uint32_t i = 0; i < 4096; ++i) table[i] = static_cast<std::uint16_t>(bits_256(i == 0 ? 1 : i));
  return table;
}();

// What a decision would cost, in 1/256 bits.
std::uint32_t cost_of(bool bit, const AdaptiveBit& model) {
  const std::uint32_t p1 = model.p1() >> 4U;
  return kBits[bit ? p1 : 4095U - p1];
}

// Adds up what decisions would cost.
struct CostCoder {
  std::uint32_t cost = 0;
  bool code(bool bit, const AdaptiveBit& model) {
    cost += cost_of(bit, model);
    return bit;
  }
  bool code_even(bool bit) {
    cost += 256;
    return bit;
  }
};

std::int32_t nearest(std::int32_t from, std::int32_t to, std::int32_t step) {
  const auto unit = static_cast<std::uint32_t>(step);
  const std::uint32_t steps = (magnitude(to, from) + unit / 2) / unit;
  const auto q = static_cast<std::int32_t>(std::min<std::uint32_t>(steps, kMostTrackerSteps - 1));
  return to < from ? -q : q;
}

// The two values on either side of the residual on each axis, what they leave over and what they cost, so
// that the eight points are sums of table entries. All are filled, used or not: almost no branch that is hard
// to guess. (The third value around the nearest, on its far side, does not pay: RESEARCH.md.)
class Choices {
 public:
  Choices(const TrackerModels& models, const TrackerContext& context, const TrackerSteps& lower)
      : lower_(lower) {
    const Lengths lengths = length_costs(models, context);
    for (std::uint32_t axis = 0; axis < 3; ++axis) fill_costs(models, context, lengths, axis);
  }

  void fill_errors(const TrackerSteppings& steppings, const std::array<std::int64_t, 3>& d,
                   std::int64_t threshold);
  /// The cheapest point within the error ball; false: there is none.
  bool cheapest(const ErrorWorth& worth, TrackerSteps& steps) const;

 private:
  static constexpr std::uint64_t kOutside = std::uint64_t{1} << 61U;  // three of them do not overflow
  // Costs of the lengths 1 and 2 after so many axes that are not zero.
  using Lengths = std::array<std::array<std::uint32_t, 2>, 3>;

  static Lengths length_costs(const TrackerModels& models, const TrackerContext& context) {
    Lengths lengths{};
    for (std::uint32_t moved = 0; moved < 3; ++moved) {
      const AdaptiveBit* longer = &models.magnitude[magnitude_model(context, moved)];
      lengths[moved] = {cost_of(false, longer[0]), cost_of(true, longer[0]) + cost_of(false, longer[1])};
    }
    return lengths;
  }
  void fill_costs(const TrackerModels& models, const TrackerContext& context, const Lengths& lengths,
                  std::uint32_t axis);
  [[nodiscard]] std::int32_t value(std::size_t axis, std::size_t i) const {
    return lower_[axis] + static_cast<std::int32_t>(i);
  }

  TrackerSteps lower_;
  // Error squared on one axis: of the unit of long steps (0), or of small ones with 1, 2, 3 axes moved.
  std::array<std::array<std::array<std::uint64_t, 2>, 3>, 4> error_{};
  // In 1/256 bits, [axis][earlier axes that are not zero].
  std::array<std::array<std::array<std::uint32_t, 2>, 3>, 3> cost_{};
};

void Choices::fill_costs(const TrackerModels& models, const TrackerContext& context, const Lengths& lengths,
                         std::uint32_t axis) {
  const AdaptiveBit& sign = models.sign[context.sign[axis]];
  for (std::uint32_t moved = 0; moved <= axis; ++moved) {
    std::array<std::uint32_t, 2> is_moved{0, 0};
    if (axis != 2 || moved != 0) {
      const AdaptiveBit& zero = models.zero[zero_model(context, axis, moved)];
      is_moved = {cost_of(false, zero), cost_of(true, zero)};
    }
    for (std::size_t i = 0; i < 2; ++i) {
      std::int32_t steps = value(axis, i);
      if (steps < -2 || steps > 2) {
        CostCoder coder;
        code_axis(coder, models, context, axis, moved, steps);
        cost_[axis][moved][i] = coder.cost;
        continue;
      }
      const std::uint32_t length = lengths[moved][steps == 2 || steps == -2 ? 1 : 0];
      cost_[axis][moved][i] = steps == 0 ? is_moved[0] : is_moved[1] + cost_of(steps < 0, sign) + length;
    }
  }
}

void Choices::fill_errors(const TrackerSteppings& steppings, const std::array<std::int64_t, 3>& d,
                          std::int64_t threshold) {
  for (std::size_t unit = 0; unit < 4; ++unit) {
    const std::int64_t one = unit == 0 ? steppings.step() : steppings.small(unit);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (std::size_t i = 0; i < 2; ++i) {
        const std::int64_t off = d[axis] - std::clamp(value(axis, i) * one, -kMostDistance, kMostDistance);
        const bool inside = -threshold <= off && off <= threshold;
        // The product of values outside may wrap; it is not used.
        const auto size = static_cast<std::uint64_t>(off);
        error_[unit][axis][i] = inside ? size * size : kOutside;
      }
    }
  }
}

bool Choices::cheapest(const ErrorWorth& worth, TrackerSteps& steps) const {
  std::array<std::array<std::uint32_t, 2>, 3> moves{};
  std::array<std::array<std::uint32_t, 2>, 3> is_long{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < 2; ++i) {
      const std::int32_t v = value(axis, i);
      moves[axis][i] = static_cast<std::uint32_t>(v != 0);
      is_long[axis][i] = static_cast<std::uint32_t>(v < -1 || v > 1);
    }
  }
  std::uint64_t best = UINT64_MAX;
  std::size_t best_point = 0;
  for (std::size_t point = 0; point < 8; ++point) {
    const std::size_t x = point >> 2U;
    const std::size_t y = (point >> 1U) & 1U;
    const std::size_t z = point & 1U;
    const std::uint32_t before_y = moves[0][x];
    const std::uint32_t before_z = before_y + moves[1][y];
    const std::uint32_t moved = before_z + moves[2][z];
    const std::size_t unit = (is_long[0][x] | is_long[1][y] | is_long[2][z]) != 0 ? 0 : moved;
    const std::uint64_t error = error_[unit][0][x] + error_[unit][1][y] + error_[unit][2][z];
    const std::uint64_t cost = std::uint64_t{cost_[0][0][x]} + cost_[1][before_y][y] + cost_[2][before_z][z] +
                               (((error >> worth.shift) * worth.worth) >> 24U);
    const std::uint64_t counted = moved != 0 && error <= worth.limit ? cost : UINT64_MAX;
    best_point = counted < best ? point : best_point;
    best = std::min(counted, best);
  }
  if (best == UINT64_MAX) return false;
  steps = {value(0, best_point >> 2U), value(1, (best_point >> 1U) & 1U), value(2, best_point & 1U)};
  return true;
}

}  // namespace

ErrorWorth::ErrorWorth(std::int32_t e)
    : threshold(e),
      limit(static_cast<std::uint64_t>(e) * static_cast<std::uint64_t>(e)),
      shift(static_cast<unsigned>(std::max(0, static_cast<int>(std::bit_width(limit)) - 24))),
      worth((kErrorWorth * 256U << 24U) / (limit >> shift)) {}

bool choose_steps(const Vec3i& from, const Vec3i& to, const TrackerSteppings& steppings,
                  const ErrorWorth& worth, const TrackerModels& models, const TrackerContext& context,
                  TrackerSteps& steps) {
  std::array<std::int64_t, 3> d{};
  TrackerSteps lower{};
  for (std::size_t i = 0; i < 3; ++i) {
    d[i] = std::int64_t{to[i]} - from[i];
    steps[i] = nearest(from[i], to[i], steppings.step());
    lower[i] = steps[i] - (std::int64_t{steps[i]} * steppings.step() > d[i] ? 1 : 0);
  }
  Choices choices(models, context, lower);
  choices.fill_errors(steppings, d, worth.threshold);
  return choices.cheapest(worth, steps);
}

TrackerSearch::TrackerSearch(std::uint32_t capacity)
    : waiting_(capacity), waiting_next_(capacity), marks_(kBlockSlots) {
  candidates_.reserve(capacity);
  order_.reserve(capacity);
}

void TrackerSearch::encode(Tracker& tracker, const State& target, std::int32_t threshold, std::size_t budget,
                           ByteWriter& out) {
  threshold_ = threshold;
  scan(*tracker.predicted_, target, threshold);
  const std::span<std::byte> room = out.rest().first(budget);
  std::size_t size_bytes = 0;
  if (!write(tracker, target, must_, true, room, size_bytes)) {
    rank();
    std::uint32_t fits = 0;
    std::uint32_t too_many = must_ + 1;
    std::uint32_t tried = must_ + 1;
    while (too_many - fits > 1 + fits / kTryPrecision) {
      tried = fits + (too_many - fits) / 2;
      (write(tracker, target, tried, false, room, size_bytes) ? fits : too_many) = tried;
    }
    if (tried != fits) write(tracker, target, fits, false, room, size_bytes);
  }
  out.advance(size_bytes);
  remember_waiting(tracker);
}

void TrackerSearch::scan(const State& predicted, const State& target, std::int32_t threshold) {
  candidates_.clear();
  must_ = 0;
  const auto limit = static_cast<std::uint64_t>(threshold) * static_cast<std::uint64_t>(threshold);
  const auto early = static_cast<std::int32_t>((threshold * kEarlyShare) >> 8);
  for (std::uint32_t b = 0; b < block_count(predicted.capacity()); ++b) {
    for_each_beyond(predicted, target, block_at(b, predicted.capacity()), early,
                    std::span<std::uint8_t, kBlockSlots>(marks_.data(), kBlockSlots),
                    [&](Slot slot, std::uint64_t error) {
                      const bool must = error > limit;
                      candidates_.push_back({error, slot, 0, must});
                      must_ += static_cast<std::uint32_t>(must);
                    });
  }
}

void TrackerSearch::rank() {
  order_.clear();
  for (std::uint32_t i = 0; i < candidates_.size(); ++i) {
    if (candidates_[i].must) order_.push_back(i);
  }
  const auto urgency = [this](std::uint32_t i) {
    constexpr std::uint64_t kMostError = (std::uint64_t{1} << 48U) - 1;  // so that the product fits
    const std::uint64_t waited = waiting_[candidates_[i].slot];
    return std::min(candidates_[i].error, kMostError) * (waited + 1) * (waited + 1);
  };
  std::sort(order_.begin(), order_.end(), [&urgency](std::uint32_t a, std::uint32_t b) {
    const std::uint64_t of_a = urgency(a);
    const std::uint64_t of_b = urgency(b);
    return of_a != of_b ? of_a > of_b : a < b;
  });
  for (std::uint32_t r = 0; r < order_.size(); ++r) candidates_[order_[r]].rank = r;
}

bool TrackerSearch::write(Tracker& tracker, const State& target, std::uint32_t limit, bool early,
                          std::span<std::byte> out, std::size_t& size_bytes) {
  tracker.count_ = 0;
  std::fill(tracker.worked_.begin(), tracker.worked_.end(), std::uint8_t{0});
  size_bytes = 0;
  std::size_t at = 0;
  for (std::uint32_t b = 0; b < block_count(tracker.capacity_); ++b) {
    if (!write_block(tracker, target, block_at(b, tracker.capacity_), at, limit, early, out, size_bytes)) {
      return false;
    }
  }
  return true;
}

bool TrackerSearch::write_block(Tracker& tracker, const State& target, const Block& block, std::size_t& at,
                                std::uint32_t limit, bool early, std::span<std::byte> out,
                                std::size_t& size_bytes) {
  const State& predicted = *tracker.predicted_;
  TrackerModels& models = tracker.work_[block.index];
  models = tracker.models_[block.index];
  const TrackerSteppings steppings(threshold_);
  const ErrorWorth worth(threshold_);
  const std::span<std::byte> rest = out.subspan(size_bytes);
  const std::size_t header = std::min(kHeaderBytes, rest.size());
  RangeEncoder coder(rest.subspan(header));
  const std::size_t first = tracker.count_;
  bool previous = false;
  tracker.for_each_body(block, predicted.alive(), [&](Slot slot, bool renewed, std::uint32_t flag) {
    AdaptiveBit& model = models.flag[flag + static_cast<std::uint32_t>(previous)];
    previous = false;
    TrackerSteps steps{};
    TrackerContext context;
    if (at < candidates_.size() && candidates_[at].slot == slot) {
      const Candidate& candidate = candidates_[at++];
      if (candidate.must ? candidate.rank < limit : early && model.p1() > kEarlyProbability) {
        context = tracker.context(slot, renewed, threshold_);
        const bool inside = choose_steps(predicted.body(slot).p, target.body(slot).p, steppings, worth,
                                         models, context, steps);
        previous = inside || (candidate.must && steps != TrackerSteps{});
      }
    }
    coder.code(previous, model);
    if (!previous) return;
    RangeEncoder values = coder;  // a copy, so that the call leaves `coder` in registers
    code_steps(values, models, context, steps);
    coder = values;
    tracker.corrected_[tracker.count_] = slot;
    tracker.steps_[tracker.count_++] = steps;
  });
  if (tracker.count_ == first) return true;
  const std::size_t coded = coder.finish();
  if (coder.overflow() || rest.size() < kHeaderBytes) return false;
  ByteWriter head(rest.first(kHeaderBytes));
  head.put(static_cast<std::uint16_t>(SectionType::kCorrections));
  head.put(static_cast<std::uint32_t>(coded + 2));
  head.put(static_cast<std::uint16_t>(block.index));
  size_bytes += kHeaderBytes + coded;
  tracker.worked_[block.index] = 1;
  return true;
}

void TrackerSearch::remember_waiting(const Tracker& tracker) {
  std::fill(waiting_next_.begin(), waiting_next_.end(), std::uint8_t{0});
  for (const Candidate& candidate : candidates_) {
    if (!candidate.must) continue;
    waiting_next_[candidate.slot] = static_cast<std::uint8_t>(std::min(waiting_[candidate.slot] + 1, 255));
  }
  for (const Slot slot : tracker.corrected()) waiting_next_[slot] = 0;
  waiting_.swap(waiting_next_);
}

}  // namespace tandem
