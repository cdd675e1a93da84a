#include "sdk/core/codec/tracker/steps.hpp"

#include <algorithm>

#include "sdk/core/codec/errors.hpp"
#include "sdk/core/lattice/fixed_point.hpp"

namespace tandem {
namespace {

// A way to correct one group: by no steps, or by one of the points around the missing correction. The error
// is what remains of that group; the errors of both groups add up.
struct Way {
  TrackerPoint point;
  std::uint64_t error = 0;
};
using Ways = std::array<Way, 9>;

class Search {
 public:
  Search(const JointResidual& body, const ErrorWorth& worth, const TrackerCosts& costs)
      : body_(body), worth_(worth), costs_(costs) {}

  void list(const TrackerSteppings& steppings, const TrackerContext& position, const TrackerContext& turn);
  /// Tries all pairs of ways; if `fine`, only those that correct both groups.
  void run(const TrackerTurnContext& context, bool fine);
  [[nodiscard]] bool found() const { return cost_ != UINT64_MAX; }
  [[nodiscard]] const TrackerTurningCorrection& best() const { return found() ? cheapest_ : nearest_; }

 private:
  [[nodiscard]] std::uint64_t error_of_position(const TrackerSteps& steps, std::int64_t unit) const;
  [[nodiscard]] std::uint64_t error_of_turn(const TrackerSteps& steps, std::int64_t angle) const;
  void consider(const Way& position, const Way& turn, std::uint64_t bits, bool fine);

  const JointResidual& body_;
  const ErrorWorth& worth_;
  const TrackerCosts& costs_;
  Ways positions_{}, turns_{};
  std::uint64_t cost_ = UINT64_MAX, error_ = UINT64_MAX;
  TrackerTurningCorrection cheapest_, nearest_;
};

std::uint64_t Search::error_of_position(const TrackerSteps& steps, std::int64_t unit) const {
  BodyState moved = body_.predicted;
  for (std::size_t i = 0; i < 3; ++i) moved.p[i] = limited(moved.p[i] + steps[i] * unit, kPositionLimit);
  moved.q = body_.target.q;
  return surface_error(moved, body_.target, body_.radius);
}

std::uint64_t Search::error_of_turn(const TrackerSteps& steps, std::int64_t angle) const {
  BodyState moved = body_.target;
  const WideSpin by{steps[0] * angle, steps[1] * angle, steps[2] * angle};
  moved.q = rounded(turned_by(body_.predicted.q, by).q, body_.rounding.q);
  return surface_error(moved, body_.target, body_.radius);
}

void Search::list(const TrackerSteppings& steppings, const TrackerContext& position,
                  const TrackerContext& turn) {
  const auto points = points_around(body_.predicted.p, body_.target.p, steppings.unit(0), costs_, position);
  const Spin missing = turn_between(body_.predicted.q, body_.target.q);
  const auto turns = points_around({}, missing, steppings.angle(0, body_.radius), costs_, turn);
  positions_[0] = {{}, error_of_position({}, 0)};
  turns_[0] = {{}, error_of_turn({}, 0)};
  for (std::size_t i = 0; i < points.size(); ++i) {
    positions_[i + 1] = {points[i], error_of_position(points[i].steps, steppings.unit_for(points[i].steps))};
    turns_[i + 1] = {turns[i],
                     error_of_turn(turns[i].steps, steppings.angle_for(turns[i].steps, body_.radius))};
  }
}

void Search::consider(const Way& position, const Way& turn, std::uint64_t bits, bool fine) {
  const std::uint64_t error = position.error + turn.error;
  const TrackerTurningCorrection correction{{position.point.steps, fine, false}, turn.point.steps};
  if (error < error_) {
    error_ = error;
    nearest_ = correction;
  }
  if (error * error > worth_.limit || error > static_cast<std::uint64_t>(worth_.threshold)) return;
  const std::uint64_t cost = bits + position.point.cost + turn.point.cost +
                             (((error * error >> worth_.shift) * worth_.worth) >> 24U);
  if (cost >= cost_) return;
  cost_ = cost;
  cheapest_ = correction;
}

void Search::run(const TrackerTurnContext& context, bool fine) {
  using Index = TrackerModelIndex;
  const auto& both = costs_.of[Index::kBoth + context.choice];
  const auto& which = costs_.of[Index::kWhich + context.choice];
  const std::uint64_t of_both = std::uint64_t{both[1]} + costs_.of[Index::kFine][fine ? 1 : 0];
  for (std::size_t i = 0; i < positions_.size(); ++i) {
    const bool moves = is_some(positions_[i].point.steps);
    for (std::size_t j = 0; j < turns_.size(); ++j) {
      const bool turns = is_some(turns_[j].point.steps);
      // The way with no steps is only at index 0.
      if ((i != 0) != moves || (j != 0) != turns || (fine ? !(moves && turns) : !(moves || turns))) continue;
      const std::uint64_t of_one = std::uint64_t{both[0]} + which[turns ? 1 : 0];
      consider(positions_[i], turns_[j], moves && turns ? of_both : of_one, fine);
    }
  }
}

}  // namespace

bool choose_joint_steps(const JointResidual& body, const ErrorWorth& worth, const TrackerCosts& costs,
                        const TrackerContext& position, const TrackerTurnContext& turn,
                        TrackerTurningCorrection& correction) {
  const bool rest = correction.rest;
  Search search(body, worth, costs);
  for (const bool fine : {false, true}) {
    const auto size = fine ? TrackerSteppings::kFine : TrackerSteppings::kJoint;
    search.list(TrackerSteppings(body.threshold, body.rounding.p, size), position, turn.turn);
    search.run(turn, fine);
    if (search.found()) break;
  }
  correction = search.best();
  correction.rest = rest;
  return search.found();
}

}  // namespace tandem
