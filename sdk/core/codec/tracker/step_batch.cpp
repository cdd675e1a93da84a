#include "sdk/core/codec/tracker/step_batch.hpp"

#include <algorithm>
#include <cstring>

#include "sdk/core/lattice/vector_clones.hpp"

namespace tandem {
namespace {

// Thresholds for which all numbers fit 32 bits: a point that is tried is off by less than two thresholds
// along an axis. The worth of an error, see weighed(), must have fewer than 20 bits.
constexpr std::int64_t kMaxThreshold = 1 << 14;
constexpr std::uint64_t kMaxWorth = 1 << 20;
constexpr std::uint32_t kFar = 1U << 30U;  // a larger residual may reach the end of the lattice

// Eight bodies at once. Compilers translate it for any processor.
using Eight = std::uint32_t __attribute__((vector_size(32)));
using EightWide = std::uint64_t __attribute__((vector_size(64)));
constexpr std::uint32_t kLanes = sizeof(Eight) / sizeof(std::uint32_t);
static_assert(StepBatch::kMaxBodies % kLanes == 0);

// Everything here is inlined always, because each copy of a caller for a processor needs its own.
[[gnu::always_inline]] inline void load(const std::uint32_t* from, Eight& to) {
  std::memcpy(&to, from, sizeof to);
}
[[gnu::always_inline]] inline void store(const Eight& from, std::uint32_t* to) {
  std::memcpy(to, &from, sizeof from);
}

struct Columns {
  const std::uint32_t* from;
  const std::uint32_t* to;
  std::uint32_t* size;
  std::uint32_t* negative;
  std::uint32_t* shorter;
};

TANDEM_VECTOR_CLONES void measure_axis(const Columns& axis, std::uint32_t unit, std::uint32_t* is_far) {
  using Signed = std::int32_t __attribute__((vector_size(32)));
  const std::uint64_t inverse = (std::uint64_t{1} << 32U) / unit;
  for (std::uint32_t i = 0; i < StepBatch::kMaxBodies; i += kLanes) {
    Eight from, to, far;
    load(axis.from + i, from);
    load(axis.to + i, to);
    load(is_far + i, far);
    const Eight off = to - from;
    // All bits are one where the steps are negative.
    const auto negative =
        reinterpret_cast<Eight>(reinterpret_cast<Signed>(to) < reinterpret_cast<Signed>(from));
    const Eight size = (off ^ negative) - negative;
    // The point with lower values comes first, so on an axis of negative values the interval is open below.
    const Eight inside = size + negative;
    // The product with the inverse is the quotient or one less.
    const EightWide product = __builtin_convertvector(inside, EightWide) * inverse >> 32U;
    const Eight guess = __builtin_convertvector(product, Eight);
    store(size, axis.size + i);
    store(negative & 1U, axis.negative + i);
    store(guess - reinterpret_cast<Eight>(inside - guess * unit >= unit), axis.shorter + i);
    store(far | reinterpret_cast<Eight>(size > kFar), is_far + i);
  }
}

struct Constants {
  std::array<std::uint32_t, 4> units{};
  std::uint32_t limit = 0;
  std::uint32_t shift = 0;
};

// As Choices::cheapest() in steps.cpp, where the formulas are derived. Masks have all bits 0 or 1.
// NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): written before it is read
struct Search {
  struct Axis {
    Eight size, shorter, is_moved;
    std::array<Eight, 2> long_error, is_long;  // by the longer length
  };

  [[gnu::always_inline]] void load_axis(const std::uint32_t* size, const std::uint32_t* shorter,
                                        const Constants& constants, Axis& axis) {
    load(size, axis.size);
    load(shorter, axis.shorter);
    axis.is_moved = reinterpret_cast<Eight>(axis.shorter != 0U);
    const Eight off = axis.size - axis.shorter * constants.units[0];
    const Eight rest = off - constants.units[0];
    axis.long_error = {off * off, rest * rest};
    axis.is_long = {reinterpret_cast<Eight>(axis.shorter > 1U), axis.is_moved};
    from_zero += axis.size * axis.size;
  }

  template <std::uint32_t point>
  [[gnu::always_inline]] void try_point(const std::uint32_t* xy_cost, const std::uint32_t* z_cost,
                                        const Constants& constants) {
    constexpr std::uint32_t kX = point >> 2U, kY = (point >> 1U) & 1U, kZ = point & 1U;
    Eight none = {};
    // Minus the number of axes that move.
    Eight moved = none - (kX + kY + kZ);
    Eight sizes = none;
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      const bool longer = ((point >> (2U - axis)) & 1U) != 0;
      if (!longer) moved += axes[axis].is_moved;
      sizes += longer ? axes[axis].size : axes[axis].size & axes[axis].is_moved;
    }
    moved = none - moved;
    const Eight unit = moved == 1U   ? none + constants.units[1]
                       : moved == 2U ? none + constants.units[2]
                                     : none + constants.units[3];
    const Eight short_error = from_zero + unit * (moved * unit - (sizes + sizes));
    const Eight long_way = axes[0].is_long[kX] | axes[1].is_long[kY] | axes[2].is_long[kZ];
    const Eight long_error = axes[0].long_error[kX] + axes[1].long_error[kY] + axes[2].long_error[kZ];
    const Eight error = (long_error & long_way) | (short_error & ~long_way);
    // (x * worth) >> 24 without a product of 64 bits: x has at most 24 bits if the point counts, and x *
    // worth at most 38.
    const Eight x = error >> constants.shift;
    const Eight weighed = ((x >> 12U) * worth + ((x & 4095U) * worth >> 12U)) >> 12U;
    Eight xy, z;
    load(xy_cost, xy);
    load(z_cost, z);
    const Eight key = (xy + z + weighed) << 3U | (lowest ^ point);
    const Eight useless =
        reinterpret_cast<Eight>(error > constants.limit) | reinterpret_cast<Eight>(moved == 0U);
    const Eight rated = key | useless;
    best = rated < best ? rated : best;
  }

  std::array<Axis, 3> axes;
  Eight from_zero = {}, worth, lowest;
  Eight best = ~Eight{};
};

struct Bodies {
  std::array<const std::uint32_t*, 3> size, negative, shorter;
  std::array<const std::uint32_t*, 4> xy_cost;
  std::array<const std::uint32_t*, 8> z_cost;
  const std::uint32_t* worth;
  std::uint32_t* best;
  std::array<std::uint32_t*, 3> steps;
};

TANDEM_VECTOR_CLONES void search_all(const Bodies& bodies, const Constants& constants) {
  for (std::uint32_t i = 0; i < StepBatch::kMaxBodies; i += kLanes) {
    Search search;
    std::array<Eight, 3> negative{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      search.load_axis(bodies.size[axis] + i, bodies.shorter[axis] + i, constants, search.axes[axis]);
      load(bodies.negative[axis] + i, negative[axis]);
    }
    search.lowest = negative[0] << 2U | negative[1] << 1U | negative[2];
    load(bodies.worth + i, search.worth);
    const auto try_point = [&]<std::uint32_t point>() __attribute__((always_inline)) {
      search.try_point<point>(bodies.xy_cost[point >> 1U] + i, bodies.z_cost[point] + i, constants);
    };
    try_point.template operator()<0>();
    try_point.template operator()<1>();
    try_point.template operator()<2>();
    try_point.template operator()<3>();
    try_point.template operator()<4>();
    try_point.template operator()<5>();
    try_point.template operator()<6>();
    try_point.template operator()<7>();
    store(search.best, bodies.best + i);
    const Eight point = search.best ^ search.lowest;
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      const Eight length = search.axes[axis].shorter + ((point >> (2U - axis)) & 1U);
      const Eight sign = Eight{} - negative[axis];
      store((length ^ sign) - sign, bodies.steps[axis] + i);
    }
  }
}

}  // namespace

StepBatch::StepBatch(const TrackerSteppings& steppings, const ErrorWorth& moving, const ErrorWorth& at_rest,
                     const TrackerCosts& costs)
    : steppings_(steppings),
      moving_(moving),
      at_rest_(at_rest),
      costs_(costs),
      // Rounding may make a unit longer than the threshold.
      fits_(moving.threshold <= kMaxThreshold && moving.worth < kMaxWorth && at_rest.worth < kMaxWorth &&
            steppings.unit(0) <= moving.threshold && steppings.unit(0) > 1) {}

void StepBatch::add(const Vec3i& from, const Vec3i& to, bool rest) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    from_[axis][count_] = static_cast<std::uint32_t>(from[axis]);
    to_[axis][count_] = static_cast<std::uint32_t>(to[axis]);
  }
  worth_[count_] = static_cast<std::uint32_t>((rest ? at_rest_ : moving_).worth);
  is_at_rest_[count_] = rest;
  ++count_;
}

void StepBatch::measure() {
  is_far_ = {};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    measure_axis({from_[axis].data(), to_[axis].data(), size_[axis].data(), negative_[axis].data(),
                  shorter_[axis].data()},
                 static_cast<std::uint32_t>(steppings_.unit(0)), is_far_.data());
  }
}

// The costs of an axis depend on how many axes before it move. With the longer length an axis does.
void StepBatch::price(std::uint32_t i, const TrackerContext& context) {
  const std::array<std::uint32_t, 2> x_moves{shorter_[0][i] != 0 ? 1U : 0U, 1};
  const std::array<std::uint32_t, 2> y_moves{shorter_[1][i] != 0 ? 1U : 0U, 1};
  const auto [x_costs, y_costs, z_costs] =
      all_axis_costs({shorter_[0][i], shorter_[1][i], shorter_[2][i]},
                     {negative_[0][i], negative_[1][i], negative_[2][i]}, costs_, context);
  for (std::uint32_t xy = 0; xy < 4; ++xy) {
    const std::uint32_t x = xy >> 1U, y = xy & 1U;
    xy_cost_[xy][i] = x_costs[0][x] + y_costs[x_moves[x]][y];
    for (std::uint32_t z = 0; z < 2; ++z) z_cost_[2 * xy + z][i] = z_costs[x_moves[x] + y_moves[y]][z];
  }
}

void StepBatch::search() {
  Constants constants{{}, static_cast<std::uint32_t>(moving_.limit), moving_.shift};
  for (std::size_t moved = 0; moved < 4; ++moved)
    constants.units[moved] = static_cast<std::uint32_t>(steppings_.unit(moved));
  Bodies bodies{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    bodies.size[axis] = size_[axis].data();
    bodies.negative[axis] = negative_[axis].data();
    bodies.shorter[axis] = shorter_[axis].data();
    bodies.steps[axis] = steps_[axis].data();
  }
  for (std::size_t xy = 0; xy < xy_cost_.size(); ++xy) bodies.xy_cost[xy] = xy_cost_[xy].data();
  for (std::size_t point = 0; point < z_cost_.size(); ++point) bodies.z_cost[point] = z_cost_[point].data();
  bodies.worth = worth_.data();
  bodies.best = best_.data();
  search_all(bodies, constants);
}

void StepBatch::choose_alone(std::uint32_t i, const TrackerContext& context) {
  Vec3i from{}, to{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    from[axis] = static_cast<std::int32_t>(from_[axis][i]);
    to[axis] = static_cast<std::int32_t>(to_[axis][i]);
  }
  TrackerSteps steps{};
  const bool inside =
      choose_steps(from, to, steppings_, is_at_rest_[i] ? at_rest_ : moving_, costs_, context, steps);
  best_[i] = inside ? 0 : kNone;
  for (std::size_t axis = 0; axis < 3; ++axis) steps_[axis][i] = static_cast<std::uint32_t>(steps[axis]);
}

}  // namespace tandem
