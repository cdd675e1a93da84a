// The only file that knows prometheus-cpp.
#include <prometheus/metric_family.h>
#include <prometheus/text_serializer.h>

#include <limits>
#include <sstream>

#include "services/program/metrics/page.hpp"

namespace tandem::metrics {
namespace {

prometheus::ClientMetric::Histogram histogram_of(const DurationBuckets::Counts& counts) {
  prometheus::ClientMetric::Histogram out;
  std::uint64_t below = 0;
  for (std::size_t i = 0; i < counts.in.size(); ++i) {
    below += counts.in[i];
    const double bound_s = i < DurationBuckets::kBoundsNs.size()
                               ? static_cast<double>(DurationBuckets::kBoundsNs[i]) / 1e9
                               : std::numeric_limits<double>::infinity();
    out.bucket.push_back({.cumulative_count = below, .upper_bound = bound_s});
  }
  out.sample_count = below;
  out.sample_sum = static_cast<double>(counts.sum_ns) / 1e9;
  return out;
}

prometheus::ClientMetric metric_of(const Sample& sample, Kind kind) {
  prometheus::ClientMetric metric;
  for (const Label& label : sample.labels) metric.label.push_back({std::string(label.name), label.value});
  switch (kind) {
    case Kind::kCount:
      metric.counter.value = sample.value;
      break;
    case Kind::kGauge:
      metric.gauge.value = sample.value;
      break;
    case Kind::kDurations:
      metric.histogram = histogram_of(sample.durations);
      break;
  }
  return metric;
}

prometheus::MetricType type_of(Kind kind) {
  if (kind == Kind::kDurations) return prometheus::MetricType::Histogram;
  return kind == Kind::kCount ? prometheus::MetricType::Counter : prometheus::MetricType::Gauge;
}

}  // namespace

bool has_text() { return true; }

std::string to_text(const Page& page) {
  std::vector<prometheus::MetricFamily> families;
  families.reserve(page.families().size());
  for (const Family& family : page.families()) {
    auto& out = families.emplace_back();
    out.name = family.name;
    out.help = family.help;
    out.type = type_of(family.kind);
    out.metric.reserve(family.samples.size());
    for (const Sample& sample : family.samples) out.metric.push_back(metric_of(sample, family.kind));
  }
  std::ostringstream text;
  prometheus::TextSerializer().Serialize(text, families);
  return std::move(text).str();
}

}  // namespace tandem::metrics
