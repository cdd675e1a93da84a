// The small parts by themselves.
#include <gtest/gtest.h>

#include "services/host/clients/notices.hpp"
#include "services/host/clients/pacing.hpp"
#include "services/host/clients/stall_meter.hpp"
#include "services/host/clients/window.hpp"
#include "services/host/frames/recent_senders.hpp"
#include "services/host/outgoing/outbox.hpp"
#include "services/host/outgoing/sent_frames.hpp"
#include "services/program/budget.hpp"
#include "services/program/token_bucket.hpp"
#include "tests/unit/host/fakes.hpp"

namespace tandem::host {
namespace {

using accounts::TokenBucket;

TEST(StallMeter, ForgetsAChargeAfterTenSeconds) {
  StallMeter meter;
  meter.charge(7 * kSecond, 300 * kMillisecond);
  EXPECT_EQ(meter.total_ns(7 * kSecond), 300 * kMillisecond);
  EXPECT_EQ(meter.total_ns(17 * kSecond), 300 * kMillisecond);
  EXPECT_EQ(meter.total_ns(17 * kSecond + 100 * kMillisecond), 0);
}

TEST(StallMeter, AddsChargesWithinTheWindowAndDropsThemOneByOne) {
  StallMeter meter;
  for (int i = 0; i < 20; ++i) meter.charge(i * kSecond, 10 * kMillisecond);
  EXPECT_EQ(meter.total_ns(19 * kSecond), 110 * kMillisecond);
  EXPECT_EQ(meter.total_ns(24 * kSecond), 60 * kMillisecond);
  EXPECT_EQ(meter.total_ns(1000 * kSecond), 0);
}

TEST(TokenBucket, GivesABurstAndThenARate) {
  TokenBucket bucket(2, 3);
  int taken = 0;
  for (std::int64_t ms = 0; ms <= 10'000; ++ms) taken += bucket.take(kSecond + ms * kMillisecond) ? 1 : 0;
  EXPECT_NEAR(taken, 3 + 20, 1);
}

TEST(Budget, GivesItsReserveAndThenWhatComesBack) {
  const accounts::Budget::Rule rule{.per_second = 2, .most = 10};
  accounts::Budget budget;
  EXPECT_TRUE(budget.take(9, rule, kSecond));
  EXPECT_FALSE(budget.take(2, rule, kSecond)) << "1 is left, and a refusal takes nothing";
  EXPECT_TRUE(budget.take(1, rule, kSecond));
  EXPECT_FALSE(budget.take(3, rule, 2 * kSecond));
  EXPECT_TRUE(budget.take(2, rule, 2 * kSecond));
  EXPECT_TRUE(budget.take(1000, rule, 100 * kSecond)) << "more than the reserve costs all of it";
  EXPECT_FALSE(budget.take(1, rule, 100 * kSecond));
  EXPECT_TRUE(budget.take(1000, {}, 100 * kSecond)) << "no limit";
}

TEST(RecentSenders, NamesTheLatestOfTheLastTenSeconds) {
  RecentSenders senders;
  EXPECT_EQ(senders.names(kSecond), "");
  senders.sent(1, kSecond);
  senders.sent(2, 2 * kSecond);
  senders.sent(1, 3 * kSecond);
  EXPECT_EQ(senders.names(4 * kSecond), "client 0000000000000001 (1.0 s), client 0000000000000002 (2.0 s)");
  EXPECT_EQ(senders.names(13 * kSecond), "client 0000000000000001 (10.0 s)");
  EXPECT_EQ(senders.names(14 * kSecond), "");
  for (transport::ClientId client = 10; client < 200; ++client) senders.sent(client, 20 * kSecond);
  EXPECT_TRUE(senders.names(20 * kSecond).ends_with(" and 56 more")) << senders.names(20 * kSecond);
}

TEST(Notices, OfOneClientAndOfAllAreBoundedAndSayWhatIsLeftOut) {
  Notices notices;
  TokenBucket loud = kNoticesOfClient, quiet = kNoticesOfClient;
  std::vector<std::string> lines;
  const auto collect = [&] {
    for (auto& line : notices.take()) lines.push_back(std::move(line));
  };
  constexpr std::int64_t kSeconds = 600;
  for (std::int64_t ms = 0; ms < 1000 * kSeconds; ++ms) {
    notices.add("loud", loud, kSecond + ms * kMillisecond);
    if (ms == 300'000) notices.add("quiet", quiet, kSecond + ms * kMillisecond);
    collect();
  }
  EXPECT_NEAR(static_cast<double>(std::ranges::count(lines, "loud")), 8 + kSeconds / 10, 2);
  EXPECT_EQ(std::ranges::count(lines, "quiet"), 1);
  EXPECT_LE(lines.size(), 8 + 2 * kSeconds / 10 + 3);
  EXPECT_TRUE(std::ranges::any_of(lines, [](const auto& l) { return l.ends_with(" lines left out"); }));
  lines.clear();
  for (std::int64_t ms = 0; ms < 1000 * kSeconds; ++ms) {
    TokenBucket stranger = kNoticesOfClient;
    notices.add("stranger", stranger, (kSeconds + 1) * kSecond + ms * kMillisecond);
    collect();
  }
  EXPECT_LE(lines.size(), Notices::kBurst + 2 * kSeconds + kSeconds / 10 + 1);
}

TEST(SentFrames, CountsWhatAClientLacks) {
  SentFrames sent;
  EXPECT_EQ(sent.beyond(0), 0U);
  EXPECT_FALSE(sent.first_beyond(0));
  for (const Frame frame : {5U, 6U, 66U}) sent.add(frame, 10 * static_cast<std::int64_t>(frame));
  EXPECT_EQ(sent.beyond(4), 3U);
  EXPECT_EQ(sent.beyond(6), 1U) << "59 quiet frames are told by one delta";
  EXPECT_EQ(sent.beyond(40), 1U) << "a client in the midst of them";
  EXPECT_EQ(sent.beyond(66), 0U);
  ASSERT_TRUE(sent.first_beyond(6));
  EXPECT_EQ(sent.first_beyond(6)->frame, 66U);
  EXPECT_EQ(sent.first_beyond(6)->at_ns, 660);
}

TEST(SentFrames, StayBoundedAndMayBeSentAgain) {
  SentFrames sent;
  for (Frame frame = 1; frame <= 3 * SentFrames::kKept; ++frame) sent.add(frame, 0);
  EXPECT_EQ(sent.beyond(0), SentFrames::kKept);
  sent.add(3 * SentFrames::kKept - 1, 7);
  EXPECT_EQ(sent.beyond(3 * SentFrames::kKept - 2), 1U);
  EXPECT_EQ(sent.first_beyond(3 * SentFrames::kKept - 2)->at_ns, 7);
}

TEST(RoundTrip, SettlesOnASteadyRoundTrip) {
  RoundTrip trip;
  EXPECT_EQ(trip.high_ns(), 0);
  trip.measured(80 * kMillisecond);
  EXPECT_EQ(trip.high_ns(), 240 * kMillisecond);
  for (int i = 0; i < 100; ++i) trip.measured(80 * kMillisecond);
  EXPECT_NEAR(static_cast<double>(trip.high_ns()), 80e6, 1e3);
}

TEST(WindowFor, CoversTheRoundTripBetweenTwoAndTheCeiling) {
  constexpr std::int64_t kPeriodNs = kSecond / 30;
  EXPECT_EQ(window_for(0, kPeriodNs, 24), 2U);
  EXPECT_EQ(window_for(2 * kMillisecond, kPeriodNs, 24), 2U);
  EXPECT_EQ(window_for(100 * kMillisecond, kPeriodNs, 24), 5U);
  EXPECT_EQ(window_for(5 * kSecond, kPeriodNs, 24), 24U);
  EXPECT_EQ(window_for(5 * kSecond, 0, 24), 24U);
}

TEST(Overrun, TellsThatFramesTakeTooLongEveryTenSecondsAndThatItIsOver) {
  Overrun overrun(30);
  std::int64_t now = 0;
  const auto seconds = [&](int count, std::int64_t frame_ms) {
    std::vector<std::string> lines;
    for (const std::int64_t end = now + count * kSecond; now < end; now += 40 * kMillisecond) {
      const std::string line =
          overrun.frame_took((frame_ms - 5) * kMillisecond, frame_ms * kMillisecond, now);
      if (!line.empty()) lines.push_back(line);
    }
    return lines;
  };
  EXPECT_EQ(seconds(20, 33).size(), 0U);
  const std::vector<std::string> slow = seconds(25, 41);
  ASSERT_EQ(slow.size(), 3U);
  EXPECT_EQ(slow[1],
            "the session runs at 24.4 instead of 30 frames/s: a frame takes 41 ms, 36 ms of them in the "
            "simulation, but must take at most 33.3 ms");
  const std::vector<std::string> over = seconds(25, 20);
  ASSERT_EQ(over.size(), 1U);
  EXPECT_EQ(over[0], "the session keeps its rate again: a frame takes 20 of 33.3 ms");
}

TEST(Pacing, DeadlinesAreAbsoluteSoThatLatenessDoesNotAddUp) {
  Pacing pacing(50, false);
  pacing.start(0);
  std::int64_t now = 0;
  for (int i = 0; i < 100; ++i) {
    now = pacing.deadline_ns() + 3 * kMillisecond;
    ASSERT_TRUE(pacing.due(now));
    pacing.frame_started(now, false);
  }
  EXPECT_EQ(pacing.deadline_ns(), 100 * 20 * kMillisecond);
}

TEST(Pacing, AfterASuspensionThereIsNoCatchUp) {
  Pacing pacing(50, false);
  pacing.start(0);
  pacing.frame_started(0, false);
  pacing.frame_started(45 * kMillisecond, true);
  EXPECT_EQ(pacing.deadline_ns(), 65 * kMillisecond);
}

TEST(Pacing, ALongHiccupIsNotSprintedAfter) {
  Pacing pacing(50, false);
  pacing.start(0);
  pacing.frame_started(0, false);
  pacing.frame_started(kSecond, false);
  EXPECT_EQ(pacing.deadline_ns(), kSecond + 20 * kMillisecond);
}

TEST(Pacing, AtAFreeRateEveryFrameIsDueButWaitingCountsFromTheNominalPeriod) {
  Pacing pacing(50, true);
  pacing.start(0);
  pacing.frame_started(kMillisecond, false);
  EXPECT_TRUE(pacing.due(kMillisecond));
  EXPECT_EQ(pacing.suspended_from_ns(), 21 * kMillisecond);
  for (int i = 2; i < 100; ++i) pacing.frame_started(i * kMillisecond, false);
  EXPECT_NEAR(static_cast<double>(pacing.period_ns()), 1e6, 1e4);
}

transport::DeltaMessage delta(Frame frame, std::uint32_t part, std::uint32_t parts) {
  transport::DeltaMessage message;
  message.frame = frame;
  message.part = part;
  message.parts = parts;
  return message;
}

TEST(Outbox, KeepsOneOrderOverAllKinds) {
  Outbox outbox({});
  ASSERT_TRUE(outbox.push(transport::ScheduledInputMessage{}));
  ASSERT_TRUE(outbox.push(delta(1, 0, 1)));
  ASSERT_TRUE(outbox.push(SnapshotPart{}));
  using std::chrono::nanoseconds;
  EXPECT_TRUE(std::holds_alternative<transport::ScheduledInputMessage>(*outbox.pop(nanoseconds{0})));
  EXPECT_TRUE(std::holds_alternative<transport::DeltaMessage>(*outbox.pop(nanoseconds{0})));
  EXPECT_TRUE(std::holds_alternative<SnapshotPart>(*outbox.pop(nanoseconds{0})));
  EXPECT_FALSE(outbox.pop(nanoseconds{0}));
  EXPECT_EQ(outbox.high_water(), 3U);
}

/// The deltas of two streams, each of `parts`, and the end of their frame.
void push_frame(Outbox& outbox, Frame frame, std::uint32_t parts) {
  for (int stream = 0; stream < 2; ++stream) {
    for (std::uint32_t part = 0; part < parts; ++part) ASSERT_TRUE(outbox.push(delta(frame, part, parts)));
  }
  ASSERT_TRUE(outbox.push(EndOfFrame{}));
}

TEST(Outbox, CountsAFrameOnceWhateverItsStreamsAndParts) {
  Outbox outbox({.frames = 2, .snapshots = 1, .control = 1});
  for (Frame f = 1; f <= 2; ++f) {
    EXPECT_TRUE(outbox.has_frame_room());
    push_frame(outbox, f, 3);
  }
  EXPECT_FALSE(outbox.has_frame_room());
  for (int i = 0; i < 7; ++i) ASSERT_TRUE(outbox.pop(std::chrono::nanoseconds{0}));
  EXPECT_TRUE(outbox.has_frame_room());
}

TEST(Outbox, AFrameIsUnwrittenUntilTheDeltasOfAllStreamsAreWritten) {
  Outbox outbox({});
  push_frame(outbox, 1, 2);
  push_frame(outbox, 2, 1);
  for (int i = 0; i < 4; ++i) {
    ASSERT_TRUE(outbox.pop(std::chrono::nanoseconds{0}));
    EXPECT_EQ(outbox.unwritten_frames(), 2U) << "its last is being written";
  }
  ASSERT_TRUE(outbox.pop(std::chrono::nanoseconds{0}));
  EXPECT_EQ(outbox.unwritten_frames(), 1U);
  while (outbox.pop(std::chrono::nanoseconds{0})) {
  }
  EXPECT_EQ(outbox.unwritten_frames(), 0U);
}

TEST(Outbox, EachKindIsBoundedByItself) {
  Outbox outbox({.frames = 1, .snapshots = 1, .control = 1});
  EXPECT_TRUE(outbox.push(EndOfFrame{}));
  EXPECT_FALSE(outbox.push(EndOfFrame{}));
  EXPECT_TRUE(outbox.push(SnapshotPart{}));
  EXPECT_FALSE(outbox.push(SnapshotPart{}));
  EXPECT_TRUE(outbox.push(transport::ReplyMessage{}));
  EXPECT_FALSE(outbox.push(transport::ServerStatusMessage{}));
  EXPECT_EQ(outbox.size(), 3U);
}

}  // namespace
}  // namespace tandem::host
