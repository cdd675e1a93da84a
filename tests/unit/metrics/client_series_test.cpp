#include "services/program/metrics/client_series.hpp"

#include <gtest/gtest.h>

#include <string>

#include "services/gateway/metrics.hpp"

namespace tandem::metrics {
namespace {

ClientStatus playing(std::uint64_t frames) {
  ClientStatus status;
  status.phase = ClientPhase::kPlaying;
  status.server_alive = true;
  status.frames_applied = frames;
  return status;
}

TEST(MetricsClientWatch, FollowsWhileFramesCome) {
  ClientWatch watch;
  EXPECT_NE(watch.obstacle(), nullptr);
  std::int64_t now_ns = 0;
  for (std::uint64_t frames = 0; frames < 300; frames += 30, now_ns += kSecond)
    watch.saw(playing(frames), now_ns);
  EXPECT_EQ(watch.obstacle(), nullptr);
  for (int i = 0; i < 4; ++i, now_ns += kSecond) watch.saw(playing(270), now_ns);
  EXPECT_STREQ(watch.obstacle(), "no frame has come for three seconds");
  watch.saw(playing(300), now_ns);
  EXPECT_EQ(watch.obstacle(), nullptr);
}

TEST(MetricsClientWatch, SaysWhatIsMissing) {
  ClientWatch watch;
  watch.saw({}, 0);
  EXPECT_STREQ(watch.obstacle(), "it looks for the session");
  ClientStatus gone = playing(30);
  gone.server_alive = false;
  watch.saw(gone, kSecond);
  EXPECT_STREQ(watch.obstacle(), "the session's server is gone");
}

// Whatever a server or a viewer says, no text of theirs becomes a label.
TEST(MetricsClient, OnlyTheOperatorsTextIsInALabel) {
  gateway::FiguresNow figures;
  ClientStatus& status = figures.client.status;
  status.reason = status.scene = status.stream = status.stream_reason = "stranger";
  status.client_id = 0x1234567890abcdef;
  status.state_hash = status.client_id;
  Page page;
  gateway::describe(page, "arena", figures);
  EXPECT_GT(page.families().size(), 30U);
  for (const Family& family : page.families()) {
    for (const Sample& sample : family.samples) {
      for (const Label& label : sample.labels) {
        EXPECT_TRUE(label.name == "state" || label.name == "reason" || label.value == "arena") << family.name;
        EXPECT_NE(label.value, "stranger") << family.name;
      }
    }
  }
}

}  // namespace
}  // namespace tandem::metrics
