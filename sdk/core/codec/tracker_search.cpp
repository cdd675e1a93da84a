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

// Adds up what decisions would cost.
struct CostCoder {
  const TrackerCosts* costs;
  std::uint32_t cost = 0;
  bool code(bool bit, std::uint32_t model) {
    cost += costs->of[model][bit ? 1 : 0];
    return bit;
  }
  bool code_even(bool bit) { return code(bit, TrackerModelIndex::kEven); }
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
  Choices(const TrackerCosts& costs, const TrackerContext& context, const TrackerSteps& lower)
      : lower_(lower) {
    const Lengths lengths = length_costs(costs, context);
    for (std::uint32_t axis = 0; axis < 3; ++axis) fill_costs(costs, context, lengths, axis);
  }

  void fill_errors(const TrackerSteppings& steppings, const std::array<std::int64_t, 3>& d,
                   std::int64_t threshold);
  /// The cheapest point within the error ball; false: there is none.
  bool cheapest(const ErrorWorth& worth, TrackerSteps& steps) const;

 private:
  static constexpr std::uint64_t kOutside = std::uint64_t{1} << 61U;  // three of them do not overflow
  // Costs of the lengths 1 and 2 after so many axes that are not zero.
  using Lengths = std::array<std::array<std::uint32_t, 2>, 3>;

  static Lengths length_costs(const TrackerCosts& costs, const TrackerContext& context) {
    Lengths lengths{};
    for (std::uint32_t moved = 0; moved < 3; ++moved) {
      const auto* longer = &costs.of[magnitude_model(context, moved)];
      lengths[moved] = {longer[0][0], std::uint32_t{longer[0][1]} + longer[1][0]};
    }
    return lengths;
  }
  void fill_costs(const TrackerCosts& costs, const TrackerContext& context, const Lengths& lengths,
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

void Choices::fill_costs(const TrackerCosts& costs, const TrackerContext& context, const Lengths& lengths,
                         std::uint32_t axis) {
  const auto sign = costs.of[context.sign[axis]];
  for (std::uint32_t moved = 0; moved <= axis; ++moved) {
    std::array<std::uint16_t, 2> is_moved{0, 0};
    if (axis != 2 || moved != 0) is_moved = costs.of[zero_model(context, axis, moved)];
    for (std::size_t i = 0; i < 2; ++i) {
      std::int32_t steps = value(axis, i);
      if (steps < -2 || steps > 2) {
        CostCoder coder{&costs};
        code_axis(coder, context, axis, moved, steps);
        cost_[axis][moved][i] = coder.cost;
        continue;
      }
      const std::uint32_t length = lengths[moved][steps == 2 || steps == -2 ? 1 : 0];
      cost_[axis][moved][i] = steps == 0 ? is_moved[0] : is_moved[1] + sign[steps < 0 ? 1U : 0U] + length;
    }
  }
}

void Choices::fill_errors(const TrackerSteppings& steppings, const std::array<std::int64_t, 3>& d,
                          std::int64_t threshold) {
  for (std::size_t unit = 0; unit < 4; ++unit) {
    const std::int64_t one = steppings.unit(unit);
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

void TrackerCosts::learn(const TrackerModels& models) {
  for (std::size_t i = 0; i < of.size(); ++i) {
    const std::uint32_t p = models.p1[i] >> 4U;
    of[i] = {kBits[4095U - p], kBits[p]};
  }
}

ErrorWorth::ErrorWorth(std::int32_t e)
    : threshold(e),
      limit(static_cast<std::uint64_t>(e) * static_cast<std::uint64_t>(e)),
      shift(static_cast<unsigned>(std::max(0, static_cast<int>(std::bit_width(limit)) - 24))),
      worth((kErrorWorth * 256U << 24U) / (limit >> shift)) {}

bool choose_steps(const Vec3i& from, const Vec3i& to, const TrackerSteppings& steppings,
                  const ErrorWorth& worth, const TrackerCosts& costs, const TrackerContext& context,
                  TrackerSteps& steps) {
  std::array<std::int64_t, 3> d{};
  TrackerSteps lower{};
  for (std::size_t i = 0; i < 3; ++i) {
    d[i] = std::int64_t{to[i]} - from[i];
    steps[i] = nearest(from[i], to[i], steppings.unit(0));
    lower[i] = steps[i] - (std::int64_t{steps[i]} * steppings.unit(0) > d[i] ? 1 : 0);
  }
  Choices choices(costs, context, lower);
  choices.fill_errors(steppings, d, worth.threshold);
  return choices.cheapest(worth, steps);
}

TrackerSearch::TrackerSearch(std::uint32_t capacity)
    : candidates_(capacity),
      parts_(block_count(capacity)),
      waiting_(capacity),
      marks_(std::size_t{block_count(capacity)} * kBlockSlots) {
  std::size_t bytes = 0;
  for (std::uint32_t b = 0; b < parts_.size(); ++b) {
    parts_[b].first_byte = bytes;
    bytes += kMostTrackerBytesPerBody * block_at(b, capacity).slots + kTrackerSlackBytes;
  }
  bytes_.resize(bytes);
  order_.reserve(capacity);
}

void TrackerSearch::encode(Tracker& tracker, const State& target, std::size_t budget, ByteWriter& out) {
  costs_.learn(tracker.models_);
  tracker.for_each_block([&](const Block& block) { choose(tracker, target, block); });
  must_ = 0;
  for (const Part& part : parts_) must_ += part.must;
  const bool all_fit = write(tracker, must_, true, budget);
  if (!all_fit) {
    rank();
    std::uint32_t fits = 0;
    std::uint32_t too_many = must_ + 1;
    std::uint32_t tried = must_ + 1;
    while (too_many - fits > 1 + fits / kTryPrecision) {
      tried = fits + (too_many - fits) / 2;
      (write(tracker, tried, false, budget) ? fits : too_many) = tried;
    }
    if (tried != fits) write(tracker, fits, false, budget);
  }
  for (std::uint32_t b = 0; b < parts_.size(); ++b) {
    if (tracker.work_[b].corrected == 0) continue;
    out.put(static_cast<std::uint16_t>(SectionType::kCorrections));
    out.put(static_cast<std::uint32_t>(parts_[b].coded_bytes + 2));
    out.put(static_cast<std::uint16_t>(b));
    out.put_bytes(std::span(bytes_).subspan(parts_[b].first_byte, parts_[b].coded_bytes));
  }
  if (!all_fit || some_wait_) remember_waiting(tracker);
}

void TrackerSearch::choose(const Tracker& tracker, const State& target, const Block& block) {
  const State& predicted = *tracker.predicted_;
  const std::int32_t threshold = tracker.threshold_;
  const TrackerSteppings steppings(threshold);
  const ErrorWorth worth(threshold);
  const auto early = static_cast<std::int32_t>((threshold * kEarlyShare) >> 8);
  Candidate* at = candidates_.data() + block.first;
  std::uint32_t must = 0;
  const std::span<std::uint8_t, kBlockSlots> marks(marks_.data() + std::size_t{block.index} * kBlockSlots,
                                                   kBlockSlots);
  for_each_beyond(predicted, target, block, early, marks, [&](Slot slot, std::uint64_t error) {
    Candidate candidate{error, slot, 0, error > worth.limit, {}};
    if (!candidate.must && tracker.models_.p1[tracker.flag_of(slot)] <= tracker.gains_->early) {
      return;
    }
    const bool inside = choose_steps(predicted.body(slot).p, target.body(slot).p, steppings, worth, costs_,
                                     tracker.context(slot, threshold), candidate.steps);
    if (!inside && (!candidate.must || candidate.steps == TrackerSteps{})) return;
    must += static_cast<std::uint32_t>(candidate.must);
    *at++ = candidate;
  });
  Part& part = parts_[block.index];
  part.candidates = static_cast<std::uint32_t>(at - (candidates_.data() + block.first));
  part.must = must;
}

void TrackerSearch::rank() {
  order_.clear();
  for (std::uint32_t b = 0; b < parts_.size(); ++b) {
    const std::uint32_t first = b * kBlockSlots;
    for (std::uint32_t i = first; i < first + parts_[b].candidates; ++i) {
      if (candidates_[i].must) order_.push_back(i);
    }
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

bool TrackerSearch::write(Tracker& tracker, std::uint32_t limit, bool early, std::size_t budget) {
  tracker.for_each_block([&](const Block& block) { write_block(tracker, block, limit, early); });
  std::size_t size_bytes = 0;
  bool fits = true;
  for (std::uint32_t b = 0; b < parts_.size(); ++b) {
    fits = fits && parts_[b].fits;
    if (tracker.work_[b].corrected != 0) size_bytes += kHeaderBytes + parts_[b].coded_bytes;
  }
  return fits && size_bytes <= budget;
}

void TrackerSearch::write_block(Tracker& tracker, const Block& block, std::uint32_t limit, bool early) {
  Tracker::Work& work = tracker.work_[block.index];
  Part& part = parts_[block.index];
  Slot* const corrected = tracker.corrected_.data() + block.first;
  TrackerSteps* const steps = tracker.steps_.data() + block.first;
  std::uint32_t count = 0;
  for (std::uint32_t i = block.first; i < block.first + part.candidates; ++i) {
    const Candidate& candidate = candidates_[i];
    if (candidate.must ? candidate.rank >= limit : !early) continue;
    corrected[count] = candidate.slot;
    steps[count++] = candidate.steps;
  }
  work.corrected = count;
  part.coded_bytes = 0;
  part.fits = true;
  if (count == 0) return;
  const std::size_t room = kMostTrackerBytesPerBody * block.slots + kTrackerSlackBytes;
  RangeEncoder flags{std::span<std::byte>(bytes_).subspan(part.first_byte, room)};
  tracker.list_flags(block, tracker.predicted_->alive(), work);
  std::uint32_t next = 0;
  for (Slot slot = block.first; slot < block.first + block.slots; ++slot) {
    const bool bit = next < count && corrected[next] == slot;
    flags.put(bit, tracker.models_.p1[tracker.flags_[slot]]);
    if (!bit) continue;
    work.count_one(tracker.flags_[slot]);
    ++next;
  }
  TrackerEncoder coder{flags, &tracker.models_, &work.counts};
  for (std::uint32_t i = 0; i < count; ++i)
    code_steps(coder, tracker.context(corrected[i], tracker.threshold_), steps[i]);
  part.coded_bytes = coder.range.finish();
  part.fits = !coder.range.overflow();
}

void TrackerSearch::remember_waiting(const Tracker& tracker) {
  some_wait_ = false;
  for (std::uint32_t b = 0; b < parts_.size(); ++b) {
    const Block block = block_at(b, static_cast<std::uint32_t>(waiting_.size()));
    const Slot* sent = tracker.corrected_.data() + block.first;
    const Slot* const sent_end = sent + tracker.work_[b].corrected;
    const Candidate* candidate = candidates_.data() + block.first;
    const Candidate* const end = candidate + parts_[b].candidates;
    for (Slot slot = block.first; slot < block.first + block.slots; ++slot) {
      const bool is_candidate = candidate != end && candidate->slot == slot;
      const bool is_sent = sent != sent_end && *sent == slot;
      const bool waits = is_candidate && candidate->must && !is_sent;
      waiting_[slot] = waits ? static_cast<std::uint8_t>(std::min(waiting_[slot] + 1, 255)) : std::uint8_t{0};
      some_wait_ = some_wait_ || waits;
      candidate += is_candidate ? 1 : 0;
      sent += is_sent ? 1 : 0;
    }
  }
}

}  // namespace tandem
