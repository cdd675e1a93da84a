// Tests messages of viewers, good and bad.
#include <map>

#include "fake_world.hpp"
#include "sdk/client/session/sent_inputs.hpp"

namespace tandem::gateway {
namespace {

using transport::Phase;
using transport::Reason;
using transport::ReplyEntry;
using transport::ReplyMessage;

class ViewerInputs : public GatewayTest {
 protected:
  ViewerInputs() {
    gateway.on_session(fake_session());
    frame();
  }
  static std::uint32_t code(Reason reason) { return static_cast<std::uint32_t>(reason); }
  static const std::vector<double>& push() {
    static const std::vector<double> values{0, 0, 0, 1, 0, 0, 5};
    return values;
  }
};

TEST_F(ViewerInputs, EachViewerIsToldOfItsOwn) {
  const ViewerId a = join(1), b = join(2);
  EXPECT_FALSE(say(a, input(1, 1, push())));
  EXPECT_FALSE(say(b, input(2, 1, push())));
  ASSERT_EQ(world.sent.size(), 2U);
  acts(1, 20);
  gateway.on_outcome({client::InputOutcome::Kind::kRefused, 2, 0, code(Reason::kInvalid), 0, "too far"},
                     now_ns);
  const ReplyMessage to_a = reply(a), to_b = reply(b);
  EXPECT_EQ(to_a.entries, (std::vector<ReplyEntry>{{1, 20, 0}}));
  EXPECT_EQ(to_a.highest_input, 1U);
  EXPECT_EQ(to_b.entries, (std::vector<ReplyEntry>{{1, 0, code(Reason::kInvalid)}}));
  EXPECT_TRUE(to_a.texts.empty());
  EXPECT_EQ(to_b.texts, (std::vector<transport::ReplyText>{{1, "too far"}}));
}

TEST_F(ViewerInputs, HighestIsUpToWhereEveryOutcomeIsKnown) {
  const ViewerId id = join(1);
  for (std::uint64_t number = 1; number <= 3; ++number) EXPECT_FALSE(say(id, input(1, number, push())));
  acts(2, 20);
  ReplyMessage told = reply(id);
  EXPECT_EQ(told.highest_input, 0U);
  EXPECT_EQ(told.entries, (std::vector<ReplyEntry>{{2, 20, 0}}));
  acts(1, 20);
  EXPECT_EQ(reply(id).highest_input, 2U);
  gateway.on_outcome({client::InputOutcome::Kind::kUnknown, 3, 0, 0, 0}, now_ns);
  told = reply(id);
  EXPECT_EQ(told.highest_input, 3U);
  EXPECT_EQ(told.entries.size(), 2U) << "of what nobody knows nothing is said";
}

TEST_F(ViewerInputs, AreRefusedAsAServerWould) {
  const ViewerId id = join(1);
  auto observer = ack(1, Phase::kPlaying);
  observer.role_wanted = transport::Role::kObserver;
  std::uint64_t number = 0;
  const auto reason = [&](std::vector<double> values) {
    EXPECT_FALSE(say(id, input(1, ++number, std::move(values))));
    const auto told = reply(id).entries;
    return told.empty() || told.back().number != number ? Reason::kNone
                                                        : static_cast<Reason>(told.back().code);
  };
  EXPECT_EQ(reason({1, 2}), Reason::kInvalid);
  EXPECT_EQ(reason({1, 2, std::numeric_limits<double>::infinity()}), Reason::kInvalid);
  EXPECT_FALSE(say(id, observer));
  EXPECT_EQ(reason({0, 0, 1}), Reason::kObserver);
  plays(id, 1);
  world.granted = transport::Role::kObserver;
  EXPECT_EQ(reason({0, 0, 1}), Reason::kDemoted);
  world.granted = transport::Role::kParticipant;
  EXPECT_FALSE(say(id, ack(1, Phase::kJoining)));
  EXPECT_EQ(reason({0, 0, 1}), Reason::kNotPlaying);
  EXPECT_TRUE(world.sent.empty());
}

TEST_F(ViewerInputs, OfAWatcherAreRefusedByName) {
  const ViewerId id = *gateway.admit(nullptr, false);
  EXPECT_FALSE(say(id, ack(1, Phase::kJoining)));
  plays(id, 1);
  EXPECT_EQ(reply(id).role, transport::Role::kObserver);
  auto seek = input(1, 3, {1});
  seek.kind = static_cast<std::uint32_t>(transport::InputKind::kSeek);
  EXPECT_FALSE(say(id, input(1, 1)));
  EXPECT_FALSE(say(id, input(1, 2, push())));
  EXPECT_FALSE(say(id, seek));
  const ReplyMessage told = reply(id);
  const std::uint32_t observer = code(Reason::kObserver);
  EXPECT_EQ(told.entries, (std::vector<ReplyEntry>{{1, 0, observer}, {2, 0, observer}, {3, 0, observer}}));
  ASSERT_EQ(told.texts.size(), 3U);
  EXPECT_EQ(told.texts[0].text, "the token's role is watch, so no gravity is taken");
  EXPECT_EQ(told.texts[1].text, "the token's role is watch, so no push is taken");
  EXPECT_EQ(told.texts[2].text, "the token's role is watch, so no seek is taken");
  EXPECT_EQ(told.reason, code(Reason::kNone)) << "it was not demoted";
  EXPECT_TRUE(world.sent.empty());
}

TEST_F(ViewerInputs, WhatBecameOfThemIsTallied) {
  const ViewerId id = join(1);
  EXPECT_FALSE(say(id, input(1, 1)));
  EXPECT_FALSE(say(id, input(1, 2, push())));
  EXPECT_FALSE(say(id, input(1, 3, {1, 2})));
  acts(1, 20);
  acts(2, 20);
  InputTally tally = gateway.take_tally(id);
  EXPECT_EQ(tally["gravity"].acted, 1U);
  EXPECT_EQ(tally["push"].acted, 1U);
  EXPECT_EQ(tally["push"].refused, 1U);
  EXPECT_EQ(tally["push"].reason, Reason::kInvalid);
  EXPECT_TRUE(gateway.take_tally(id).empty());
}

TEST_F(ViewerInputs, ASeekHasOneValueAndGoesOn) {
  const ViewerId id = join(1);
  auto seek = input(1, 1, {1, 2});
  seek.kind = static_cast<std::uint32_t>(transport::InputKind::kSeek);
  EXPECT_FALSE(say(id, seek));
  EXPECT_EQ(reply(id).entries.back().code, code(Reason::kInvalid));
  seek.number = 2;
  seek.values = {12.5};
  EXPECT_FALSE(say(id, seek));
  ASSERT_EQ(world.sent.size(), 1U);
  EXPECT_EQ(world.sent[0].kind, transport::InputKind::kSeek);
}

TEST_F(ViewerInputs, ANumberCountsOnce) {
  const ViewerId id = join(1);
  EXPECT_FALSE(say(id, input(1, 5, push())));
  EXPECT_FALSE(say(id, input(1, 5, push())));
  EXPECT_FALSE(say(id, input(1, 4, push())));
  EXPECT_EQ(world.sent.size(), 1U);
  acts(1, 9);
  EXPECT_EQ(reply(id).entries, (std::vector<ReplyEntry>{{4, 0, code(Reason::kDuplicate)}, {5, 9, 0}}));
}

TEST_F(ViewerInputs, OfAnotherEpochAreAnsweredByTheReplysReason) {
  const ViewerId id = join(1);
  auto stale = input(1, 1);
  stale.epoch = 3;
  EXPECT_FALSE(say(id, stale));
  const ReplyMessage told = reply(id);
  EXPECT_EQ(told.reason, code(Reason::kStaleEpoch));
  EXPECT_EQ(told.highest_input, 0U);
  EXPECT_TRUE(world.sent.empty());
}

TEST_F(ViewerInputs, OneViewerHasARate) {
  const ViewerId a = join(1), b = join(2);
  for (std::uint64_t number = 1; number <= 20; ++number) EXPECT_FALSE(say(a, input(1, number, push())));
  EXPECT_EQ(world.sent.size(), 5U);
  EXPECT_FALSE(say(b, input(2, 1, push())));
  EXPECT_EQ(world.sent.size(), 6U) << "another has its own";
}

TEST_F(ViewerInputs, NoMoreWaitThanCanBeToldOf) {
  const ViewerId id = join(1);
  for (std::uint64_t number = 1; number <= 50; ++number) EXPECT_FALSE(say(id, input(1, number)));
  const auto told = reply(id);
  EXPECT_EQ(told.entries.size(), 50U - Gateway::kMaxUndecided);
  EXPECT_EQ(told.entries.front().number, Gateway::kMaxUndecided + 1);
}

// What a viewer's client makes of the replies: outcome by number, the last word.
class ViewersWord {
 public:
  void send(std::uint64_t count) {
    for (std::uint64_t i = 0; i < count; ++i) inputs_.on_sent(kStart, out_);
  }
  void hear(const ReplyMessage& reply) { inputs_.on_reply(reply, out_); }
  void plays(Frame frame) { inputs_.on_applied(frame, kStart, out_); }
  void enters(Epoch epoch, Frame shared) { inputs_.carry_over(epoch, shared); }
  [[nodiscard]] std::map<std::uint64_t, client::InputOutcome::Kind> words() const {
    std::map<std::uint64_t, client::InputOutcome::Kind> words;
    for (const auto& outcome : out_) words[outcome.number] = outcome.kind;
    return words;
  }

 private:
  client::SentInputs inputs_;
  std::vector<client::InputOutcome> out_;
};

TEST_F(ViewerInputs, AfterATakeoverAViewerHearsWhatTheServerSaysOfItsInputs) {
  using Kind = client::InputOutcome::Kind;
  const ViewerId id = join(1);
  ViewersWord viewer;
  for (std::uint64_t number = 1; number <= 5; ++number) EXPECT_FALSE(say(id, input(1, number, push())));
  viewer.send(5);
  acts(1, 20);
  acts(2, 40);
  viewer.hear(reply(id));
  viewer.plays(40);
  // A server continues from frame 30: it has 3 and 5, and neither 2 nor 4.
  auto session = fake_session(kEpoch + 1);
  session.continues_epoch = kEpoch;
  session.continues_frame = 30;
  world.settled = false;
  gateway.on_session(session);
  viewer.enters(kEpoch + 1, 30);
  auto joining = ack(1, Phase::kJoining);
  joining.epoch = kEpoch + 1;
  EXPECT_FALSE(say(id, joining));
  later(kSecond);
  EXPECT_TRUE(only<ReplyMessage>(read(id)).empty()) << "the gateway itself does not know yet";
  gateway.on_outcome({Kind::kLost, 2, 0, 0, 0}, now_ns);
  gateway.on_outcome({Kind::kLost, 4, 0, 0, 0}, now_ns);
  acts(3, 31);
  acts(5, 32);
  world.settled = true;
  later(kSecond);
  const ReplyMessage first = reply(id);
  EXPECT_EQ(first.highest_input, 1U) << "beyond it only what is listed acted";
  viewer.hear(first);
  viewer.plays(50);
  EXPECT_EQ(
      viewer.words(),
      (std::map<std::uint64_t, Kind>{
          {1, Kind::kActed}, {2, Kind::kLost}, {3, Kind::kActed}, {4, Kind::kLost}, {5, Kind::kActed}}));
  EXPECT_FALSE(say(id, joining));
  later(2 * kSecond);
  EXPECT_EQ(reply(id).highest_input, 5U) << "from the second reply on";
}

TEST_F(ViewerInputs, AGravityThatWaitsInTheGatewayIsLostWithTheServer) {
  const ViewerId id = join(1);
  ViewersWord viewer;
  for (std::uint64_t number = 1; number <= 2; ++number) EXPECT_FALSE(say(id, input(1, number)));
  viewer.send(2);
  ASSERT_EQ(world.sent.size(), 1U) << "the second one waits";
  auto session = fake_session(kEpoch + 1);
  session.continues_epoch = kEpoch;
  session.continues_frame = 30;
  gateway.on_session(session);
  viewer.enters(kEpoch + 1, 30);
  acts(1, 30);
  auto joining = ack(1, Phase::kJoining);
  joining.epoch = kEpoch + 1;
  EXPECT_FALSE(say(id, joining));
  later(kSecond);
  viewer.hear(reply(id));
  viewer.plays(50);
  using Kind = client::InputOutcome::Kind;
  EXPECT_EQ(viewer.words(), (std::map<std::uint64_t, Kind>{{1, Kind::kActed}, {2, Kind::kLost}}));
  EXPECT_EQ(world.sent.size(), 1U);
}

TEST_F(ViewerInputs, OfAWorldThatBeginsAnewNothingIsCarriedOver) {
  const ViewerId id = join(1);
  EXPECT_FALSE(say(id, input(1, 1, push())));
  gateway.on_session(fake_session(kEpoch + 1));
  acts(1, 5);
  auto joining = ack(1, Phase::kJoining);
  joining.epoch = kEpoch + 1;
  EXPECT_FALSE(say(id, joining));
  later(kSecond);
  const ReplyMessage told = reply(id);
  EXPECT_EQ(told.highest_input, 0U);
  EXPECT_TRUE(told.entries.empty());
}

TEST_F(ViewerInputs, OutcomesOfThoseWhoLeftAreForgotten) {
  const ViewerId id = join(1);
  EXPECT_FALSE(say(id, input(1, 1, push())));
  gateway.leave(id);
  acts(1, 3);
}

TEST_F(ViewerInputs, AViewerCannotSpeakAsAnother) {
  const ViewerId id = join(1);
  EXPECT_EQ(say(id, input(2, 1)), Refusal::kForeignClient);
  auto status = transport::ClientStatusMessage();
  status.session = "default";
  status.client = 3;
  EXPECT_EQ(say(id, status), Refusal::kForeignClient);
  EXPECT_EQ(gateway.counts().of(Refusal::kForeignClient), 2U);
}

TEST_F(ViewerInputs, WhoComesWithTheIdOfAViewerThatIsThereReportsNothingUnderIt) {
  const ViewerId first = join(1), second = join(1);
  transport::ClientStatusMessage status;
  status.session = "default";
  status.client = 1;
  status.epoch = kEpoch;
  EXPECT_FALSE(say(second, status));
  EXPECT_TRUE(world.reported.empty());
  EXPECT_FALSE(say(first, status));
  EXPECT_EQ(world.reported.size(), 1U);
  gateway.leave(first);
  EXPECT_FALSE(say(second, status)) << "it was the same one over another connection";
  EXPECT_EQ(world.reported.size(), 2U);
}

TEST_F(ViewerInputs, AStatusIsPublishedOnceASecondAsTheGatewayKnowsTheViewer) {
  const ViewerId id = join(1);
  transport::ClientStatusMessage status;
  status.client = 1;
  status.session = "another";
  status.epoch = kEpoch;
  status.stream = {.id = 7, .generation = 3};
  status.lag_ms = 12;
  for (int i = 0; i < 10; ++i) EXPECT_FALSE(say(id, status));
  ASSERT_EQ(world.reported.size(), 2U) << "the burst";
  EXPECT_EQ(world.reported[0].session, "default");
  EXPECT_EQ(world.reported[0].stream, StreamId{});
  EXPECT_EQ(world.reported[0].lag_ms, 12);
  later(kSecond);
  EXPECT_FALSE(say(id, status));
  EXPECT_EQ(world.reported.size(), 3U);
  later(kSecond);
  status.epoch = kEpoch + 1;
  EXPECT_FALSE(say(id, status));
  EXPECT_EQ(world.reported.size(), 3U);
}

TEST_F(ViewerInputs, WhatOnlyAGatewaySendsIsRefused) {
  const ViewerId id = join(1);
  transport::DeltaMessage delta;
  delta.epoch = kEpoch;
  EXPECT_EQ(say(id, delta), Refusal::kMalformed);
  EXPECT_EQ(say(id, fake_session()), Refusal::kMalformed);
}

TEST_F(ViewerInputs, BytesThatAreNoMessageAreRefused) {
  const ViewerId id = join(1);
  transport::Bytes whole;
  transport::write_envelope(ack(1, Phase::kPlaying), whole);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    now_ns += kSecond;
    EXPECT_EQ(gateway.receive(id, std::span(whole).first(size), now_ns), Refusal::kMalformed) << size;
  }
  EXPECT_EQ(gateway.receive(id, transport::Bytes(kMaxViewerBytes + 1), now_ns), Refusal::kTooLarge);
  for (int kind = 0; kind < 256; ++kind) {
    now_ns += kSecond;
    EXPECT_EQ(gateway.receive(id, transport::Bytes{static_cast<std::byte>(kind)}, now_ns),
              Refusal::kMalformed);
  }
}

TEST_F(ViewerInputs, AnotherProtocolVersionIsRefused) {
  const ViewerId id = *gateway.admit();
  auto foreign = ack(1, Phase::kJoining);
  foreign.protocol_version = transport::kProtocolVersion - 1;
  EXPECT_EQ(say(id, foreign), Refusal::kProtocolVersion);
}

TEST_F(ViewerInputs, TooManyMessagesAreRefused) {
  const ViewerId id = *gateway.admit();
  int taken = 0;
  while (!say(id, ack(1, Phase::kJoining))) ++taken;
  EXPECT_EQ(taken, 200);
  EXPECT_EQ(gateway.counts().of(Refusal::kTooManyMessages), 1U);
}

TEST_F(ViewerInputs, AreTakenFromWhoPlaysFromASnapshotAlone) {
  world.frame = 50;  // the gateway joined again, and no delta has come yet
  const ViewerId id = join(1);
  EXPECT_EQ(gateway.counts().stale, 0U);
  EXPECT_FALSE(say(id, input(1, 1, push())));
  EXPECT_EQ(world.sent.size(), 1U);
}

TEST_F(ViewerInputs, AFrameThatIsNotThereYetCannotBeApplied) {
  const ViewerId id = join(1);
  auto early = ack(1, Phase::kPlaying);
  early.applied = world.frame + 1;
  EXPECT_FALSE(say(id, early));
  EXPECT_EQ(gateway.counts().stale, 1U);
}

}  // namespace
}  // namespace tandem::gateway
