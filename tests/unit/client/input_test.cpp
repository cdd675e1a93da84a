#include <limits>

#include "tests/support/client/fake_server.hpp"

namespace tandem::client {
namespace {

using InputTest = ClientTest;
using transport::InputKind;

transport::ReplyMessage reply(std::vector<transport::ReplyEntry> entries, std::uint64_t highest) {
  transport::ReplyMessage m;
  m.client = kClient;
  m.epoch = 1000;
  m.role = transport::Role::kParticipant;
  m.phase = transport::Phase::kPlaying;
  m.highest_input = highest;
  m.entries = std::move(entries);
  return m;
}

TEST_F(InputTest, NumbersStartAtOneAndCountUp) {
  join();
  for (std::uint64_t n = 1; n <= 3; ++n) {
    EXPECT_EQ(core->send(InputKind::kGravity, {0, -9, 0}, {}, {now_ns, wall_ns()}).value(), n);
  }
  ASSERT_EQ(port.sent_inputs.size(), 3U);
  EXPECT_EQ(port.sent_inputs[2].number, 3U);
  EXPECT_EQ(port.sent_inputs[2].epoch, 1000U);
  EXPECT_EQ(port.sent_inputs[2].client, kClient);
}

TEST_F(InputTest, NumbersGoOnAfterARejoin) {
  join();
  static_cast<void>(core->send(InputKind::kGravity, {0, -9, 0}, {}, {now_ns, wall_ns()}));
  static_cast<void>(server.advance());
  frame();
  EXPECT_FALSE(core->send(InputKind::kGravity, {0, -9, 0}, {}, {now_ns, wall_ns()}).has_value());
  poll(200 * kMs);
  port.snapshots.push_back(from_server(server.snapshot()));
  poll();
  EXPECT_EQ(core->send(InputKind::kGravity, {0, -9, 0}, {}, {now_ns, wall_ns()}).value(), 2U);
}

TEST_F(InputTest, NumbersGoOnOverServersSoThatNoneTakesThemForOldOnes) {
  join();
  const auto send = [&] {
    return core->send(InputKind::kGravity, {0, -9, 0}, {}, {now_ns, wall_ns()}).value();
  };
  EXPECT_EQ(send(), 1U);
  port.replies.push_back(from_server(reply({{1, 2, 0}}, 1)));
  frame();
  FakeServer other(2000);
  std::swap(server, other);
  join();
  EXPECT_EQ(send(), 2U);
  std::swap(server, other);
  join();
  port.replies.push_back(from_server(reply({{1, 2, 0}}, 1)));  // as the first server remembers it
  const std::uint64_t number = send();
  EXPECT_EQ(number, 3U);
  recorder.outcomes.clear();
  frame();
  EXPECT_TRUE(recorder.outcomes.empty());
  port.replies.push_back(from_server(reply({{1, 2, 0}, {3, 0, 3}}, 3)));
  frame();
  ASSERT_EQ(recorder.outcomes.size(), 1U);
  EXPECT_EQ(recorder.outcomes[0].kind, InputOutcome::Kind::kRefused);
}

TEST_F(InputTest, ObserversAreToldAtOnce) {
  start(1, transport::Role::kObserver);
  join();
  const auto sent = core->send(InputKind::kGravity, {0, -9, 0}, {}, {now_ns, wall_ns()});
  ASSERT_FALSE(sent.has_value());
  EXPECT_EQ(sent.error().code, ErrorCode::kOutOfOrder);
  EXPECT_TRUE(port.sent_inputs.empty());
}

TEST_F(InputTest, ValuesThatAreNotFiniteAndTooMuchDataAreRefusedHere) {
  join();
  const Now now{now_ns, wall_ns()};
  EXPECT_FALSE(
      core->send(InputKind::kGravity, {0, std::numeric_limits<double>::quiet_NaN(), 0}, {}, now).has_value());
  EXPECT_FALSE(core->send(InputKind::kPush, std::vector<double>(17), {}, now).has_value());
  EXPECT_FALSE(core->send(InputKind::kApplication, {}, transport::Bytes(1025), now).has_value());
  EXPECT_TRUE(port.sent_inputs.empty());
}

TEST_F(InputTest, LatencyRunsUntilTheFrameItActedOnIsApplied) {
  join();
  static_cast<void>(core->send(InputKind::kPush, std::vector<double>(7), {}, {now_ns, wall_ns()}));
  port.replies.push_back(from_server(reply({{1, 4, 0}}, 1)));
  frame();
  EXPECT_TRUE(recorder.outcomes.empty());
  frame();
  frame();
  ASSERT_EQ(recorder.outcomes.size(), 1U);
  EXPECT_EQ(recorder.outcomes[0].frame, 4U);
  EXPECT_EQ(recorder.outcomes[0].latency_ns, 3 * kFrameNs);
  EXPECT_EQ(figures().inputs_acted, 1U);
}

TEST_F(InputTest, AReplyAfterTheFrameStillFindsWhenItWasApplied) {
  join();
  static_cast<void>(core->send(InputKind::kPush, std::vector<double>(7), {}, {now_ns, wall_ns()}));
  for (int i = 0; i < 5; ++i) frame();
  port.replies.push_back(from_server(reply({{1, 3, 0}}, 1)));
  poll();
  ASSERT_EQ(recorder.outcomes.size(), 1U);
  EXPECT_EQ(recorder.outcomes[0].latency_ns, 2 * kFrameNs);
}

TEST_F(InputTest, ARefusalIsCountedWithItsReason) {
  join();
  static_cast<void>(core->send(InputKind::kGravity, {0, -9, 0}, {}, {now_ns, wall_ns()}));
  port.replies.push_back(
      from_server(reply({{1, 0, static_cast<std::uint32_t>(transport::Reason::kRateLimited)}}, 1)));
  poll();
  ASSERT_EQ(recorder.outcomes.size(), 1U);
  EXPECT_EQ(recorder.outcomes[0].kind, InputOutcome::Kind::kRefused);
  EXPECT_EQ(recorder.outcomes[0].reason, static_cast<std::uint32_t>(transport::Reason::kRateLimited));
  EXPECT_EQ(recorder.outcomes[0].text, "");
  EXPECT_EQ(figures().inputs_refused, 1U);
}

TEST_F(InputTest, TheSimulationsWordsComeWithItsRefusal) {
  join();
  constexpr auto kInvalid = static_cast<std::uint32_t>(transport::Reason::kInvalid);
  for (int i = 0; i < 2; ++i)
    static_cast<void>(core->send(InputKind::kGravity, {0, -9, 0}, {}, {now_ns, wall_ns()}));
  auto answer = reply({{1, 0, kInvalid}, {2, 0, kInvalid}}, 2);
  answer.texts = {{2, "beyond 8"}};
  port.replies.push_back(from_server(answer));
  poll();
  ASSERT_EQ(recorder.outcomes.size(), 2U);
  EXPECT_EQ(recorder.outcomes[0].text, "");
  EXPECT_EQ(recorder.outcomes[1].text, "beyond 8");
}

TEST_F(InputTest, AnInputThatTheServerPassedOverIsUnknownAndNotSentAgain) {
  join();
  for (int i = 0; i < 2; ++i) {
    static_cast<void>(core->send(InputKind::kGravity, {0, -9, 0}, {}, {now_ns, wall_ns()}));
  }
  port.replies.push_back(from_server(reply({{2, 1, 0}}, 2)));
  for (int i = 0; i < 100; ++i) frame();
  EXPECT_EQ(figures().inputs_unknown, 1U);
  EXPECT_EQ(figures().inputs_acted, 1U);
  EXPECT_EQ(port.sent_inputs.size(), 2U);
}

TEST_F(InputTest, UnansweredInputsAreBounded) {
  join();
  for (int i = 0; i < 300; ++i) {
    static_cast<void>(core->send(InputKind::kGravity, {0, -9, 0}, {}, {now_ns, wall_ns()}));
  }
  poll();
  EXPECT_EQ(figures().inputs_unknown, 44U);
}

TEST_F(InputTest, RepliesToOthersAndOfOtherEpochsAreIgnored) {
  join();
  static_cast<void>(core->send(InputKind::kGravity, {0, -9, 0}, {}, {now_ns, wall_ns()}));
  auto other = reply({{1, 2, 0}}, 1);
  other.client = 5;
  port.replies.push_back(from_server(other));
  other = reply({{1, 2, 0}}, 1);
  other.epoch = 5;
  port.replies.push_back(from_server(other));
  for (int i = 0; i < 5; ++i) frame();
  EXPECT_TRUE(recorder.outcomes.empty());
}

/// A second server that goes on from frame `from` of the first one.
class ContinuedTest : public InputTest {
 protected:
  void go_on_from(Frame from) {
    server = FakeServer(2000);
    server.session.continues_epoch = 1000;
    server.session.continues_frame = from;
    join();
  }
  std::uint64_t send() {
    return core->send(InputKind::kGravity, {0, -9, 0}, {}, {now_ns, wall_ns()}).value();
  }
  void answer(std::vector<transport::ReplyEntry> entries, std::uint64_t highest, std::uint32_t reason = 0) {
    auto message = reply(std::move(entries), highest);
    message.epoch = server.session.epoch;
    message.reason = reason;
    port.replies.push_back(from_server(message));
    poll();
  }
  [[nodiscard]] std::vector<std::uint64_t> of_kind(InputOutcome::Kind kind) const {
    std::vector<std::uint64_t> numbers;
    for (const InputOutcome& outcome : recorder.outcomes)
      if (outcome.kind == kind) numbers.push_back(outcome.number);
    return numbers;
  }
  using Numbers = std::vector<std::uint64_t>;
};

TEST_F(ContinuedTest, AnInputThatActedAfterTheCheckpointIsLostAndThatIsToldOnce) {
  join();
  const Frame acts = server.frame() + 1;
  for (int i = 0; i < 2; ++i) send();
  answer({{1, acts, 0}, {2, acts + 1, 0}}, 2);
  for (int i = 0; i < 3; ++i) frame();
  ASSERT_EQ(of_kind(InputOutcome::Kind::kActed), (Numbers{1, 2}));
  go_on_from(acts);
  EXPECT_TRUE(of_kind(InputOutcome::Kind::kLost).empty()) << "the server has not said anything yet";
  for (int i = 0; i < 2; ++i) answer({{1, acts, 0}}, 1);
  EXPECT_EQ(of_kind(InputOutcome::Kind::kLost), Numbers{2});
  EXPECT_EQ(send(), 3U);
}

TEST_F(ContinuedTest, AnInputThatWaitedInTheCheckpointActsAndIsNotLost) {
  join();
  const Frame acts = server.frame() + 1;
  send();
  answer({{1, acts, 0}}, 1);
  for (int i = 0; i < 3; ++i) frame();
  go_on_from(acts - 1);
  answer({{1, acts, 0}}, 1);
  EXPECT_TRUE(of_kind(InputOutcome::Kind::kLost).empty());
}

// The server that took over ends at once, and the one before it goes on from its checkpoint.
TEST_F(ContinuedTest, AnInputThatOneTakeoverKeptMayBeLostWithTheNextOne) {
  join();
  const Frame acts = server.frame() + 1;
  for (int i = 0; i < 3; ++i) send();
  answer({{1, acts, 0}, {2, acts + 1, 0}, {3, acts + 2, 0}}, 3);
  for (int i = 0; i < 4; ++i) frame();
  ASSERT_EQ(of_kind(InputOutcome::Kind::kActed), (Numbers{1, 2, 3}));
  go_on_from(acts + 1);
  answer({{1, acts, 0}, {2, acts + 1, 0}, {3, acts + 2, 0}}, 3);
  EXPECT_TRUE(of_kind(InputOutcome::Kind::kLost).empty()) << "the third one waited and acts again";
  server = FakeServer(3000);
  server.session.continues_epoch = 1000;
  server.session.continues_frame = acts;
  join();
  answer({{1, acts, 0}}, 1);
  EXPECT_EQ(of_kind(InputOutcome::Kind::kLost), (Numbers{2, 3}));
}

// Of two live servers the first one stays, and gets what was sent to it after all.
TEST_F(ContinuedTest, AnInputToAServerThatTheClientComesBackToMayStillAct) {
  join();
  const Frame acts = server.frame() + 1;
  for (int i = 0; i < 2; ++i) send();
  answer({{1, acts, 0}}, 1);
  for (int i = 0; i < 3; ++i) frame();
  ASSERT_EQ(of_kind(InputOutcome::Kind::kActed), Numbers{1});
  go_on_from(acts - 1);
  EXPECT_EQ(send(), 3U);
  server = FakeServer(1000);
  join();
  answer({{1, acts, 0}}, 1);
  EXPECT_EQ(of_kind(InputOutcome::Kind::kLost), Numbers{3}) << "only what was sent to the other server";
  answer({{1, acts, 0}, {2, server.frame() + 1, 0}}, 2);
  for (int i = 0; i < 3; ++i) frame();
  EXPECT_EQ(of_kind(InputOutcome::Kind::kActed), (Numbers{1, 2}));
  EXPECT_EQ(of_kind(InputOutcome::Kind::kLost), Numbers{3});
}

TEST_F(ContinuedTest, AnInputThatActedWhereTheClientComesBackToIsNotInDoubt) {
  join();
  const Frame acts = server.frame() + 1;
  send();
  answer({{1, acts, 0}}, 1);
  for (int i = 0; i < 3; ++i) frame();
  ASSERT_EQ(of_kind(InputOutcome::Kind::kActed), Numbers{1});
  go_on_from(acts - 1);
  answer({{1, acts, 0}}, 1);
  server = FakeServer(1000);
  join();
  EXPECT_EQ(send(), 2U);
  answer({{2, 0, static_cast<std::uint32_t>(transport::Reason::kInvalid)}},
         2);  // its ring has the first no more
  EXPECT_TRUE(of_kind(InputOutcome::Kind::kLost).empty());
}

// Two servers went on from the same one, and the client comes back to the one that it left.
TEST_F(ContinuedTest, AnInputToAServerThatTheClientLeftForItsSiblingMayStillAct) {
  const auto sibling = [&](Epoch epoch) {
    server = FakeServer(epoch);
    server.session.continues_epoch = 500;
    server.session.continues_frame = 1;
    join();
  };
  sibling(1000);
  const Frame acts = server.frame() + 1;
  for (int i = 0; i < 2; ++i) send();
  answer({{1, acts, 0}}, 1);
  for (int i = 0; i < 3; ++i) frame();
  ASSERT_EQ(of_kind(InputOutcome::Kind::kActed), Numbers{1});
  sibling(2000);
  EXPECT_EQ(send(), 3U);
  sibling(1000);
  answer({}, 0);
  EXPECT_EQ(of_kind(InputOutcome::Kind::kLost), Numbers{3}) << "only what was sent to the other server";
  answer({{2, server.frame() + 1, 0}}, 2);
  for (int i = 0; i < 3; ++i) frame();
  EXPECT_EQ(of_kind(InputOutcome::Kind::kActed), (Numbers{1, 2}));
  EXPECT_EQ(of_kind(InputOutcome::Kind::kLost), Numbers{3});
}

TEST_F(ContinuedTest, AnUnansweredInputIsDecidedByTheFirstReplyOfAnAccount) {
  join();
  for (int i = 0; i < 4; ++i) send();
  const Frame from = server.frame();
  go_on_from(from);
  answer({}, 0, static_cast<std::uint32_t>(transport::Reason::kNotPlaying));  // nobody's account yet
  EXPECT_TRUE(recorder.outcomes.empty());
  answer({{2, from, 0}, {3, 0, static_cast<std::uint32_t>(transport::Reason::kInvalid)}}, 3);
  while (server.frame() <= from) frame();
  EXPECT_EQ(of_kind(InputOutcome::Kind::kUnknown), Numbers{1});
  EXPECT_EQ(of_kind(InputOutcome::Kind::kActed), Numbers{2});
  EXPECT_EQ(of_kind(InputOutcome::Kind::kRefused), Numbers{3});
  EXPECT_EQ(of_kind(InputOutcome::Kind::kLost), Numbers{4});
}

TEST_F(ContinuedTest, AnInputOfTheNewEpochDoesNotHideALostOne) {
  join();
  send();
  go_on_from(server.frame());
  EXPECT_EQ(send(), 2U);
  answer({{2, server.frame(), 0}}, 2);
  EXPECT_EQ(of_kind(InputOutcome::Kind::kLost), Numbers{1});
}

TEST_F(ContinuedTest, AnEpochThatContinuesAnotherOneMakesUnansweredInputsUnknown) {
  join();
  send();
  server = FakeServer(2000);
  server.session.continues_epoch = 999;
  join();
  answer({}, 0);
  EXPECT_EQ(of_kind(InputOutcome::Kind::kUnknown), Numbers{1});
  EXPECT_TRUE(of_kind(InputOutcome::Kind::kLost).empty());
}

TEST_F(InputTest, TheRoleAndTheReasonComeFromTheServer) {
  join();
  auto told = reply({}, 0);
  port.replies.push_back(from_server(told));
  poll();
  EXPECT_EQ(core->status().role, ClientRole::kParticipant);
  told.role = transport::Role::kObserver;
  told.reason = static_cast<std::uint32_t>(transport::Reason::kDemoted);
  port.replies.push_back(from_server(told));
  poll();
  EXPECT_EQ(core->status().role, ClientRole::kObserver);
  EXPECT_NE(core->status().reason.find("delayed the others"), std::string::npos);
}

}  // namespace
}  // namespace tandem::client
