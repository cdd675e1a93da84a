#pragma once
// The figures of one scrape, before they become text.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "sdk/statistics/duration_buckets.hpp"

namespace tandem::metrics {

/// The values of a label have to come from this program or its operator, never from a client, so that the
/// number of series is bounded.
struct Label {
  std::string_view name;
  std::string value;
};
using Labels = std::vector<Label>;

enum class Kind : std::uint8_t { kCount, kGauge, kDurations };

/// One value, with the labels that tell it from others of its name.
struct Sample {
  Labels labels;
  double value = 0;
  DurationBuckets::Counts durations;  ///< of kDurations, instead of the value
};

/// All samples of one name.
struct Family {
  std::string name;
  std::string help;
  Kind kind = Kind::kGauge;
  std::vector<Sample> samples;
};

/// Collects figures. Names follow Prometheus' conventions: units are seconds, bytes, metres; the name of a
/// count ends with _total. Not thread-safe.
class Page {
 public:
  /// A count since the start.
  void count(std::string_view name, std::string_view help, double value, Labels labels = {});
  /// A state of the moment.
  void gauge(std::string_view name, std::string_view help, double value, Labels labels = {});
  /// Durations; the name ends with _seconds.
  void durations(std::string_view name, std::string_view help, const DurationBuckets::Counts& counts,
                 Labels labels = {});
  /// One of several states: a gauge for each of `states` with the label `state`, 1 for the one that holds.
  void state(std::string_view name, std::string_view help, const std::vector<std::string_view>& states,
             std::size_t holds);

  [[nodiscard]] const std::vector<Family>& families() const { return families_; }

 private:
  Family& family(std::string_view name, std::string_view help, Kind kind);

  std::vector<Family> families_;
};

/// The text format of Prometheus, version 0.0.4. Empty in a build without prometheus-cpp: has_text().
[[nodiscard]] std::string to_text(const Page& page);
/// False in a build without prometheus-cpp.
[[nodiscard]] bool has_text();

}  // namespace tandem::metrics
