// Tests the outcome of inputs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "services/host/frames/live_source.hpp"
#include "tests/unit/host/fakes.hpp"

namespace tandem::host {
namespace {

using transport::Phase;
using transport::Reason;
using transport::Role;

class InputTest : public ::testing::Test {
 protected:
  explicit InputTest(HostConfig config = test_config()) : bench(std::move(config)) {
    bench.poll();
    bench.run_to(10);
    bench.enter(1);
    follow();
  }
  void follow() {
    bench.on_ms = [this] { bench.playing(1, bench.host->frame()); };
    bench.run_ms(20);
  }
  void send(const transport::InputMessage& input) {
    bench.send(input);
    bench.run_ms(15);
  }

  Bench bench;
};

TEST_F(InputTest, AScheduledInputActsOnFrameSPlusLead) {
  const Frame s = bench.host->frame() + 1;
  bench.send(bench.gravity(1, 1));
  bench.on_ms = nullptr;
  bench.host->poll(bench.now, 0);  // the same instant: no frame is due
  ASSERT_EQ(bench.host->frame() + 1, s);
  bench.drained();
  ASSERT_EQ(bench.port.scheduled.size(), 1U);
  const auto& scheduled = bench.port.scheduled[0];
  EXPECT_EQ(scheduled.frame, s + 1);
  EXPECT_EQ(scheduled.number, 1U);
  EXPECT_EQ(scheduled.source_client, 1U);
  EXPECT_EQ(scheduled.source_number, 1U);
  EXPECT_EQ(scheduled.kind, static_cast<std::uint32_t>(transport::ScheduledKind::kDrive));
  const Drive drive = *to_drive(test_config().streams[0].lattice, {0, 0, -5}, 0);
  EXPECT_EQ(scheduled.values, (std::vector<std::int32_t>{0, 0, drive.gravity[2], 0}));
}

TEST_F(InputTest, TheClientsOfADdsParticipantHaveOneBudgetOfImmediateInputs) {
  constexpr transport::ClientId kSibling = 257;  // of client 1's DDS participant
  bench.enter(2);
  bench.enter(kSibling);
  bench.on_ms = [this] {
    for (const transport::ClientId client : {transport::ClientId{1}, transport::ClientId{2}, kSibling})
      bench.playing(client, bench.host->frame());
  };
  bench.simulation.budget = {.per_second = 1, .most = 3};
  const auto reason = [&](transport::ClientId client, std::uint64_t number, double cost) {
    auto push = bench.push(client, number);
    push.values[4] = cost;
    bench.send(push);
    bench.run_ms(300);
    return bench.refusal(client, number);
  };
  static_cast<void>(bench.host->take_notices());
  EXPECT_EQ(reason(1, 1, 2.5), Reason::kNone);
  EXPECT_EQ(reason(1, 2, 1.5), Reason::kRateLimited);
  EXPECT_EQ(reason(kSibling, 1, 1.6), Reason::kRateLimited) << "another id is no other participant";
  EXPECT_EQ(reason(1, 3, 0), Reason::kNone) << "what costs nothing is not held up";
  EXPECT_EQ(reason(2, 1, 2.5), Reason::kNone);
  bench.run_ms(1500);
  EXPECT_EQ(reason(1, 4, 2.5), Reason::kNone) << "it has come back";
  EXPECT_EQ(bench.simulation.applied.size(), 4U);
  const auto lines = bench.host->take_notices();
  EXPECT_EQ(std::ranges::count_if(
                lines, [](const auto& line) { return line.find("its budget of pushes") != line.npos; }),
            1)
      << "once in ten seconds";
}

TEST_F(InputTest, BodiesThatAreLostAreToldWithThoseWhoSentInputsBefore) {
  static_cast<void>(bench.host->take_warnings());
  const auto lose = [&](std::uint64_t bodies) {
    bench.simulation.mishaps_so_far.removed += bodies;
    bench.run_ms(1100);
    for (const std::string& line : bench.host->take_warnings())
      if (line.find("faulty bodies") != line.npos) return line;
    return std::string();
  };
  EXPECT_THAT(lose(2), testing::HasSubstr("; 2 of them since the last such line, up to frame"));
  EXPECT_THAT(lose(1), testing::HasSubstr("no client sent an input in the 10 s before"));
  bench.send(bench.push(1, 1));
  bench.run_ms(200);
  EXPECT_THAT(
      lose(5),
      testing::AllOf(testing::HasSubstr("8 removed"), testing::HasSubstr("; 5 of them"),
                     testing::HasSubstr("inputs of the 10 s before came from client 0000000000000001 (")));
  bench.run_ms(10'000);
  EXPECT_THAT(lose(1), testing::HasSubstr("no client sent an input"));
}

TEST_F(InputTest, TheSimulationGetsAScheduledInputInTheStepThatProducesItsFrame) {
  const Frame s = bench.host->frame() + 1;
  bench.send(bench.gravity(1, 1));
  bench.run_ms(200);
  ASSERT_EQ(bench.simulation.applied.size(), 1U);
  EXPECT_EQ(bench.port.scheduled[0].frame, s + 1);
  EXPECT_EQ(bench.simulation.applied[0].first, s + 1);
}

class LeadZero : public InputTest {
 protected:
  LeadZero() : InputTest(config()) {}
  static HostConfig config() {
    HostConfig config = test_config();
    config.streams[0].layout.lead = 0;
    return config;
  }
};

TEST_F(LeadZero, AScheduledInputActsOnFrameS) {
  const Frame s = bench.host->frame() + 1;
  bench.send(bench.gravity(1, 1));
  bench.run_ms(200);
  EXPECT_EQ(bench.port.scheduled[0].frame, s);
  EXPECT_EQ(bench.simulation.applied[0].first, s);
}

TEST_F(InputTest, AScheduledInputIsPublishedBeforeDeltaSWhichCarriesItsNumber) {
  bench.port.order.clear();
  bench.port.deltas.clear();
  const Frame s = bench.host->frame() + 1;
  bench.send(bench.gravity(1, 1));
  bench.run_ms(200);
  const auto first = std::ranges::find(bench.port.order, "scheduled");
  const auto delta = std::ranges::find(bench.port.order, "delta");
  ASSERT_NE(first, bench.port.order.end());
  EXPECT_LT(first - bench.port.order.begin(), delta - bench.port.order.begin());
  ASSERT_EQ(bench.port.deltas.front().frame, s);
  EXPECT_EQ(bench.port.deltas.front().last_input, 1U);
}

TEST_F(InputTest, EvenWhenInputAndDueFrameMeetInOnePollTheInputGoesFirst) {
  bench.port.order.clear();
  const Frame s = bench.host->frame() + 1;
  bench.send(bench.gravity(1, 1));
  bench.now += Bench::kPeriod;
  bench.poll();
  ASSERT_EQ(bench.host->frame(), s);
  ASSERT_GE(bench.port.order.size(), 2U);
  EXPECT_EQ(bench.port.order[0], "scheduled");
  EXPECT_EQ(bench.port.order[1], "delta");
  EXPECT_EQ(bench.port.deltas.back().last_input, 1U);
}

TEST_F(InputTest, NumbersOfScheduledInputsCountOneByOneOverAllClients) {
  bench.enter(2);
  for (std::uint64_t n = 1; n <= 5; ++n) {
    bench.send(bench.gravity(1, n * 7));
    bench.send(bench.gravity(2, n));
    bench.run_ms(40);
  }
  ASSERT_EQ(bench.port.scheduled.size(), 10U);
  for (std::size_t i = 0; i < 10; ++i) EXPECT_EQ(bench.port.scheduled[i].number, i + 1);
}

TEST_F(InputTest, OfSeveralGravitiesForOneFrameTheLastIssuedWins) {
  bench.enter(2);
  bench.on_ms = nullptr;
  bench.send(bench.gravity(1, 1, -1));
  bench.send(bench.gravity(2, 1, -2));
  bench.send(bench.gravity(1, 2, -3));
  bench.host->poll(bench.now, 0);
  bench.drained();
  bench.on_ms = [this] {
    bench.playing(1, bench.host->frame());
    bench.playing(2, bench.host->frame());
  };
  bench.run_ms(200);
  EXPECT_EQ(bench.simulation.gravity_in_force[2], -3);
  EXPECT_EQ(bench.port.scheduled.back().source_number, 2U);
}

TEST_F(InputTest, AnImmediateInputActsInTheNextStepAndIsNotScheduled) {
  const Frame s = bench.host->frame() + 1;
  bench.send(bench.push(1, 1));
  bench.run_ms(200);
  ASSERT_EQ(bench.simulation.applied.size(), 1U);
  EXPECT_EQ(bench.simulation.applied[0].first, s);
  EXPECT_TRUE(bench.port.scheduled.empty());
  const auto entry = bench.outcome(1, 1);
  ASSERT_TRUE(entry);
  EXPECT_EQ(entry->frame, s);
  EXPECT_EQ(entry->code, 0U);
}

TEST_F(InputTest, TheReplyNamesTheFrameAnInputActsOn) {
  send(bench.gravity(1, 3));
  const auto entry = bench.outcome(1, 3);
  ASSERT_TRUE(entry);
  EXPECT_EQ(entry->code, 0U);
  EXPECT_EQ(entry->frame, bench.port.scheduled[0].frame);
  EXPECT_EQ(bench.last_reply(1)->highest_input, 3U);
}

TEST_F(InputTest, TheReplyKeepsTheLastThirtyTwoOutcomesOldestFirst) {
  for (std::uint64_t n = 1; n <= 40; ++n) bench.send(bench.push(1, n));
  bench.run_ms(50);
  const auto& entries = bench.last_reply(1)->entries;
  ASSERT_EQ(entries.size(), transport::kReplyRing);
  EXPECT_EQ(entries.front().number, 9U);
  EXPECT_EQ(entries.back().number, 40U);
}

TEST_F(InputTest, GapsInNumbersAreLegalAndLowerNumbersAreDuplicates) {
  send(bench.push(1, 5));
  send(bench.push(1, 9));
  send(bench.push(1, 7));
  send(bench.push(1, 9));
  send(bench.push(1, 0));
  bench.run_ms(300);
  EXPECT_EQ(bench.simulation.applied.size(), 2U);
  EXPECT_EQ(bench.refusal(1, 7), Reason::kDuplicate);
  EXPECT_EQ(bench.refusal(1, 0), Reason::kDuplicate);
  EXPECT_EQ(bench.refusal(1, 9), Reason::kNone) << "the first outcome stands";
  EXPECT_EQ(bench.host->totals().refused_inputs, 3U);
  EXPECT_EQ(bench.last_reply(1)->highest_input, 9U);
}

TEST_F(InputTest, AnInputOfAnotherEpochIsRefusedWithoutTouchingThisEpochsNumbers) {
  auto stale = bench.gravity(1, 50);
  stale.epoch -= 1;
  send(stale);
  EXPECT_EQ(bench.last_reply(1)->reason, static_cast<std::uint32_t>(Reason::kStaleEpoch));
  EXPECT_FALSE(bench.outcome(1, 50));
  EXPECT_EQ(bench.last_reply(1)->highest_input, 0U);
  EXPECT_EQ(bench.host->totals().refused_inputs, 1U);
  EXPECT_TRUE(bench.port.scheduled.empty());
  send(bench.gravity(1, 1));
  EXPECT_EQ(bench.port.scheduled.size(), 1U);
}

TEST_F(InputTest, WhatIsNotFiniteOrOutOfRangeIsRefusedAsInvalid) {
  const double bad[] = {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
                        1e300, 1001};
  std::uint64_t number = 0;
  for (const double value : bad) {
    send(bench.gravity(1, ++number, value));
    bench.run_ms(250);
    EXPECT_EQ(bench.refusal(1, number), Reason::kInvalid) << value;
  }
  auto push = bench.push(1, ++number);
  push.values[3] = std::numeric_limits<double>::quiet_NaN();
  send(push);
  EXPECT_EQ(bench.refusal(1, number), Reason::kInvalid);
  EXPECT_EQ(bench.host->totals().refused_inputs, number);
  EXPECT_TRUE(bench.simulation.applied.empty());
}

TEST_F(InputTest, TheSimulationsOwnReasonForARefusalIsLoggedAndTold) {
  static_cast<void>(bench.host->take_notices());
  send(bench.gravity(1, 7, 1001));
  bench.run_ms(50);
  EXPECT_THAT(bench.host->take_notices(),
              ::testing::Contains("the simulation refuses input 7 of client 0000000000000001: beyond 1000"));
  bench.run_ms(500);
  const auto told = bench.last_reply(1);
  ASSERT_TRUE(told);
  EXPECT_EQ(told->texts, (std::vector<transport::ReplyText>{{7, "beyond 1000"}}));
  const auto injected = bench.host->inject({.kind = 1, .values = {0, 0, 1001}});
  ASSERT_FALSE(injected);
  EXPECT_EQ(injected.error().message, "the simulation refuses this input: beyond 1000");
}

TEST_F(InputTest, OfManyReasonsTheNewestEightAreToldAndNoneForLongerThanItsOutcome) {
  for (std::uint64_t number = 1; number <= 10; ++number) send(bench.gravity(1, number, 1001));
  bench.run_ms(600);
  const auto told = bench.last_reply(1);
  ASSERT_TRUE(told);
  EXPECT_EQ(told->entries.size(), 10U);
  ASSERT_EQ(told->texts.size(), 8U);
  EXPECT_EQ(told->texts.front().number, 3U);
  EXPECT_EQ(told->texts.back().number, 10U);
  bench.run_ms(6000);
  EXPECT_TRUE(bench.last_reply(1)->texts.empty());
}

TEST_F(InputTest, UnknownKindsAndOversizedValuesAreRefusedAsInvalid) {
  auto unknown = bench.gravity(1, 1);
  unknown.kind = 99;
  send(unknown);
  EXPECT_EQ(bench.refusal(1, 1), Reason::kInvalid);
  auto many = bench.gravity(1, 2);
  many.values.assign(17, 0);
  send(many);
  EXPECT_EQ(bench.refusal(1, 2), Reason::kInvalid);
  auto large = bench.gravity(1, 3);
  large.bytes.resize(1025);
  send(large);
  EXPECT_EQ(bench.refusal(1, 3), Reason::kInvalid);
}

TEST_F(InputTest, ABurstOfSixtyPassesAndTheNextIsRateLimitedUntilTimePasses) {
  bench.run_ms(1000);
  for (std::uint64_t n = 1; n <= 61; ++n) bench.send(bench.push(1, n));
  bench.run_ms(1);
  bench.run_ms(15);
  EXPECT_EQ(bench.refusal(1, 60), Reason::kNone);
  EXPECT_EQ(bench.refusal(1, 61), Reason::kRateLimited);
  EXPECT_EQ(bench.host->totals().refused_inputs, 1U);
  bench.run_ms(20);  // a sixtieth of a second later one more passes
  send(bench.push(1, 62));
  EXPECT_EQ(bench.refusal(1, 62), Reason::kNone);
}

TEST_F(InputTest, OneClientsFloodLeavesTheOthersTheirRate) {
  bench.enter(2);
  for (std::uint64_t n = 1; n <= 1000; ++n) bench.send(bench.push(1, n));
  send(bench.push(2, 1));
  EXPECT_EQ(bench.refusal(2, 1), Reason::kNone);
}

TEST_F(InputTest, ObserversMayNotSendInput) {
  bench.enter(2, Role::kObserver);
  send(bench.gravity(2, 1));
  EXPECT_EQ(bench.refusal(2, 1), Reason::kObserver);
  EXPECT_TRUE(bench.port.scheduled.empty());
}

TEST_F(InputTest, AClientThatHasNotFinishedJoiningMayNotSendInput) {
  bench.port.unmatched.insert(participant(2));
  bench.joining(2);
  bench.run_ms(10);
  send(bench.gravity(2, 1));
  EXPECT_EQ(bench.refusal(2, 1), Reason::kNotPlaying);
}

TEST_F(InputTest, AnInputThatOvertakesTheFirstPlayingAcknowledgementIsTaken) {
  bench.joining(2);
  bench.run_ms(200);  // its snapshot is out
  send(bench.gravity(2, 1));
  EXPECT_EQ(bench.refusal(2, 1), Reason::kNone);
  EXPECT_EQ(bench.port.scheduled.size(), 1U);
}

TEST_F(InputTest, AClientNobodyKnowsIsAnsweredAndCounted) {
  send(bench.gravity(9, 1));
  ASSERT_NE(bench.last_reply(9), nullptr);
  EXPECT_EQ(bench.last_reply(9)->reason, static_cast<std::uint32_t>(Reason::kNotPlaying));
  EXPECT_EQ(bench.host->totals().refused_inputs, 1U);
  EXPECT_TRUE(bench.port.scheduled.empty());
}

TEST_F(InputTest, AnotherParticipantUsingAClientsIdIsRefusedAndCountedAndTheOwnerDoesNotNotice) {
  const std::size_t replies = bench.port.replies.size();
  bench.on_ms = nullptr;
  bench.port.inputs.push_back({bench.gravity(1, 1), participant(66)});
  auto ack = bench.ack(1, Phase::kPlaying, 0, Role::kObserver);
  bench.port.acks.push_back({ack, participant(66)});
  bench.run_ms(5);
  EXPECT_EQ(bench.host->totals().refused_messages, 2U);
  EXPECT_TRUE(bench.port.scheduled.empty());
  EXPECT_EQ(bench.host->participants(), 1U);
  EXPECT_EQ(bench.port.replies.size(), replies);
  send(bench.gravity(1, 1));
  EXPECT_EQ(bench.refusal(1, 1), Reason::kNone);
}

TEST_F(InputTest, MoreScheduledInputsForOneFrameThanReadersKeepAreRefused) {
  for (transport::ClientId id = 2; id <= 5; ++id) bench.enter(id);
  bench.on_ms = nullptr;
  for (transport::ClientId id = 1; id <= 5; ++id) {
    for (std::uint64_t n = 1; n <= 40; ++n) bench.send(bench.gravity(id, n));
  }
  bench.host->poll(bench.now, 0);
  bench.drained();
  EXPECT_EQ(bench.port.scheduled.size(), kMaxScheduledPerFrame);
  EXPECT_EQ(bench.host->totals().refused_inputs, 200U - kMaxScheduledPerFrame);
}

TEST_F(InputTest, MoreImmediateInputsThanOneStepTakesAreRefused) {
  const engine::Input push{.kind = 2, .values = {0, 0, 0, 1, 0, 1, 0}, .bytes = {}};
  for (std::size_t i = 0; i < kMaxImmediate; ++i) ASSERT_TRUE(bench.host->inject(push)) << i;
  const auto refused = bench.host->inject(push);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kCapacity);
  bench.run_ms(100);
  EXPECT_TRUE(bench.host->inject(push)) << "the next step takes more";
}

TEST_F(InputTest, TheServersOwnInputsTakeTheSameWay) {
  const engine::Input gravity{.kind = 1, .values = {0, 0, -3}, .bytes = {}};
  const auto frame = bench.host->inject(gravity);
  ASSERT_TRUE(frame);
  EXPECT_EQ(*frame, bench.host->frame() + 2);
  bench.run_ms(200);
  EXPECT_EQ(bench.simulation.gravity_in_force[2], -3);
  EXPECT_EQ(bench.port.scheduled[0].source_client, 0U);
  const auto refused = bench.host->inject({.kind = 1, .values = {0, 0, 1e9}, .bytes = {}});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace tandem::host
