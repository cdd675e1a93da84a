#include "sdk/core/codec/tracker/steps.hpp"

#include "sdk/core/codec/errors.hpp"

namespace tandem {
namespace {

// -log2(x / 2^12) in 1/256 bits, x in 0 .. 2^12.
constexpr auto kBits = [] {
  std::array<std::uint16_t, 4096> table{};
  for (std::uint32_t i = 0; i < 4096; ++i)
    table[i] = static_cast<std::uint16_t>((12U << 8U) - log2_of(i == 0 ? 1 : i, 8));
  return table;
}();

std::int32_t nearest(std::int32_t from, std::int32_t to, std::int32_t step) {
  const auto unit = static_cast<std::uint32_t>(step);
  const std::uint32_t steps = (magnitude(to, from) + unit / 2) / unit;
  const auto q = static_cast<std::int32_t>(std::min<std::uint32_t>(steps, kMaxTrackerSteps - 1));
  return to < from ? -q : q;
}

// The two lengths on either side of the residual on each axis: `shorter` and one more. A point is named by
// one bit per axis, x the highest; 1: the longer one. (Third values, on the far side, do not pay:
// RESEARCH.md.)
class Choices {
 public:
  Choices(const Vec3i& from, const Vec3i& to, std::int32_t unit) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::uint32_t size = magnitude(to[axis], from[axis]);
      const bool is_negative = to[axis] < from[axis];
      // The point with lower values comes first, so on an axis of negative values the interval is open below.
      const std::uint32_t inside = size - static_cast<std::uint32_t>(is_negative);
      const auto one = static_cast<std::uint32_t>(unit);
      std::uint32_t shorter = static_cast<std::uint32_t>(inside >= one);
      if (inside >= 2 * one) shorter = std::min<std::uint32_t>(inside / one, kMaxTrackerSteps - 1);
      size_[axis] = size;
      negative_[axis] = static_cast<std::uint32_t>(is_negative);
      shorter_[axis] = shorter;
    }
  }

  /// Finds the cheapest point within the error ball; returns false if there is none.
  bool cheapest(const TrackerSteppings& steppings, const ErrorWorth& worth, const TrackerCosts& costs,
                const TrackerContext& context, TrackerSteps& steps) const;
  [[nodiscard]] std::array<TrackerPoint, 8> list(const TrackerCosts& costs,
                                                 const TrackerContext& context) const;

 private:
  [[nodiscard]] std::int32_t value(std::size_t axis, std::uint32_t longer) const {
    const auto length = static_cast<std::int32_t>(shorter_[axis] + longer);
    return negative_[axis] != 0 ? -length : length;
  }

  std::array<std::uint32_t, 3> size_{}, negative_{}, shorter_{};
};

// Computes for each point: bits + worth * (error / threshold)^2, in 1/256 bits.
//
// Bits: the axes are coded one after another, and the contexts of an axis depend on how many axes before it
// moved. So the costs of an axis are computed once for each such number (axis_costs), and each point looks
// them up. Error: a point that goes two steps or more along some axis uses the long unit, and the errors of
// the axes add up. Otherwise m axes move by one step of unit(m), and with r the distance on an axis
//   error^2 = sum of r^2 + m unit^2 - 2 unit (sum of r over the axes that move).
//
// All eight are computed, used or not, so that there is almost no branch that is hard to predict. Errors of
// useless points wrap.
bool Choices::cheapest(const TrackerSteppings& steppings, const ErrorWorth& worth, const TrackerCosts& costs,
                       const TrackerContext& context, TrackerSteps& steps) const {
  std::array<std::array<std::uint64_t, 2>, 3> long_error{};  // squared errors with the unit of long steps
  std::array<std::array<std::uint64_t, 2>, 3> moved_size{};
  std::array<std::array<std::uint32_t, 2>, 3> is_moved{}, is_long{};
  std::uint64_t from_zero = 0;  // squared
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::uint64_t size = size_[axis];
    from_zero += size * size;
    for (std::uint32_t longer = 0; longer < 2; ++longer) {
      const std::uint32_t length = shorter_[axis] + longer;
      const std::uint64_t off = size - std::min(length * static_cast<std::uint64_t>(steppings.unit(0)),
                                                static_cast<std::uint64_t>(TrackerSteppings::kMaxDistance));
      long_error[axis][longer] = off * off;
      is_moved[axis][longer] = static_cast<std::uint32_t>(length != 0);
      moved_size[axis][longer] = length != 0 ? size : 0;
      is_long[axis][longer] = static_cast<std::uint32_t>(length > 1);
    }
  }
  const std::array<AxisCosts, 3> of_axis = all_axis_costs(shorter_, negative_, costs, context);
  const std::uint64_t lowest = negative_[0] << 2U | negative_[1] << 1U | negative_[2];
  std::uint64_t best = UINT64_MAX;  // cost, then the point; among equal costs the lowest values win
  const auto try_point = [&](std::uint32_t x, std::uint32_t y, std::uint32_t z) {
    const std::uint32_t before_z = is_moved[0][x] + is_moved[1][y];
    const std::uint32_t moved = before_z + is_moved[2][z];
    // The error of one step along each of m axes: the sum of (size - unit)^2 there and size^2 elsewhere.
    const auto unit = static_cast<std::uint64_t>(steppings.unit(moved));
    const std::uint64_t sizes = moved_size[0][x] + moved_size[1][y] + moved_size[2][z];
    const std::uint64_t short_error = from_zero + unit * (moved * unit - 2 * sizes);
    const std::uint64_t error = (is_long[0][x] | is_long[1][y] | is_long[2][z]) != 0
                                    ? long_error[0][x] + long_error[1][y] + long_error[2][z]
                                    : short_error;
    const std::uint64_t cost = std::uint64_t{of_axis[0][0][x]} + of_axis[1][is_moved[0][x]][y] +
                               of_axis[2][before_z][z] + (((error >> worth.shift) * worth.worth) >> 24U);
    const std::uint64_t point = (x << 2U | y << 1U | z) ^ lowest;
    const bool counts = moved != 0 && error <= worth.limit;
    best = std::min(counts ? cost << 3U | point : UINT64_MAX, best);
  };
  // Written out, so that values that depend only on the point need no index.
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

std::array<TrackerPoint, 8> Choices::list(const TrackerCosts& costs, const TrackerContext& context) const {
  const auto [x_costs, y_costs, z_costs] = all_axis_costs(shorter_, negative_, costs, context);
  std::array<TrackerPoint, 8> points;
  for (std::uint32_t point = 0; point < points.size(); ++point) {
    const std::uint32_t x = point >> 2U;
    const std::uint32_t y = (point >> 1U) & 1U;
    const std::uint32_t z = point & 1U;
    const TrackerSteps steps{value(0, x), value(1, y), value(2, z)};
    const auto moved_x = static_cast<std::uint32_t>(steps[0] != 0);
    const std::uint32_t moved = moved_x + static_cast<std::uint32_t>(steps[1] != 0);
    points[point] = {steps, x_costs[0][x] + y_costs[moved_x][y] + z_costs[moved][z]};
  }
  return points;
}

}  // namespace

std::array<TrackerPoint, 8> points_around(const Vec3i& from, const Vec3i& to, std::int32_t unit,
                                          const TrackerCosts& costs, const TrackerContext& context) {
  return Choices(from, to, unit).list(costs, context);
}

void TrackerCosts::learn(const TrackerModels& models) {
  for (std::size_t i = 0; i < of.size(); ++i) {
    const std::uint32_t p = models.p1[i] >> 4U;
    of[i] = {kBits[4095U - p], kBits[p]};
  }
  static constexpr std::array<std::uint32_t, 2> kGroups{TrackerModelIndex::kSteps,
                                                        TrackerModelIndex::kTurnSteps};
  // The cost of a place in its class.
  const auto of_place = [this](std::uint32_t group, std::uint32_t found, std::uint32_t place) {
    CostCoder coder{this};
    const unsigned bits = tracker_detail::kSizeClasses[found].bits;
    if (bits == 0) return coder.cost;
    coder.code(((place >> (bits - 1U)) & 1U) != 0,
               kGroups[group] + TrackerModelIndex::kPlace - TrackerModelIndex::kShortClasses + found);
    for (unsigned bit = bits - 1U; bit-- > 0;) coder.code_even(((place >> bit) & 1U) != 0);
    return coder.cost;
  };
  std::array<std::uint16_t, tracker_detail::kBeyondClasses> places{};
  for (std::uint32_t row = 0; row < lengths_.size(); ++row) {
    const std::uint32_t group = row / kContexts;
    const std::uint32_t base =
        kGroups[group] + TrackerModelIndex::kMagnitude + row % kContexts * TrackerModelIndex::kClasses;
    std::uint32_t longer = 0;  // the cost of all decisions that it is longer
    for (std::uint32_t found = 0; found < TrackerModelIndex::kClasses; ++found) {
      const auto [first, bits] = tracker_detail::kSizeClasses[found];
      const std::uint32_t of_class = longer + of[base + found][0];
      for (std::uint32_t place = 0; place < (1U << bits); ++place) {
        std::uint16_t& of_the_place = places[first + place];
        if (row % kContexts == 0) of_the_place = static_cast<std::uint16_t>(of_place(group, found, place));
        lengths_[row][first + place] = static_cast<std::uint16_t>(of_class + of_the_place);
      }
      longer += of[base + found][1];
    }
    beyond_[row] = longer;
  }
}

std::uint32_t TrackerCosts::beyond(const TrackerContext& context, std::uint32_t length) const {
  CostCoder coder{this};
  std::uint32_t beyond = length - tracker_detail::kBeyondClasses;
  tracker_detail::code_escape(coder, context.steps + TrackerModelIndex::kEscape, beyond);
  return coder.cost;
}

ErrorWorth::ErrorWorth(std::int32_t e, std::uint64_t bits)
    : threshold(e),
      limit(static_cast<std::uint64_t>(e) * static_cast<std::uint64_t>(e)),
      shift(static_cast<unsigned>(std::max(0, static_cast<int>(std::bit_width(limit)) - 24))),
      worth((bits * 256U << 24U) / (limit >> shift)) {}

bool choose_steps(const Vec3i& from, const Vec3i& to, const TrackerSteppings& steppings,
                  const ErrorWorth& worth, const TrackerCosts& costs, const TrackerContext& context,
                  TrackerSteps& steps) {
  if (Choices(from, to, steppings.unit(0)).cheapest(steppings, worth, costs, context, steps)) return true;
  for (std::size_t i = 0; i < 3; ++i) steps[i] = nearest(from[i], to[i], steppings.unit(0));
  return false;
}

}  // namespace tandem
