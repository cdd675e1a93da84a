#include "sdk/client/drawing/uncorrected.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/tables/predictor_table.hpp"

namespace tandem::client {

Uncorrected::Uncorrected(const Layout& layout, const ClientTimeline& timeline)
    : state_(timeline.state(timeline.applied())), parameters_(timeline.parameters().step) {
  auto made = make_predictor(layout.predictor, layout.capacity, layout.predictor_constants);
  TANDEM_ASSERT(made.has_value());  // the timeline has made the same one
  predictor_ = std::move(*made);
}

void Uncorrected::on_applied(const ClientTimeline& timeline) {
  TANDEM_ASSERT(state_.capacity() == timeline.state(timeline.applied()).capacity());
  predictor_->step(state_, state_, {timeline.drive(), parameters_});
  ++drift_.frames;
  measure(timeline.state(timeline.applied()));
}

void Uncorrected::measure(const State& agreed) {
  drift_.bodies = 0;
  double sum = 0, most = 0;
  for (Slot slot = 0; slot < state_.capacity(); ++slot) {
    const bool in_both = state_.alive()[slot] != 0 && agreed.alive()[slot] != 0 &&
                         state_.reuse()[slot] == agreed.reuse()[slot];
    if (!in_both) continue;
    double squared = 0;
    for (std::size_t channel = 0; channel < kPositionChannels; ++channel) {
      const double d = static_cast<double>(state_.p(channel)[slot]) - agreed.p(channel)[slot];
      squared += d * d;
    }
    const double distance = std::sqrt(squared);
    sum += distance;
    most = std::max(most, distance);
    ++drift_.bodies;
  }
  drift_.mean = drift_.bodies > 0 ? sum / drift_.bodies : 0;
  drift_.most = most;
}

}  // namespace tandem::client
