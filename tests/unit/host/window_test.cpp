// When the server may run ahead, and of whom.
#include <gtest/gtest.h>

#include <deque>

#include "tests/unit/host/fakes.hpp"

namespace tandem::host {
namespace {

using transport::Phase;
using transport::Role;

HostConfig fixed_window(std::uint32_t frames) {
  HostConfig config = test_config();
  config.window = frames;
  config.stall_timeout_ns.reset();
  return config;
}

TEST(Window, WithoutParticipantsTheServerRunsFree) {
  Bench bench;
  bench.poll();
  bench.run_ms(10'000);
  EXPECT_EQ(bench.host->frame(), 301U);
  EXPECT_EQ(bench.host->totals().stalls, 0U);
}

TEST(Window, AFrameStartsOnlyWithinTheWindowOfTheLowestAppliedFrame) {
  for (const std::uint32_t window : {1U, 2U, 5U}) {
    Bench bench(fixed_window(window));
    bench.poll();
    bench.run_to(7);
    bench.enter(1);
    bench.enter(2);
    const Frame base = bench.host->frame();
    bench.playing(2, base);
    bench.run_ms(2000);
    EXPECT_EQ(bench.host->frame(), base + window);
    bench.playing(1, base + window);
    bench.run_ms(2000);
    EXPECT_EQ(bench.host->frame(), base + window) << "client 2 is still behind";
    bench.playing(2, base + 1);
    bench.run_ms(2000);
    EXPECT_EQ(bench.host->frame(), base + window + 1);
  }
}

TEST(Window, FramesThatNoDeltaTellsYetAreNotWaitedFor) {
  Bench bench(fixed_window(2));
  bench.simulation.rests = true;
  bench.poll();
  bench.run_to(300);  // at rest
  bench.enter(1);
  for (int i = 0; i < 300; ++i) {
    bench.playing(1, bench.port.deltas.back().frame);
    bench.run_to(bench.host->frame() + 1);
  }
  EXPECT_EQ(bench.host->frame(), 600U);
  EXPECT_EQ(bench.host->totals().stalls, 0U);
}

TEST(Window, TheAppliedFrameCountsAndNotTheSimulatedOne) {
  Bench bench(fixed_window(2));
  bench.poll();
  bench.enter(1);
  const Frame base = bench.host->frame();
  auto ack = bench.ack(1, Phase::kPlaying, base);
  ack.simulated = base + 50;
  bench.send(ack);
  bench.run_ms(2000);
  EXPECT_EQ(bench.host->frame(), base + 2);
}

TEST(Window, ObserversAreNeverWaitedFor) {
  Bench bench(fixed_window(2));
  bench.poll();
  bench.enter(1, Role::kObserver);
  bench.run_ms(3000);
  EXPECT_GT(bench.host->frame(), 80U);
  EXPECT_EQ(bench.host->observers(), 1U);
  EXPECT_EQ(bench.host->participants(), 0U);
}

TEST(Window, AJoinerCountsOnlyOnceItHasCaughtUp) {
  Bench bench(fixed_window(2));
  bench.poll();
  bench.run_to(100);
  bench.joining(1);
  bench.run_ms(1000);
  bench.playing(1, 100);  // far behind: nobody waits for it yet
  const Frame before = bench.host->frame();
  bench.run_ms(1000);
  EXPECT_GT(bench.host->frame(), before + 25);
  EXPECT_EQ(bench.host->participants(), 0U);
  bench.playing(1, bench.host->frame());
  bench.poll();
  EXPECT_EQ(bench.host->participants(), 1U);
  const Frame caught_up = bench.host->frame();
  bench.run_ms(1000);
  EXPECT_EQ(bench.host->frame(), caught_up + 2);
}

TEST(Window, AParticipantThatRejoinsIsNotWaitedForMeanwhile) {
  Bench bench(fixed_window(2));
  bench.poll();
  bench.enter(1);
  bench.run_ms(1000);
  const Frame held = bench.host->frame();
  bench.joining(1, 2);
  bench.run_ms(1000);
  EXPECT_GT(bench.host->frame(), held + 25);
}

TEST(Window, ARejoinWhoseJoiningWasOverwrittenStillCountsOnlyOnceCaughtUp) {
  Bench bench(fixed_window(2));
  bench.poll();
  bench.enter(1);
  bench.run_ms(1000);
  const Frame held = bench.host->frame();
  bench.send(bench.ack(1, Phase::kPlaying, 0, Role::kParticipant, 2));
  bench.run_ms(1000);
  EXPECT_GT(bench.host->frame(), held + 25);
}

TEST(Window, AParticipantThatTurnsObserverIsNotWaitedFor) {
  Bench bench(fixed_window(2));
  bench.poll();
  bench.enter(1);
  bench.run_ms(1000);
  const Frame held = bench.host->frame();
  bench.playing(1, 0, Role::kObserver);
  bench.run_ms(1000);
  EXPECT_GT(bench.host->frame(), held + 25);
}

TEST(Window, ADeadParticipantIsNotWaitedFor) {
  Bench bench(fixed_window(2));
  bench.poll();
  bench.enter(1);
  bench.run_ms(1000);
  const Frame held = bench.host->frame();
  bench.port.dead.insert(participant(1));
  bench.run_ms(1000);
  EXPECT_GT(bench.host->frame(), held + 25);
  EXPECT_EQ(bench.host->participants(), 0U);
}

TEST(Window, AnAcknowledgementOfAFrameThatDoesNotExistIsRefused) {
  Bench bench(fixed_window(2));
  bench.poll();
  bench.enter(1);
  const Frame base = bench.host->frame();
  bench.playing(1, 1'000'000);
  bench.run_ms(1000);
  EXPECT_EQ(bench.host->frame(), base + 2);
  EXPECT_EQ(bench.host->totals().refused_messages, 1U);
}

TEST(Window, AfterASuspensionThereIsNoCatchUp) {
  Bench bench(fixed_window(2));
  bench.poll();
  bench.enter(1);
  bench.run_ms(5000);
  const Frame held = bench.host->frame();
  bench.on_ms = [&] { bench.playing(1, bench.host->frame()); };
  bench.run_ms(1000);
  EXPECT_NEAR(static_cast<double>(bench.host->frame() - held), 30, 1);
}

TEST(Window, WaitForHoldsFrameOneUntilThatManyParticipantsPlay) {
  HostConfig config = test_config();
  config.wait_for = 2;
  Bench bench(config);
  bench.poll();
  bench.run_ms(3000);
  EXPECT_EQ(bench.host->state(), Host::State::kWaiting);
  bench.joining(1);
  bench.run_ms(150);
  ASSERT_EQ(bench.port.snapshots.size(), 1U) << "joiners are served while the server waits";
  EXPECT_EQ(bench.port.snapshots[0].frame, 0U);
  bench.playing(1, 0);
  bench.send(bench.gravity(1, 1));
  bench.run_ms(100);
  ASSERT_FALSE(bench.port.scheduled.empty()) << "inputs are taken while the server waits";
  bench.enter(3, Role::kObserver);
  bench.run_ms(1000);
  EXPECT_EQ(bench.host->frame(), 0U);
  bench.enter(2);
  EXPECT_EQ(bench.host->state(), Host::State::kRunning);
  bench.run_ms(40);
  EXPECT_GT(bench.host->frame(), 0U);
}

// A client that acknowledges every frame a fixed time after it was produced.
void follow_delayed(Bench& bench, std::int64_t delay_ns, std::int64_t duration_ms) {
  std::deque<std::pair<std::int64_t, Frame>> under_way;
  Frame last = bench.host->frame();
  bench.on_ms = [&] {
    if (bench.host->frame() != last) under_way.emplace_back(bench.now + delay_ns, last = bench.host->frame());
    while (!under_way.empty() && under_way.front().first <= bench.now) {
      bench.playing(1, under_way.front().second);
      under_way.pop_front();
    }
  };
  bench.run_ms(duration_ms);
  bench.on_ms = nullptr;
}

TEST(AutomaticWindow, GrowsWithTheMeasuredRoundTripSoThatTheRateHolds) {
  Bench bench;
  bench.poll();
  bench.enter(1);
  EXPECT_EQ(bench.host->window(), 13U) << "acknowledgements 0.2 s apart are expected";
  follow_delayed(bench, 200 * kMillisecond, 3000);
  EXPECT_GE(bench.host->window(), 7U);
  const Frame before = bench.host->frame();
  const auto stalls = bench.host->totals().stalls;
  follow_delayed(bench, 200 * kMillisecond, 3000);
  EXPECT_NEAR(static_cast<double>(bench.host->frame() - before), 90, 8);
  EXPECT_LE(bench.host->totals().stalls, stalls + 2);
  EXPECT_EQ(bench.host->participants(), 1U);
}

TEST(AutomaticWindow, StaysAtTwoOnAFastLinkAndNeverExceedsTheCeiling) {
  Bench fast;
  fast.poll();
  fast.enter(1);
  follow_delayed(fast, 2 * kMillisecond, 3000);
  EXPECT_EQ(fast.host->window(), 2U);

  HostConfig config = test_config();
  config.stall_timeout_ns.reset();
  Bench slow(config);
  slow.poll();
  slow.enter(1);
  follow_delayed(slow, 1500 * kMillisecond, 10'000);
  EXPECT_EQ(slow.host->window(), 24U);
}

TEST(AutomaticWindow, ADistantJoinerCanCatchUp) {
  Bench bench;
  bench.poll();
  bench.run_to(30);
  bench.joining(1);
  bench.run_ms(200);
  bench.playing(1, bench.host->frame() - 8);
  follow_delayed(bench, 250 * kMillisecond, 3000);
  EXPECT_EQ(bench.host->participants(), 1U);
}

TEST(FreeRate, RunsAsFastAsTheWindowAllowsWithoutBlame) {
  HostConfig config = fixed_window(2);
  config.free_rate = true;
  config.stall_timeout_ns = kSecond / 2;
  Bench bench(config);
  bench.poll();
  bench.enter(1);
  bench.on_ms = [&] {
    if (bench.now / kMillisecond % 5 == 0) bench.playing(1, bench.host->frame());
  };
  const Frame before = bench.host->frame();
  bench.run_ms(10'000);
  EXPECT_NEAR(static_cast<double>(bench.host->frame() - before), 4000, 10) << "two frames per answer";
  EXPECT_EQ(bench.host->participants(), 1U);
  EXPECT_EQ(bench.host->totals().stalls, 0U);
}

}  // namespace
}  // namespace tandem::host
