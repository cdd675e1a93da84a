// Tests a simulation whose step takes many polls.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sdk/core/timeline/timeline.hpp"
#include "services/host/frames/roll_forward.hpp"
#include "tests/unit/host/fakes.hpp"

namespace tandem::host {
namespace {

constexpr auto kGravity = static_cast<std::uint32_t>(engine::InputKind::kGravity);
constexpr auto kPush = static_cast<std::uint32_t>(engine::InputKind::kPush);

// A step takes `step_ms` of the bench's clock; a client that plays acknowledges each frame at once.
class SlowStepTest : public ::testing::Test {
 protected:
  SlowStepTest() {
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
    bench.on_ms = [this] { bench.playing(1, bench.host->frame()); };
    bench.run_ms(200);
  }
  // Polls until a step is under way.
  void begin_slow_step(std::int64_t ms) {
    step_ms = ms;
    while (!bench.host->frame_under_way()) bench.run_ms(1);
  }
  void finish_step() {
    step_ms = 0;
    while (bench.host->frame_under_way()) bench.run_ms(1);
  }
  [[nodiscard]] std::vector<std::uint64_t> steps_of(std::uint32_t kind) const {
    std::vector<std::uint64_t> steps;
    for (const auto& [step, input] : bench.simulation.applied)
      if (input.kind == kind) steps.push_back(step);
    return steps;
  }

  Bench bench;
  std::int64_t step_ms = 0, began_ns = -1;
};

TEST_F(SlowStepTest, JoinersAreServedAndEnterWhileAStepTakesTwoSeconds) {
  begin_slow_step(2000);
  const Frame before = bench.host->frame();
  const std::size_t snapshots = bench.port.snapshots.size();
  bench.joining(2);
  bench.run_ms(500);
  ASSERT_GT(bench.port.snapshots.size(), snapshots);
  EXPECT_EQ(bench.port.snapshots.back().frame, before) << "the state before the step that is under way";
  bench.playing(2, before);
  bench.run_ms(20);
  EXPECT_EQ(bench.host->participants(), 2U);
  EXPECT_EQ(bench.last_reply(2)->client, 2U);
  EXPECT_EQ(bench.host->frame(), before);
  finish_step();
  EXPECT_EQ(bench.host->frame(), before + 1);
}

TEST_F(SlowStepTest, InputsThatComeDuringStepSActOnSPlus1AndOnSPlus1PlusLead) {
  begin_slow_step(300);
  const Frame s = bench.host->frame() + 1;
  bench.send(bench.push(1, 1));
  bench.send(bench.gravity(1, 2));
  bench.run_ms(50);
  ASSERT_TRUE(bench.outcome(1, 1) && bench.outcome(1, 2)) << "they are answered at once";
  EXPECT_EQ(bench.outcome(1, 1)->frame, s + 1);
  EXPECT_EQ(bench.outcome(1, 2)->frame, s + 1 + bench.host->session().lead);
  ASSERT_EQ(bench.port.scheduled.size(), 1U);
  EXPECT_EQ(bench.port.scheduled[0].frame, s + 1 + bench.host->session().lead);
  finish_step();
  bench.run_ms(200);
  EXPECT_EQ(steps_of(kPush), (std::vector<std::uint64_t>{s + 1}));
  EXPECT_EQ(steps_of(kGravity), (std::vector<std::uint64_t>{s + 1 + bench.host->session().lead}));
}

TEST_F(SlowStepTest, ASnapshotDuringAStepStillHoldsTheInputThatActsInIt) {
  bench.send(bench.gravity(1, 1));
  bench.run_ms(1);
  ASSERT_EQ(bench.port.scheduled.size(), 1U);
  const Frame acts_on = bench.port.scheduled[0].frame;
  while (bench.host->frame() + 1 < acts_on) bench.run_ms(1);
  begin_slow_step(1000);
  ASSERT_EQ(bench.host->frame() + 1, acts_on);
  bench.joining(2);
  bench.run_ms(500);
  const transport::SnapshotMessage snapshot = bench.port.snapshots.back();
  ASSERT_EQ(snapshot.frame, acts_on - 1);
  finish_step();
  bench.run_ms(100);
  // A client that begins with it makes the same states, although it never saw the input itself.
  ClientTimeline client = std::move(*ClientTimeline::create(bench.host->session().streams[0].layout));
  ASSERT_TRUE(client.load(snapshot.bytes, bench.host->session().epoch, snapshot.stream));
  for (const transport::DeltaMessage& delta : bench.port.deltas) {
    if (delta.frame <= snapshot.frame) continue;
    const auto applied = client.apply(delta.frame, delta.last_input, delta.hash, delta.payload);
    ASSERT_TRUE(applied) << applied.error().message;
  }
  EXPECT_EQ(client.applied(), bench.host->frame());
  EXPECT_EQ(client.drive().gravity[2], bench.port.scheduled[0].values[2]);
}

TEST_F(SlowStepTest, ASlowStepIsNotChargedToClients) {
  const std::uint64_t stalls = bench.host->totals().stalls;
  begin_slow_step(5000);
  bench.run_ms(5000);
  finish_step();
  bench.run_ms(500);
  EXPECT_EQ(bench.host->totals().stalls, stalls);
  EXPECT_EQ(bench.host->totals().suspended_ms, 0U);
  EXPECT_EQ(bench.host->totals().demotions, 0U);
  EXPECT_EQ(bench.host->participants(), 1U);
}

TEST_F(SlowStepTest, LostTimeIsNotCaughtUpAfterAVerySlowStep) {
  begin_slow_step(3000);
  bench.run_ms(2990);
  finish_step();
  const Frame then = bench.host->frame();
  bench.run_ms(1000);
  EXPECT_LE(bench.host->frame() - then, 32U);
  EXPECT_GE(bench.host->frame() - then, 28U);
}

TEST_F(SlowStepTest, StatusGoesOnDuringAStep) {
  begin_slow_step(3000);
  const std::size_t told = bench.port.statuses.size();
  bench.run_ms(2500);
  EXPECT_GE(bench.port.statuses.size(), told + 2);
}

TEST_F(SlowStepTest, ACheckpointAfterTheStepHoldsWhatWasAcceptedDuringIt) {
  begin_slow_step(200);
  bench.send(bench.push(1, 1));
  bench.send(bench.gravity(1, 2));
  bench.run_ms(50);
  ASSERT_TRUE(bench.host->frame_under_way());
  step_ms = 0;
  while (bench.host->frame_under_way()) {
    bench.now += kMillisecond;
    bench.poll();
  }
  checkpoint::Checkpoint checkpoint;
  bench.host->capture(checkpoint);
  EXPECT_EQ(checkpoint.frame, bench.host->frame());
  ASSERT_EQ(checkpoint.immediate.size(), 1U);
  ASSERT_EQ(checkpoint.scheduled.size(), 1U);
  EXPECT_EQ(checkpoint.scheduled[0].frame, checkpoint.frame + 1 + bench.host->session().lead);
}

TEST_F(SlowStepTest, AServerThatStandsByAppliesInputsOfTheJournalInTheirFrames) {
  // A journal as SlowStepTest's host writes it: the push was accepted while step 11 was under way.
  HostConfig config = test_config();
  FakeSimulation other(4);
  other.rests = true;  // as its checkpoint says
  checkpoint::Checkpoint from;
  from.frame = 10;
  from.next_reuse.assign(4, 1);
  from.withheld.assign(4, 0);
  Mirror mirror = *make_mirror(config.streams, other.bodies(), config.extent);
  StateHasher hasher;
  transport::JournalMessage decided, made;
  transport::InputDecision push;
  push.client = 7;
  push.number = 1;
  push.frame = 12;
  push.kind = kPush;
  push.values = {0, 0, 0, 1, 0, 1, 0};
  push.participant.assign(16, std::byte{1});
  decided.decisions = {push};
  decided.frame = 11;
  made.frame = 11;
  made.state = transport::JournalState::kMade;
  made.hash = hasher.hash(mirror.target());
  const auto only = roll_forward(config, other, from, std::vector{decided, made});
  ASSERT_TRUE(only.has_value()) << only.error().message;
  EXPECT_TRUE(other.applied.empty());
  EXPECT_EQ(only->immediate.size(), 1U) << "it waits for the next frame";
  // If the live server ended in that step, its sender was told frame 12, and this server makes frame 11 anew.
  FakeSimulation ended(4);
  ended.rests = true;
  auto none = roll_forward(config, ended, from, std::vector{decided});
  ASSERT_TRUE(none.has_value()) << none.error().message;
  EXPECT_TRUE(none->immediate.empty());
  EXPECT_EQ(none->later.size(), 1U);
  transport::JournalMessage next = made;
  next.frame = 12;
  FakeSimulation again(4);
  again.rests = true;
  const auto both = roll_forward(config, again, from, std::vector{decided, made, next});
  ASSERT_TRUE(both.has_value()) << both.error().message;
  ASSERT_EQ(again.applied.size(), 1U);
  EXPECT_EQ(again.applied[0].first, 2U) << "in the second step";
}

TEST_F(SlowStepTest, AServerThatStandsByActsOnNoInputOfTheJournalThatItsEngineRefuses) {
  const HostConfig config = test_config();
  checkpoint::Checkpoint from;
  from.frame = 10;
  from.next_reuse.assign(4, 1);
  from.withheld.assign(4, 0);
  const auto why_not = [&](std::uint32_t kind, std::vector<double> values, std::uint64_t scheduled,
                           Frame frame) {
    FakeSimulation simulation(4);
    transport::JournalMessage entry;
    transport::InputDecision decision;
    decision.frame = frame;
    decision.kind = kind;
    decision.values = std::move(values);
    decision.scheduled = scheduled;
    entry.decisions = {decision};
    entry.frame = 11;
    const auto rolled = roll_forward(config, simulation, from, std::vector{entry});
    EXPECT_TRUE(simulation.applied.empty());
    return rolled ? std::string() : rolled.error().message;
  };
  const auto refuses = [](const std::string& why) {
    return why.find("refuses an input") != std::string::npos;
  };
  EXPECT_TRUE(refuses(why_not(4711, {}, 0, 11)));
  EXPECT_TRUE(refuses(why_not(kPush, {}, 1, 12))) << "not a scheduled one";
  EXPECT_TRUE(refuses(why_not(kGravity, {0, -9, 0}, 0, 11))) << "not an immediate one";
  EXPECT_EQ(why_not(kGravity, {0, -9, 0}, 1, 12), "");
  EXPECT_NE(why_not(kGravity, {0, -9, 0}, 3, 12).find("not in order"), std::string::npos)
      << "two are missing";
  EXPECT_NE(why_not(kGravity, {0, -9, 0}, 1, 10).find("not in order"), std::string::npos) << "of the past";
}

TEST_F(SlowStepTest, AFailureEndsTheSessionWithItsLineDuringAStepAndBetweenTwo) {
  begin_slow_step(10'000);
  bench.run_ms(10);
  bench.simulation.failure_now = "the engine hung up in frame 5";
  bench.run_ms(1);
  EXPECT_EQ(bench.host->state(), Host::State::kEnded);
  ASSERT_TRUE(bench.host->error().has_value());
  EXPECT_EQ(bench.host->error()->message, "the engine hung up in frame 5");
  EXPECT_EQ(bench.host->error()->code, ErrorCode::kIo);
}

TEST(FastStep, IsFinishedByThePollThatBeganIt) {
  Bench bench;
  bench.poll();
  bench.run_to(3);
  EXPECT_FALSE(bench.host->frame_under_way());
  EXPECT_EQ(bench.host->descriptor(), -1);
  EXPECT_EQ(bench.simulation.steps, 3U);
}

}  // namespace
}  // namespace tandem::host
