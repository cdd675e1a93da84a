// Tests a host that begins a step before the frame before it is encoded.
#include <gtest/gtest.h>

#include "sdk/core/timeline/timeline.hpp"
#include "services/host/checkpoint/writer.hpp"
#include "tests/unit/host/fakes.hpp"

namespace tandem::host {
namespace {

HostConfig with_pipeline(std::uint32_t delay_ms = 0) {
  HostConfig config = test_config();
  config.streams[0].delay_ms = delay_ms;
  config.pipeline = true;
  config.window = 2;
  return config;
}

// A step takes `step_ms` of the bench's clock; a period is 33 ms. A client acknowledges `lag` frames late.
class PipelineTest : public ::testing::Test {
 protected:
  explicit PipelineTest(std::uint32_t delay_ms = 0) : bench(with_pipeline(delay_ms)) {
    bench.simulation.ready = [this] {
      if (began_ns < 0) began_ns = bench.now;
      if (bench.now - began_ns < step_ms * kMillisecond) return false;
      began_ns = -1;
      return true;
    };
    bench.simulation.on_step = [this](std::uint64_t step) {
      bench.simulation.position[0][0] = 0.25F * static_cast<float>(step);
    };
    bench.poll();
    bench.run_ms(100);
    bench.enter(1);
    bench.on_ms = [this] {
      if (bench.host->frame() >= lag) bench.playing(1, bench.host->frame() - lag);
      most_ahead = std::max(most_ahead, bench.host->frame() + (bench.simulation.begun ? 1 : 0));
    };
  }
  // The last frame of the journal is the last one that clients are told.
  void hand_over(int after_ms) {
    step_ms = 40;
    transport::StandbyMessage standby;
    standby.standby = 7;
    standby.epoch = bench.host->session().epoch;
    standby.rank = 1;
    bench.on_ms = [&, before = bench.on_ms] {
      before();
      auto checkpoint = std::make_shared<checkpoint::Encoded>();
      checkpoint->moment = {standby.epoch, bench.host->frame()};
      checkpoint->bytes.resize(10);
      bench.host->offer_checkpoint(checkpoint);
      standby.holds_frame = bench.host->frame();
      bench.port.standbys.push_back({standby, participant(9)});
    };
    bench.run_ms(after_ms);
    ASSERT_TRUE(bench.host->frame_under_way());
    transport::CommandMessage command;
    command.session = bench.host->session().session;
    command.epoch = standby.epoch;
    command.kind = transport::CommandKind::kHandOver;
    command.request = 1;
    bench.port.commands.push_back({command, participant(9)});
    bench.run_ms(200);
    const auto last = std::ranges::find(bench.port.journal, transport::JournalState::kLast,
                                        &transport::JournalMessage::state);
    ASSERT_NE(last, bench.port.journal.end());
    EXPECT_EQ(last + 1, bench.port.journal.end());
    EXPECT_EQ(bench.port.deltas.back().frame, last->frame);
    EXPECT_FALSE(bench.host->frame_under_way());
  }
  // Polls until a frame is made.
  void run_frame() {
    const Frame before = bench.host->frame();
    while (bench.host->frame() == before) bench.run_ms(1);
  }
  Frame run_for_a_second() {
    const Frame before = bench.host->frame();
    bench.run_ms(1000);
    return bench.host->frame() - before;
  }
  [[nodiscard]] std::vector<std::uint64_t> steps_of(engine::InputKind kind) const {
    std::vector<std::uint64_t> steps;
    for (const auto& [step, input] : bench.simulation.applied)
      if (input.kind == static_cast<std::uint32_t>(kind)) steps.push_back(step);
    return steps;
  }

  Bench bench;
  std::int64_t step_ms = 0, began_ns = -1;
  Frame lag = 0, most_ahead = 0;
};

TEST_F(PipelineTest, AStepLongerThanAPeriodIsFollowedByTheNextWithinThePollThatMakesItsFrame) {
  step_ms = 40;
  run_frame();
  run_frame();
  for (int i = 0; i < 20; ++i) {
    run_frame();
    ASSERT_TRUE(bench.host->frame_under_way()) << i;
  }
}

TEST_F(PipelineTest, AStepShorterThanAPeriodWaitsForItsTurn) {
  step_ms = 20;
  bench.run_ms(100);
  for (int i = 0; i < 20; ++i) {
    run_frame();
    ASSERT_FALSE(bench.host->frame_under_way()) << i;
  }
  EXPECT_NEAR(static_cast<double>(run_for_a_second()), 30, 1);
}

TEST_F(PipelineTest, NoStepBeginsBeyondTheWindowOfAParticipant) {
  step_ms = 40;
  run_frame();
  lag = 1;  // frame f is applied when delta f + 1 is made, so step f + 2 may begin
  run_for_a_second();
  bench.on_ms = [this] { bench.playing(1, 30); };  // it stands still
  while (bench.host->frame() < 32) bench.run_ms(1);
  bench.run_ms(100);
  EXPECT_EQ(bench.host->frame(), 32U);
  EXPECT_FALSE(bench.host->frame_under_way()) << "step 33 begins once frame 31 is applied";
}

TEST_F(PipelineTest, AClientPlaysWhatInputsDoWhileStepsOverlap) {
  step_ms = 40;
  bench.joining(2);
  bench.run_ms(200);
  ASSERT_FALSE(bench.port.snapshots.empty());
  const transport::SnapshotMessage snapshot = bench.port.snapshots.back();
  ASSERT_TRUE(bench.host->frame_under_way());
  const Frame s = bench.host->frame() + 2;  // the first whose step has not begun
  bench.send(bench.push(1, 1));
  bench.send(bench.gravity(1, 2));
  bench.run_ms(200);
  ASSERT_TRUE(bench.outcome(1, 1) && bench.outcome(1, 2));
  const Frame lead = bench.host->session().lead;
  EXPECT_EQ(bench.outcome(1, 1)->frame, s);
  EXPECT_EQ(bench.outcome(1, 2)->frame, s + lead);
  EXPECT_EQ(steps_of(engine::InputKind::kPush), std::vector<std::uint64_t>{s});
  EXPECT_EQ(steps_of(engine::InputKind::kGravity), std::vector<std::uint64_t>{s + lead});

  ClientTimeline client = std::move(*ClientTimeline::create(bench.host->session().streams[0].layout));
  ASSERT_TRUE(client.load(snapshot.bytes, bench.host->session().epoch, snapshot.stream));
  ASSERT_EQ(bench.port.scheduled.size(), 1U);
  const transport::ScheduledInputMessage& input = bench.port.scheduled[0];
  const Drive drive{
      .gravity = {static_cast<std::int32_t>(input.values[0]), static_cast<std::int32_t>(input.values[1]),
                  static_cast<std::int32_t>(input.values[2])},
      .damping = static_cast<std::uint16_t>(input.values[3])};
  ASSERT_TRUE(client.schedule({.number = input.number, .frame = input.frame, .drive = drive}));
  for (const transport::DeltaMessage& delta : bench.port.deltas) {
    if (delta.frame <= snapshot.frame) continue;
    const auto applied = client.apply(delta.frame, delta.last_input, delta.hash, delta.payload);
    ASSERT_TRUE(applied) << applied.error().message;
  }
  EXPECT_EQ(client.applied(), bench.host->frame());
}

TEST_F(PipelineTest, ARestLeavesAMomentForACheckpoint) {
  step_ms = 40;
  bench.run_ms(200);
  ASSERT_TRUE(bench.host->frame_under_way());
  bench.send(bench.push(1, 1));
  bench.run_ms(1);
  ASSERT_TRUE(bench.host->frame_under_way());
  bench.host->rest_after_frame();
  const Frame before = bench.host->frame();
  while (bench.host->frame_under_way()) {
    bench.now += kMillisecond;
    bench.poll();
  }
  EXPECT_EQ(bench.host->frame(), before + 1);
  checkpoint::Checkpoint checkpoint;
  bench.host->capture(checkpoint);
  EXPECT_EQ(checkpoint.frame, before + 1);
  EXPECT_EQ(checkpoint.immediate.size(), 1U) << "the step that it acts on has not begun";
  bench.run_ms(200);
  EXPECT_TRUE(bench.host->frame_under_way()) << "steps overlap again";
}

// The step after it had begun already, and its frame was published, too: the server that stood by did not
// know of it.
TEST_F(PipelineTest, NoFrameFollowsTheLastOneBeforeAHandover) { hand_over(500); }

class LatePipelineTest : public PipelineTest {
 protected:
  LatePipelineTest() : PipelineTest(1000) {}
};

// The delta before is full at 500 ms.
TEST_F(LatePipelineTest, FramesThatAreCollectedLeaveBeforeAHandover) { hand_over(580); }

TEST_F(PipelineTest, NamesAreToldWithinSecondsAlthoughAStepIsAlwaysUnderWay) {
  step_ms = 40;
  bench.run_ms(500);
  bench.simulation.body_names = {{1, "Ada"}};
  bench.simulation.names_version_now = 1;
  bench.run_ms(2500);
  ASSERT_FALSE(bench.port.sessions.back().names.empty());
  EXPECT_EQ(bench.port.sessions.back().names[0].name, "Ada");
}

TEST(NoPipeline, TheNextStepBeginsAfterTheFrameBeforeItIsPublished) {
  Bench bench;
  bench.simulation.ready = [&bench, polls = 0]() mutable { return ++polls % 50 == 0; };
  bench.poll();
  for (int i = 0; i < 500; ++i) {
    bench.now += kMillisecond;
    const bool produced = bench.poll();
    ASSERT_FALSE(produced && bench.host->frame_under_way());
  }
  EXPECT_GT(bench.host->frame(), 3U);
}

}  // namespace
}  // namespace tandem::host
