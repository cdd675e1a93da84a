#include "services/program/metrics/page.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <string>

#include "services/program/metrics/figure_series.hpp"
#include "services/program/metrics/process_series.hpp"
#include "services/program/metrics/reasons.hpp"

namespace tandem::metrics {
namespace {

using testing::HasSubstr;

TEST(MetricsPage, SamplesOfOneNameAreOneFamily) {
  Page page;
  page.count("a_total", "A", 1, {{"stream", "thin"}});
  page.gauge("b", "B", 2);
  page.count("a_total", "A", 3, {{"stream", "rich"}});
  ASSERT_EQ(page.families().size(), 2U);
  EXPECT_EQ(page.families()[0].samples.size(), 2U);
}

TEST(MetricsPage, OneOfTheStatesHolds) {
  Page page;
  page.state("s", "S", {"off", "on"}, 1);
  ASSERT_EQ(page.families()[0].samples.size(), 2U);
  EXPECT_EQ(page.families()[0].samples[0].value, 0);
  EXPECT_EQ(page.families()[0].samples[1].value, 1);
  EXPECT_EQ(page.families()[0].samples[1].labels[0].value, "on");
}

TEST(MetricsBuckets, CountWhatIsAtMostTheirBound) {
  DurationBuckets buckets;
  DurationBuckets::Counts plain;
  for (const std::int64_t ns : {-1L, 0L, 100'000L, 100'001L, 5'000'000'000L}) {
    buckets.add(ns);
    plain.add(ns);
  }
  const auto counts = buckets.counts();
  EXPECT_EQ(counts.in, plain.in);
  EXPECT_EQ(counts.sum_ns, plain.sum_ns);
  EXPECT_EQ(counts.in.front(), 3U);
  EXPECT_EQ(counts.in[1], 1U);
  EXPECT_EQ(counts.in.back(), 1U);
  EXPECT_EQ(counts.total(), 5U);
  EXPECT_EQ(counts.sum_ns, 5'000'200'001);
}

TEST(MetricsFigures, NamesHaveBaseUnits) {
  EXPECT_EQ(series_of("tandem_", "stalls", true).name, "tandem_stalls_total");
  EXPECT_EQ(series_of("tandem_", "reply_bytes", true).name, "tandem_reply_bytes_total");
  EXPECT_EQ(series_of("tandem_", "suspended_ms", true).name, "tandem_suspended_seconds_total");
  EXPECT_EQ(series_of("tandem_", "suspended_ms", true).scale, 1e-3);
  EXPECT_EQ(series_of("tandem_client_", "latency_ms_p99", false).name, "tandem_client_latency_p99_seconds");
  EXPECT_EQ(series_of("tandem_client_", "join_ms", false).name, "tandem_client_join_seconds");
  EXPECT_EQ(series_of("tandem_client_", "mbit_per_s", false).name, "tandem_client_payload_bytes_per_second");
  EXPECT_EQ(series_of("tandem_client_", "mbit_per_s", false).scale, 131072);
}

TEST(MetricsFigures, EachFigureOfAClientHasASeriesOfItsOwn) {
  Page page;
  describe(page, ClientFigures{});
  std::size_t figures = 0;
  const ClientFigures of;
  each_client_figure([&figures](const char*, auto) { ++figures; }, of);
  std::set<std::string> names;
  for (const Family& family : page.families()) names.insert(family.name);
  EXPECT_EQ(names.size(), figures);
  EXPECT_TRUE(names.contains("tandem_client_hash_mismatches_total"));
  EXPECT_TRUE(names.contains("tandem_client_resyncs_total"));
}

TEST(MetricsReasons, EachReasonHasALabelOfItsOwn) {
  std::set<std::string_view> labels;
  for (std::size_t i = 0; i < transport::kReasons; ++i)
    labels.insert(reason_label(static_cast<transport::Reason>(i)));
  EXPECT_EQ(labels.size(), transport::kReasons);
  EXPECT_FALSE(labels.contains("other"));
  EXPECT_EQ(reason_label(static_cast<transport::Reason>(transport::kReasons)), "other");
}

TEST(MetricsProcess, HasTheUsualSeries) {
  Page page;
  describe_process(page);
  for (const Family& family : page.families()) {
    const bool ours = family.name == "tandem_heap_bytes";
    EXPECT_TRUE(ours || family.name.starts_with("process_")) << family.name;
    EXPECT_GT(family.samples[0].value, 0) << family.name;
  }
  EXPECT_EQ(page.families().size(), 6U);
}

#ifdef TANDEM_PROMETHEUS
TEST(MetricsText, IsThatOfPrometheus) {
  Page page;
  page.count("a_total", "Things", 3, {{"stream", "th\"i\nn"}});
  page.gauge("b_meters", "Length", 0.25);
  DurationBuckets::Counts took;
  took.add(150'000);
  took.add(2'000'000'000);
  page.durations("c_seconds", "Time", took);
  const std::string text = to_text(page);
  EXPECT_THAT(text, HasSubstr("# HELP a_total Things\n# TYPE a_total counter\n"));
  EXPECT_THAT(text, HasSubstr("a_total{stream=\"th\\\"i\\nn\"} 3\n"));
  EXPECT_THAT(text, HasSubstr("# TYPE b_meters gauge\nb_meters 0.25\n"));
  EXPECT_THAT(text, HasSubstr("# TYPE c_seconds histogram\n"));
  EXPECT_THAT(text, HasSubstr("c_seconds_bucket{le=\"0.0001\"} 0\n"));
  EXPECT_THAT(text, HasSubstr("c_seconds_bucket{le=\"0.0002\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("c_seconds_bucket{le=\"0.075\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("c_seconds_bucket{le=\"+Inf\"} 2\n"));
  EXPECT_THAT(text, HasSubstr("c_seconds_count 2\n"));
  EXPECT_THAT(text, HasSubstr("c_seconds_sum 2.00015\n"));
}
#endif

}  // namespace
}  // namespace tandem::metrics
