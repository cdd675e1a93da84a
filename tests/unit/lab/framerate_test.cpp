#include "services/lab/framerate/framerate.hpp"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "services/lab/measures/paper_numbers.hpp"

namespace tandem::lab {
namespace {

TEST(Framerate, RowsHaveTheAgreedFields) {
  FramerateRow row;
  row.scene = "half_pipe";
  row.number = 1;
  row.bodies = 10000;
  row.method = "entropy";
  row.device = "thin";
  row.updates_per_s = 30;
  row.seconds = 6;
  row.client_cpu_ms = 0.5;
  const auto json = nlohmann::json::parse(to_json(
      std::vector{row}, "cgroup v2",
      std::vector{Calibration{.device = "thin", .share = 0.02, .updates_per_s = 4.4, .slowdown = 50}}));
  EXPECT_EQ(json["devices"][0]["processor_share"], 0.02);
  ASSERT_EQ(json["rows"].size(), 1U);
  const auto& only = json["rows"][0];
  EXPECT_EQ(only["scene"], "half_pipe");
  EXPECT_EQ(only["number"], 1);
  EXPECT_EQ(only["users"], 1);
  EXPECT_EQ(only["bodies"], 10000);
  EXPECT_EQ(only["method"], "entropy");
  EXPECT_EQ(only["device"], "thin");
  EXPECT_EQ(only["updates_per_s"], 30);
  EXPECT_EQ(only["seconds"], 6);
  EXPECT_EQ(only["client_cpu_ms"], 0.5);
  EXPECT_EQ(only["paper_updates_per_s"], 77.9);
}

TEST(Framerate, ARowThatCouldNotBeMeasuredSaysWhyAndHasNoNumber) {
  FramerateRow row;
  row.scene = "half_pipe_2";
  row.users = 4;
  row.method = kClientOnly;
  const std::atomic<bool> stop = false;
  FramerateSetup setup;
  setup.stop = &stop;
  measure_row(setup, nullptr, std::nullopt, row);
  EXPECT_THAT(row.missing, ::testing::HasSubstr("one user"));
  EXPECT_TRUE(nlohmann::json::parse(to_json(std::vector{row}, "", {}))["rows"][0]["updates_per_s"].is_null());
  EXPECT_THAT(to_table(std::vector{row}), ::testing::HasSubstr("not measured: " + row.missing));
}

TEST(Framerate, SaysWhatBoundsARow) {
  FramerateRow row;
  row.updates_per_s = 10;
  row.client_cpu_ms = 0.5;
  row.link_mbit_per_s = 1;
  EXPECT_EQ(find_bound(row, 15e6, 0.006, 0.1), "processor");
  EXPECT_EQ(find_bound(row, 15e6, 0.035, 0.1), "round trip");
  EXPECT_EQ(find_bound(row, 15e6, 0.035, 0.95), "server");
  EXPECT_EQ(find_bound(row, 1.1e6, 0.035, 0.95), "link");
  row.dropped = 3;
  EXPECT_EQ(find_bound(row, 15e6, 0.035, 0.1), "link");
  EXPECT_EQ(find_bound(row, 15e6, 0.006, 0.1), "processor") << "whatever was dropped besides";
}

TEST(Framerate, TheThesissDeviceIsSetByItsStep) {
  FramerateRow row;
  row.method = kClientOnly;
  row.bodies = 5000;
  const std::atomic<bool> stop = false;
  FramerateSetup setup;
  setup.stop = &stop;
  measure_row(setup, nullptr, Calibration{.device = "thesis", .share = 0.0352, .step_us = 0.8}, row);
  EXPECT_EQ(row.device, "thesis");
  EXPECT_NEAR(row.updates_per_s, 8.8, 1e-9) << "half as many bodies, twice as often";
}

TEST(Framerate, KnowsThePapersTable) {
  EXPECT_EQ(paper_updates_per_s(1, 10000, "client-only"), 4.4);
  EXPECT_EQ(paper_updates_per_s(5, 10000, "limited"), 25.8);
  EXPECT_EQ(paper_updates_per_s(4, 5000, "client-only"), std::nullopt);
  EXPECT_EQ(paper_updates_per_s(1, 10000, "tracker"), std::nullopt);
  EXPECT_EQ(paper_framerate_users(3), 1U);
  EXPECT_EQ(paper_framerate_users(4), 4U);
  EXPECT_EQ(paper_framerate_users(0), std::nullopt);
}

}  // namespace
}  // namespace tandem::lab
