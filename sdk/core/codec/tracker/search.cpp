#include "sdk/core/codec/tracker/search.hpp"

#include <algorithm>
#include <bit>

#include "sdk/core/codec/delta.hpp"
#include "sdk/core/codec/errors.hpp"

namespace tandem {
namespace {

// A body within the threshold but beyond this share of it (1/256) goes early if the model half expects it
// anyway: a few more bits, a much smaller RMS error (RESEARCH.md).
constexpr std::int64_t kEarlyShare = 218;
// Bits that an error of one threshold is worth.
constexpr std::uint64_t kErrorWorth = 14;
constexpr std::size_t kHeaderBytes = kSectionHeaderBytes + 2;
// Under a budget: this share of it may stay unused (1/64), and this often what is sent is written; if
// estimates mislead, the last times with half as many bodies.
constexpr std::size_t kSpareShare = 64;
constexpr std::uint32_t kMostWrites = 8, kMostEstimates = 4;
constexpr std::size_t kTooLarge = SIZE_MAX;
// In 1/256 bits: a byte, and a first guess of what a body costs with its share of the flags.
constexpr std::int64_t kByte = std::int64_t{8} << 8U;
constexpr std::int64_t kGuessedCost = std::int64_t{16} << 8U;

// log2(x) in 1/2^fraction bits, x > 0, by repeated squaring: the same with every compiler.
constexpr std::uint32_t log2_of(std::uint32_t x, std::uint32_t fraction) {
  const auto whole = static_cast<std::uint32_t>(std::bit_width(x)) - 1U;
  std::uint64_t mantissa = (std::uint64_t{x} << 32U) >> whole;  // 1 .. 2 in 32.32
  std::uint32_t log = whole << fraction;
  for (std::uint32_t i = 1; i <= fraction; ++i) {
    mantissa = (mantissa >> 2U) * (mantissa >> 2U) >> 28U;
    if (mantissa >= std::uint64_t{2} << 32U) {
      mantissa >>= 1U;
      log |= 1U << (fraction - i);
    }
  }
  return log;
}
// -log2(x / 2^12) in 1/256 bits, x in 0 .. 2^12.
constexpr auto kBits = [] {
  std::array<std::uint16_t, 4096> table{};
  for (std::uint32_t i = 0; i < 4096; ++i)
    table[i] = static_cast<std::uint16_t>((12U << 8U) - log2_of(i == 0 ? 1 : i, 8));
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
  // Where bodies wait, the budget was too small a frame ago and probably still is.
  const bool is_enough = !some_wait_ || budget >= tracker.bound();
  tracker.for_each_block([&](const Block& block) {
    gather(tracker, target, block);
    if (is_enough) choose(tracker, target, block);
  });
  const bool all_fit =
      (is_enough && write(tracker, true) <= budget) || write_most_urgent(tracker, target, budget);
  for (std::uint32_t b = 0; b < parts_.size(); ++b) {
    if (tracker.work_[b].corrected == 0) continue;
    out.put(static_cast<std::uint16_t>(SectionType::kCorrections));
    out.put(static_cast<std::uint32_t>(parts_[b].coded_bytes + 2));
    out.put(static_cast<std::uint16_t>(b));
    out.put_bytes(std::span(bytes_).subspan(parts_[b].first_byte, parts_[b].coded_bytes));
  }
  if (!all_fit || some_wait_) remember_waiting(tracker);
}

void TrackerSearch::gather(Tracker& tracker, const State& target, const Block& block) {
  const State& predicted = *tracker.predicted_;
  const ErrorWorth worth(tracker.threshold_);
  const auto early = static_cast<std::int32_t>((tracker.threshold_ * kEarlyShare) >> 8);
  Candidate* const first = candidates_.data() + block.first;
  Slot* const slots = tracker.corrected_.data() + block.first;
  std::uint32_t count = 0;
  const std::span<std::uint8_t, kBlockSlots> marks(marks_.data() + std::size_t{block.index} * kBlockSlots,
                                                   kBlockSlots);
  for_each_beyond(predicted, target, block, early, marks, [&](Slot slot, std::uint64_t error) {
    const bool must = error > worth.limit;
    if (!must && tracker.models_.p1[tracker.flag_of(slot)] <= tracker.gains_.early()) return;
    slots[count] = slot;
    first[count++] = {error, slot, kNoCost, Candidate::Steps::kOpen, must, false, {}};
  });
  tracker.list_contexts(block, std::span(slots, count));
  parts_[block.index].candidates = count;
}

void TrackerSearch::choose(const Tracker& tracker, const State& target, const ErrorWorth& worth,
                           Candidate& candidate) {
  const Slot slot = candidate.slot;
  const bool inside = choose_steps(position(*tracker.predicted_, slot), position(target, slot),
                                   TrackerSteppings(tracker.threshold_), worth, costs_,
                                   tracker.contexts_.of(slot), candidate.steps);
  const bool is_of_use = inside || (candidate.must && candidate.steps != TrackerSteps{});
  candidate.state = is_of_use ? Candidate::Steps::kFound : Candidate::Steps::kUseless;
}

void TrackerSearch::choose(const Tracker& tracker, const State& target, const Block& block) {
  const ErrorWorth worth(tracker.threshold_);
  Candidate* const first = candidates_.data() + block.first;
  for (std::uint32_t i = 0; i < parts_[block.index].candidates; ++i) {
    if (first[i].state == Candidate::Steps::kOpen) choose(tracker, target, worth, first[i]);
  }
}

bool TrackerSearch::write_most_urgent(Tracker& tracker, const State& target, std::size_t budget) {
  rank(tracker);
  const auto all = static_cast<std::uint32_t>(order_.size());
  bool may_all_fit = some_wait_;  // else they were tried
  const auto try_all = [&] {
    may_all_fit = false;
    tracker.for_each_block([&](const Block& block) { choose(tracker, target, block); });
    return write(tracker, true) <= budget;
  };
  if (all == 0 && may_all_fit && try_all()) return true;
  std::uint32_t fits = 0;
  std::uint32_t too_many = all + 1;
  std::uint32_t written = too_many;
  std::int64_t beyond = kByte;  // what is written over what was estimated
  for (std::uint32_t i = 0; i < kMostWrites && too_many - fits > 1; ++i) {
    std::uint32_t last = too_many - 1;
    if (i >= kMostEstimates) {
      last = fits + (too_many - fits) / 2;
      std::nth_element(order_.begin() + fits, order_.begin() + last, order_.begin() + too_many - 1);
    }
    const Cut cut =
        this->cut(tracker, target, fits, last, static_cast<std::int64_t>(budget) * kByte - beyond);
    if (cut.count == fits) break;
    if (cut.count == all && may_all_fit && try_all()) return true;
    written = cut.count;
    const std::size_t size_bytes = write_first(tracker, written);
    (size_bytes <= budget ? fits : too_many) = written;
    if (size_bytes <= budget && budget - size_bytes <= budget / kSpareShare) break;
    if (size_bytes != kTooLarge)
      beyond = static_cast<std::int64_t>(size_bytes) * kByte - cut.cost + kByte / 2;
  }
  if (written != fits) write_first(tracker, fits);
  return false;
}

void TrackerSearch::rank(Tracker& tracker) {
  tracker.for_each_block([&](const Block& block) {
    Tracker::Work& work = tracker.work_[block.index];
    tracker.list_flags(block, tracker.predicted_->alive(), work);
    // Finer than costs_, because there are so many of them.
    std::uint64_t zeros = 0;
    for (std::uint32_t model = 0; model < TrackerModelIndex::kZero; ++model) {
      if (work.counts[model][0] == 0) continue;
      const std::uint32_t p0 = 65536U - tracker.models_.p1[model];
      zeros += std::uint64_t{work.counts[model][0]} * ((16U << 16U) - log2_of(p0, 16));
    }
    Part& part = parts_[block.index];
    part.cost = static_cast<std::int64_t>(zeros >> 8U) + static_cast<std::int64_t>(kHeaderBytes) * kByte;
    part.sent = 0;
  });
  order_.clear();
  constexpr std::uint64_t kMostError = (std::uint64_t{1} << 48U) - 1;  // so that the product fits
  for (std::uint32_t b = 0; b < parts_.size(); ++b) {
    const std::uint32_t first = b * kBlockSlots;
    for (std::uint32_t i = first; i < first + parts_[b].candidates; ++i) {
      const Candidate& candidate = candidates_[i];
      const std::uint64_t frames = waiting_[candidate.slot] + 1U;
      if (candidate.must) order_.push_back({std::min(candidate.error, kMostError) * frames * frames, i});
    }
  }
}

std::int32_t TrackerSearch::cost(const Tracker& tracker, const Candidate& candidate) const {
  const auto& flag = costs_.of[tracker.flag_of(candidate.slot)];
  CostCoder coder{&costs_};
  TrackerSteps steps = candidate.steps;
  code_steps(coder, tracker.contexts_.of(candidate.slot), steps);
  return static_cast<std::int32_t>(coder.cost) + flag[1] - flag[0];
}

std::int64_t TrackerSearch::add(const Tracker& tracker, const State& target, std::uint32_t first,
                                std::uint32_t last) {
  const ErrorWorth worth(tracker.threshold_);
  std::int64_t sum = 0;
  for (std::uint32_t i = first; i < last; ++i) {
    const std::uint32_t index = order_[i].index;
    Candidate& candidate = candidates_[index];
    if (candidate.state == Candidate::Steps::kOpen) choose(tracker, target, worth, candidate);
    if (candidate.state == Candidate::Steps::kUseless) continue;
    if (candidate.cost == kNoCost) candidate.cost = cost(tracker, candidate);
    Part& part = parts_[index / kBlockSlots];
    sum += candidate.cost + (part.sent++ == 0 ? part.cost : 0);
  }
  return sum;
}

std::int64_t TrackerSearch::remove(std::uint32_t first, std::uint32_t last) {
  std::int64_t sum = 0;
  for (std::uint32_t i = first; i < last; ++i) {
    const std::uint32_t index = order_[i].index;
    const Candidate& candidate = candidates_[index];
    if (candidate.state == Candidate::Steps::kUseless) continue;
    Part& part = parts_[index / kBlockSlots];
    sum += candidate.cost + (--part.sent == 0 ? part.cost : 0);
  }
  return sum;
}

TrackerSearch::Cut TrackerSearch::cut(const Tracker& tracker, const State& target, std::uint32_t first,
                                      std::uint32_t last, std::int64_t most) {
  for (Part& part : parts_) part.sent = 0;
  std::int64_t sum = add(tracker, target, 0, first);
  bool is_limited = false;
  const auto guess = static_cast<std::uint32_t>(std::max<std::int64_t>(most / kGuessedCost, 16));
  while (first < last) {
    const std::uint32_t more = is_limited ? (last - first + 1) / 2 : std::max(first, guess);
    const std::uint32_t tried = first + std::min(more, last - first);
    std::nth_element(order_.begin() + first, order_.begin() + tried - 1, order_.begin() + last);
    const std::int64_t added = add(tracker, target, first, tried);
    if (sum + added <= most || tried == 1) {
      sum += added;
      first = tried;
    } else {
      remove(first, tried);
      last = tried - 1;
      is_limited = true;
    }
  }
  return {first, sum};
}

std::size_t TrackerSearch::write_first(Tracker& tracker, std::uint32_t count) {
  for (std::uint32_t i = 0; i < order_.size(); ++i) candidates_[order_[i].index].is_sent = i < count;
  return write(tracker, false);
}

std::size_t TrackerSearch::write(Tracker& tracker, bool all) {
  tracker.for_each_block([&](const Block& block) { write_block(tracker, block, all); });
  std::size_t size_bytes = 0;
  bool fits = true;
  for (std::uint32_t b = 0; b < parts_.size(); ++b) {
    fits = fits && parts_[b].fits;
    if (tracker.work_[b].corrected != 0) size_bytes += kHeaderBytes + parts_[b].coded_bytes;
  }
  return fits ? size_bytes : kTooLarge;
}

void TrackerSearch::write_block(Tracker& tracker, const Block& block, bool all) {
  Tracker::Work& work = tracker.work_[block.index];
  Part& part = parts_[block.index];
  Slot* const corrected = tracker.corrected_.data() + block.first;
  TrackerSteps* const steps = tracker.steps_.data() + block.first;
  std::uint32_t count = 0;
  for (std::uint32_t i = block.first; i < block.first + part.candidates; ++i) {
    const Candidate& candidate = candidates_[i];
    if (candidate.state != Candidate::Steps::kFound || !(all || candidate.is_sent)) continue;
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
      const bool waits =
          is_candidate && candidate->must && candidate->state != Candidate::Steps::kUseless && !is_sent;
      waiting_[slot] = waits ? static_cast<std::uint8_t>(std::min(waiting_[slot] + 1, 255)) : std::uint8_t{0};
      some_wait_ = some_wait_ || waits;
      candidate += is_candidate ? 1 : 0;
      sent += is_sent ? 1 : 0;
    }
  }
}

}  // namespace tandem
