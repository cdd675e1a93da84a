#include "services/lab/framerate/framerate.hpp"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "services/lab/paper_numbers.hpp"

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
  const auto json = nlohmann::json::parse(to_json(std::vector{row}, "cgroup v2", Calibration{0.02, 4.4}));
  EXPECT_EQ(json["device"]["processor_share"], 0.02);
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
  measure_row(setup, nullptr, row);
  EXPECT_THAT(row.missing, ::testing::HasSubstr("one user"));
  EXPECT_TRUE(nlohmann::json::parse(to_json(std::vector{row}, "", {}))["rows"][0]["updates_per_s"].is_null());
  EXPECT_THAT(to_table(std::vector{row}), ::testing::HasSubstr("not measured: " + row.missing));
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
