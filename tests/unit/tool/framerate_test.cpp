#include "services/tool/framerate/framerate.hpp"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "services/tool/paper_numbers.hpp"

namespace tandem::tool {
namespace {

constexpr std::int64_t kMs = 1'000'000;

TEST(LinkDirection, PacketsLeaveOneAfterTheOtherAtItsRate) {
  LinkDirection link({.bits_per_s = 8e6, .delay_ns = 5 * kMs, .queue_ns = 50 * kMs});
  EXPECT_EQ(link.offer(0, 1000), 6 * kMs) << "1 ms to leave, 5 ms on its way";
  EXPECT_EQ(link.offer(0, 2000), 8 * kMs) << "waits for the first";
  EXPECT_EQ(link.offer(100 * kMs, 1000), 106 * kMs) << "an idle link saves nothing up";
  EXPECT_EQ(link.bytes(), 4000U);
}

TEST(LinkDirection, DropsWhatWouldWaitTooLongAndNothingElse) {
  LinkDirection link({.bits_per_s = 8e6, .delay_ns = 0, .queue_ns = 50 * kMs});
  int taken = 0;
  while (link.offer(0, 1000)) ++taken;
  EXPECT_EQ(taken, 51) << "the one that leaves, and 50 ms of others";
  EXPECT_EQ(link.dropped(), 1U);
  EXPECT_FALSE(link.offer(0, 1));
  EXPECT_TRUE(link.offer(2 * kMs, 1000)) << "there is room as soon as packets have left";
  EXPECT_EQ(link.dropped(), 2U);
}

TEST(LinkDirection, CarriesItsRateHoweverMuchIsOffered) {
  LinkDirection link({});  // 15e6 bit/s, 50 ms
  for (std::int64_t ms = 0; ms < 10'000; ++ms) {
    for (int i = 0; i < 3; ++i) static_cast<void>(link.offer(ms * kMs, 1400));  // 33.6e6 bit/s
  }
  EXPECT_NEAR(8 * static_cast<double>(link.bytes()) / 10, 15e6, 0.01 * 15e6);
}

TEST(Framerate, RowsHaveTheAgreedFields) {
  FramerateRow row;
  row.scene = "half_pipe";
  row.number = 1;
  row.bodies = 10000;
  row.method = "entropy";
  row.device = "thin";
  row.updates_per_s = 30;
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
}

}  // namespace
}  // namespace tandem::tool
