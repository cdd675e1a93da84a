#include "services/program/metrics/page.hpp"

#include <utility>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::metrics {

Family& Page::family(std::string_view name, std::string_view help, Kind kind) {
  // Samples of one name mostly come one after the other.
  for (auto known = families_.rbegin(); known != families_.rend(); ++known)
    if (known->name == name) {
      TANDEM_ASSERT(known->kind == kind);
      return *known;
    }
  return families_.emplace_back(
      Family{.name = std::string(name), .help = std::string(help), .kind = kind, .samples = {}});
}

void Page::count(std::string_view name, std::string_view help, double value, Labels labels) {
  family(name, help, Kind::kCount)
      .samples.push_back({.labels = std::move(labels), .value = value, .durations = {}});
}

void Page::gauge(std::string_view name, std::string_view help, double value, Labels labels) {
  family(name, help, Kind::kGauge)
      .samples.push_back({.labels = std::move(labels), .value = value, .durations = {}});
}

void Page::durations(std::string_view name, std::string_view help, const DurationBuckets::Counts& counts,
                     Labels labels) {
  family(name, help, Kind::kDurations)
      .samples.push_back({.labels = std::move(labels), .value = 0, .durations = counts});
}

void Page::state(std::string_view name, std::string_view help, const std::vector<std::string_view>& states,
                 std::size_t holds) {
  TANDEM_ASSERT(holds < states.size());
  for (std::size_t i = 0; i < states.size(); ++i)
    gauge(name, help, i == holds ? 1 : 0, {{"state", std::string(states[i])}});
}

}  // namespace tandem::metrics
