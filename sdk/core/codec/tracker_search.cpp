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
  bool code_sign(bool bit, std::uint32_t model) { return code(bit, model); }
  bool code_even(bool bit) { return code(bit, TrackerModelIndex::kEven); }
};

Vec3i position(const State& state, Slot slot) {
  return {state.p(0)[slot], state.p(1)[slot], state.p(2)[slot]};
}

std::int32_t nearest(std::int32_t from, std::int32_t to, std::int32_t step) {
  const auto unit = static_cast<std::uint32_t>(step);
  const std::uint32_t steps = (magnitude(to, from) + unit / 2) / unit;
  const auto q = static_cast<std::int32_t>(std::min<std::uint32_t>(steps, kMostTrackerSteps - 1));
  return to < from ? -q : q;
}

// The two lengths on either side of the residual on each axis, `shorter` and one more; a point is named by a
// bit an axis, x the highest, 1: the longer one. (Third values, on the far side, do not pay: RESEARCH.md.)
class Choices {
 public:
  Choices(const Vec3i& from, const Vec3i& to, std::int32_t unit) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::uint32_t size = magnitude(to[axis], from[axis]);
      const bool is_negative = to[axis] < from[axis];
      // The point of lower values comes first, so on an axis of negative values the interval is open below.
      const std::uint32_t inside = size - static_cast<std::uint32_t>(is_negative);
      const auto one = static_cast<std::uint32_t>(unit);
      std::uint32_t shorter = static_cast<std::uint32_t>(inside >= one);
      if (inside >= 2 * one) shorter = std::min<std::uint32_t>(inside / one, kMostTrackerSteps - 1);
      size_[axis] = size;
      negative_[axis] = static_cast<std::uint32_t>(is_negative);
      shorter_[axis] = shorter;
    }
  }

  /// The cheapest point within the error ball; false: there is none.
  bool cheapest(const TrackerSteppings& steppings, const ErrorWorth& worth, const TrackerCosts& costs,
                const TrackerContext& context, TrackerSteps& steps) const;

 private:
  // In 1/256 bits, [earlier axes that are not zero][longer].
  using AxisCosts = std::array<std::array<std::uint32_t, 2>, 3>;

  [[nodiscard]] std::int32_t value(std::size_t axis, std::uint32_t longer) const {
    const auto length = static_cast<std::int32_t>(shorter_[axis] + longer);
    return negative_[axis] != 0 ? -length : length;
  }
  template <std::uint32_t axis>
  [[nodiscard]] AxisCosts axis_costs(const TrackerCosts& costs, const TrackerContext& context) const;

  std::array<std::uint32_t, 3> size_{}, negative_{}, shorter_{};
};

template <std::uint32_t axis>
Choices::AxisCosts Choices::axis_costs(const TrackerCosts& costs, const TrackerContext& context) const {
  AxisCosts result{};
  const std::uint32_t sign = costs.of[context.sign[axis]][negative_[axis]];
  for (std::uint32_t moved = 0; moved <= axis; ++moved) {
    if (shorter_[axis] > 1) {
      for (std::uint32_t longer = 0; longer < 2; ++longer) {
        std::int32_t steps = value(axis, longer);
        CostCoder coder{&costs};
        code_axis(coder, context, axis, moved, steps);
        result[moved][longer] = coder.cost;
      }
      continue;
    }
    std::array<std::uint16_t, 2> is_moved{0, 0};
    if (axis != 2 || moved != 0) is_moved = costs.of[zero_model(context, axis, moved)];
    const auto* is_longer = &costs.of[magnitude_model(context, moved)];
    const std::uint32_t one = std::uint32_t{is_moved[1]} + sign + is_longer[0][0];
    const std::uint32_t two = std::uint32_t{is_moved[1]} + sign + is_longer[0][1] + is_longer[1][0];
    result[moved] = {shorter_[axis] == 0 ? is_moved[0] : one, shorter_[axis] == 0 ? one : two};
  }
  return result;
}

// All eight are worked out, used or not: almost no branch that is hard to guess. Errors wrap where a point is
// of no use.
bool Choices::cheapest(const TrackerSteppings& steppings, const ErrorWorth& worth, const TrackerCosts& costs,
                       const TrackerContext& context, TrackerSteps& steps) const {
  std::array<std::array<std::uint64_t, 2>, 3> long_error{};  // squared, of the unit of long steps
  std::array<std::array<std::uint64_t, 2>, 3> moved_size{};
  std::array<std::array<std::uint32_t, 2>, 3> is_moved{}, is_long{};
  std::uint64_t from_zero = 0;  // squared
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::uint64_t size = size_[axis];
    from_zero += size * size;
    for (std::uint32_t longer = 0; longer < 2; ++longer) {
      const std::uint32_t length = shorter_[axis] + longer;
      const std::uint64_t off = size - std::min(length * static_cast<std::uint64_t>(steppings.unit(0)),
                                                static_cast<std::uint64_t>(TrackerSteppings::kMostDistance));
      long_error[axis][longer] = off * off;
      is_moved[axis][longer] = static_cast<std::uint32_t>(length != 0);
      moved_size[axis][longer] = length != 0 ? size : 0;
      is_long[axis][longer] = static_cast<std::uint32_t>(length > 1);
    }
  }
  const AxisCosts x_costs = axis_costs<0>(costs, context);
  const AxisCosts y_costs = axis_costs<1>(costs, context);
  const AxisCosts z_costs = axis_costs<2>(costs, context);
  const std::uint64_t lowest = negative_[0] << 2U | negative_[1] << 1U | negative_[2];
  std::uint64_t best = UINT64_MAX;  // cost, then the point; among equals the lowest values
  const auto try_point = [&](std::uint32_t x, std::uint32_t y, std::uint32_t z) {
    const std::uint32_t before_z = is_moved[0][x] + is_moved[1][y];
    const std::uint32_t moved = before_z + is_moved[2][z];
    // Of m steps of one along m axes: the sum of (size - unit)^2 there and size^2 elsewhere.
    const auto unit = static_cast<std::uint64_t>(steppings.unit(moved));
    const std::uint64_t sizes = moved_size[0][x] + moved_size[1][y] + moved_size[2][z];
    const std::uint64_t short_error = from_zero + unit * (moved * unit - 2 * sizes);
    const std::uint64_t error = (is_long[0][x] | is_long[1][y] | is_long[2][z]) != 0
                                    ? long_error[0][x] + long_error[1][y] + long_error[2][z]
                                    : short_error;
    const std::uint64_t cost = std::uint64_t{x_costs[0][x]} + y_costs[is_moved[0][x]][y] +
                               z_costs[before_z][z] + (((error >> worth.shift) * worth.worth) >> 24U);
    const std::uint64_t point = (x << 2U | y << 1U | z) ^ lowest;
    const bool counts = moved != 0 && error <= worth.limit;
    best = std::min(counts ? cost << 3U | point : UINT64_MAX, best);
  };
  // Written out, so that what depends on a point alone is no index any more.
  try_point(0, 0, 0);
  try_point(0, 0, 1);
  try_point(0, 1, 0);
  try_point(0, 1, 1);
  try_point(1, 0, 0);
  try_point(1, 0, 1);
  try_point(1, 1, 0);
  try_point(1, 1, 1);
  if (best == UINT64_MAX) return false;
  const auto point = static_cast<std::uint32_t>((best ^ lowest) & 7U);
  steps = {value(0, point >> 2U), value(1, (point >> 1U) & 1U), value(2, point & 1U)};
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
  if (Choices(from, to, steppings.unit(0)).cheapest(steppings, worth, costs, context, steps)) return true;
  for (std::size_t i = 0; i < 3; ++i) steps[i] = nearest(from[i], to[i], steppings.unit(0));
  return false;
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

void TrackerSearch::choose(Tracker& tracker, const State& target, const Block& block) {
  const State& predicted = *tracker.predicted_;
  const std::int32_t threshold = tracker.threshold_;
  const TrackerSteppings steppings(threshold);
  const ErrorWorth worth(threshold);
  const auto early = static_cast<std::int32_t>((threshold * kEarlyShare) >> 8);
  Candidate* const first = candidates_.data() + block.first;
  Slot* const slots = tracker.corrected_.data() + block.first;
  std::uint32_t considered = 0;
  const std::span<std::uint8_t, kBlockSlots> marks(marks_.data() + std::size_t{block.index} * kBlockSlots,
                                                   kBlockSlots);
  for_each_beyond(predicted, target, block, early, marks, [&](Slot slot, std::uint64_t error) {
    const bool must = error > worth.limit;
    if (!must && tracker.models_.p1[tracker.flag_of(slot)] <= tracker.gains_.early()) return;
    slots[considered] = slot;
    first[considered++] = {error, slot, 0, must, {}};
  });
  tracker.list_contexts(block, std::span(slots, considered));
  Candidate* at = first;
  std::uint32_t must = 0;
  for (std::uint32_t i = 0; i < considered; ++i) {
    Candidate candidate = first[i];
    const Slot slot = candidate.slot;
    const bool inside = choose_steps(position(predicted, slot), position(target, slot), steppings, worth,
                                     costs_, tracker.contexts_.of(slot), candidate.steps);
    if (!inside && (!candidate.must || candidate.steps == TrackerSteps{})) continue;
    must += static_cast<std::uint32_t>(candidate.must);
    *at++ = candidate;
  }
  Part& part = parts_[block.index];
  part.candidates = static_cast<std::uint32_t>(at - first);
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
  // Corrected bodies get a mark beside their models, so that no branch asks which they are.
  constexpr std::uint16_t kMark = 0x8000;
  static_assert(TrackerModelIndex::kAll <= kMark);
  for (std::uint32_t i = 0; i < count; ++i) {
    work.count_one(tracker.flags_[corrected[i]]);
    tracker.flags_[corrected[i]] |= kMark;
  }
  const std::uint16_t* const models = tracker.flags_.data();
  for (Slot slot = block.first; slot < block.first + block.slots; ++slot) {
    const std::uint32_t model = models[slot];
    flags.put(model >= kMark, tracker.models_.p1[model % kMark]);
  }
  TrackerEncoder coder{flags, &tracker.models_, &work.counts};
  for (std::uint32_t i = 0; i < count; ++i) code_steps(coder, tracker.contexts_.of(corrected[i]), steps[i]);
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
