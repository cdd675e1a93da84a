#include <limits>
#include <string>

#include "sdk/client/session/session_check.hpp"
#include "sdk/core/predict/contact/constants.hpp"
#include "tests/support/client/fake_server.hpp"

namespace tandem::client {
namespace {

using SessionTest = ClientTest;

void rehash(transport::SessionMessage& session) {
  for (auto& stream : session.streams) stream.layout_hash = transport::layout_hash(session, stream);
}

void set_capacity(transport::SessionMessage& session, std::uint32_t capacity) {
  session.capacity = session.streams[0].layout.capacity = capacity;
}

TEST_F(SessionTest, WithoutAServerTheClientSearchesAndSaysNothing) {
  start();
  for (int i = 0; i < 100; ++i) poll(50 * kMs);
  EXPECT_EQ(core->phase(), ClientPhase::kSearching);
  EXPECT_TRUE(port.acks.empty());
  EXPECT_TRUE(port.opened_epochs.empty());
}

TEST_F(SessionTest, AnotherSessionsAnnouncementIsIgnored) {
  start();
  auto other = server.session;
  other.session = "other";
  port.sessions.push_back(from_server(other));
  poll();
  EXPECT_EQ(core->phase(), ClientPhase::kSearching);
}

TEST_F(SessionTest, AnotherProtocolVersionIsRefusedAndSaid) {
  start();
  auto other = server.session;
  other.protocol_version += 1;
  port.sessions.push_back(from_server(other));
  poll();
  EXPECT_EQ(core->phase(), ClientPhase::kRefused);
  EXPECT_NE(core->status().reason.find("protocol version 5"), std::string::npos);
  EXPECT_EQ(figures().refused_messages, 1U);
  EXPECT_TRUE(port.acks.empty());
}

TEST_F(SessionTest, WhatALaterServerTellsIsRefusedByName) {
  const auto refusal = [this](auto&& change) {
    auto session = server.session;
    change(session);
    const auto chosen = choose_stream(session);
    return chosen ? std::string() : chosen.error().message;
  };
  EXPECT_EQ(refusal([](auto&) {}), "");
  EXPECT_EQ(refusal([](auto& s) { s.features = {"events", "keys"}; }), "");
  EXPECT_NE(refusal([](auto& s) { s.features = {"keys", "events"}; }), "");
  EXPECT_NE(refusal([](auto& s) { s.features = {"keys", "keys"}; }), "");
  EXPECT_NE(refusal([](auto& s) { s.features = {"smells"}; }).find("'smells'"), std::string::npos);
  EXPECT_EQ(refusal([](auto& s) { s.data = {{1, "health"}}; }), "") << "no stream has them";
  EXPECT_NE(refusal([](auto& s) { s.data = {{8, "health"}}; }).find("unknown kind"), std::string::npos);
  EXPECT_NE(refusal([](auto& s) { s.data = {{1, "a"}, {1, "a"}}; }).find("twice"), std::string::npos);
  EXPECT_NE(refusal([](auto& s) { s.streams[0].layout.groups.emplace_back("data"); }).find("'data'"),
            std::string::npos);
  EXPECT_NE(refusal([](auto& s) { s.topology_bytes = 1; }).find("'topology'"), std::string::npos);
  EXPECT_NE(refusal([](auto& s) { s.streams[0].world_slots = 9; }).find("a view"), std::string::npos);
}

TEST_F(SessionTest, AServerThatStandsByIsNotJoined) {
  start();
  auto standby = server.session;
  standby.server_role = transport::ServerRole::kStandby;
  standby.standby_rank = 1;
  port.sessions.push_back(from_server(standby));
  for (int i = 0; i < 10; ++i) poll();
  EXPECT_EQ(core->phase(), ClientPhase::kSearching);
  EXPECT_TRUE(port.acks.empty());
  join();
  EXPECT_EQ(core->phase(), ClientPhase::kPlaying);
}

// A transport that had to join another network is another participant for the server.
TEST_F(SessionTest, AfterItsNetworkChangedAClientGoesOnUnderAnotherId) {
  port.hears_all = true;
  join();
  const std::size_t opened = port.opened_epochs.size();
  port.acks.clear();
  port.renewal = 4711;
  poll();
  EXPECT_EQ(core->status().client_id, 4711U);
  EXPECT_EQ(core->phase(), ClientPhase::kPlaying) << "what it holds is not lost";
  port.sessions.push_back(from_server(server.session));
  poll();
  EXPECT_EQ(core->phase(), ClientPhase::kPlaying);
  EXPECT_EQ(port.opened_epochs.size(), opened) << "the port has opened it again";
  ASSERT_FALSE(port.acks.empty());
  EXPECT_EQ(port.acks.back().client, 4711U);
}

TEST_F(SessionTest, TheServerIsNoOtherOneThoughTheNetworkChangedTwice) {
  port.hears_all = true;
  join();
  for (const transport::ClientId id : {4711U, 4712U}) {
    port.renewal = id;
    poll();
    port.sessions.push_back(from_server(server.session));
    poll();  // nothing comes before the network changes again
  }
  EXPECT_TRUE(core->server_alive());
  for (const std::string& line : log) {
    EXPECT_EQ(line.find("another server"), std::string::npos) << line;
    EXPECT_EQ(line.find("is no server"), std::string::npos) << line;
  }
  for (int i = 0; i < 45; ++i) poll(40 * kMs);
  EXPECT_TRUE(port.successor_wanted) << "it was proven";
  EXPECT_TRUE(port.passed_over.empty());
}

TEST_F(SessionTest, OtherNamesOfTheSameEpochAreTakenAndNothingElse) {
  join();
  EXPECT_EQ(core->body_name(3), "");
  auto again = server.session;
  again.names = {{3, 0, "crane"}, {4, 1, "of another body"}};
  again.scene = "other";
  port.sessions.push_back(from_server(again));
  poll();
  EXPECT_EQ(core->phase(), ClientPhase::kPlaying);
  EXPECT_EQ(core->body_name(3), "crane");
  EXPECT_EQ(core->body_name(4), "") << "the slot holds another body than the one with this name";
  EXPECT_EQ(core->body_name(5), "");
  EXPECT_EQ(core->body_name(1'000'000), "");
  EXPECT_EQ(core->session()->scene, server.session.scene);
  EXPECT_EQ(figures().resyncs, 0U);
  EXPECT_EQ(figures().epochs, 1U);
}

TEST_F(SessionTest, AnotherLayoutHashIsRefused) {
  start();
  auto other = server.session;
  other.streams[0].layout_hash ^= 1;
  port.sessions.push_back(from_server(other));
  poll();
  EXPECT_EQ(core->phase(), ClientPhase::kRefused);
}

TEST_F(SessionTest, AnUnknownCodecIsRefused) {
  start();
  auto other = server.session;
  other.streams[0].layout.codec = "of the future";
  rehash(other);
  port.sessions.push_back(from_server(other));
  poll();
  EXPECT_EQ(core->phase(), ClientPhase::kRefused);
}

TEST_F(SessionTest, AfterARefusedSessionAGoodOneIsPlayed) {
  start();
  auto other = server.session;
  other.epoch -= 1;
  other.protocol_version += 1;
  port.sessions.push_back(from_server(other));
  poll();
  join();
  EXPECT_EQ(core->phase(), ClientPhase::kPlaying);
}

TEST_F(SessionTest, ValuesOutOfRangeAreRefused) {
  const auto refused = [&](auto change) {
    auto s = server.session;
    change(s);
    rehash(s);
    return !choose_stream(s).has_value();
  };
  EXPECT_FALSE(refused([](auto&) {}));
  EXPECT_TRUE(refused([](auto& s) { set_capacity(s, 0); }));
  EXPECT_TRUE(refused([](auto& s) { set_capacity(s, kMaxCapacity + 1); }));
  EXPECT_TRUE(refused([](auto& s) { s.frame_rate_hz = 0; }));
  EXPECT_TRUE(refused([](auto& s) { s.frame_rate_hz = 1e-300; }));  // periods would overflow all clocks
  EXPECT_TRUE(refused([](auto& s) { s.frame_rate_hz = std::numeric_limits<double>::quiet_NaN(); }));
  EXPECT_TRUE(refused([](auto& s) { s.lattice_unit = std::numeric_limits<double>::infinity(); }));
  EXPECT_TRUE(refused([](auto& s) { s.lead = 2; }));
  EXPECT_TRUE(refused([](auto& s) { s.streams[0].max_delta_bytes = 0xFFFFFFFF; }));
  EXPECT_TRUE(refused([](auto& s) { s.streams[0].max_snapshot_bytes = 0xFFFFFFFF; }));
  EXPECT_TRUE(refused([](auto& s) { s.types.clear(); }));
  EXPECT_TRUE(refused([](auto& s) { s.streams[0].layout.parameters.codec.threshold = 0; }));
  EXPECT_TRUE(refused([](auto& s) { s.streams[0].layout.groups = {"smell"}; }));
  EXPECT_TRUE(refused([](auto& s) { s.streams[0].layout.groups = {"position", "position"}; }));
  EXPECT_TRUE(refused([](auto& s) { s.streams[0].layout.radii = {1}; }));
  EXPECT_TRUE(refused([](auto& s) { s.epoch = 0; }));
}

TEST_F(SessionTest, AStreamWhoseStepsWouldTakeTooLongIsRefusedByName) {
  auto session = server.session;
  set_capacity(session, 16384);
  Layout& layout = session.streams[0].layout;
  layout.predictor = "contact";
  ContactConstants constants;
  constants.types = {{1000, 65536}};
  constants.substeps = 16;
  for (const std::size_t balls : {std::size_t{1}, std::size_t{256}}) {
    constants.balls.assign(balls, {{}, 1000});
    layout.predictor_constants = write_contact_constants(constants);
    rehash(session);
    const auto playable = playable_streams(session);
    EXPECT_EQ(playable.has_value(), balls == 1);
    const std::string refused = playable ? "" : playable.error().message;
    EXPECT_EQ(refused.find("predictor 'contact' takes too long") == std::string::npos, balls == 1) << refused;
  }
}

TEST_F(SessionTest, TheFirstStreamThatCanBePlayedIsPlayed) {
  auto session = server.session;
  session.streams.insert(session.streams.begin(), session.streams[0]);
  session.streams[0].layout.groups = {"position", "smell"};
  session.streams[1].id.id = session.streams[1].carries = 1;
  rehash(session);
  const auto chosen = choose_stream(session);
  ASSERT_TRUE(chosen.has_value());
  EXPECT_EQ(chosen->stream, 1U);
}

TEST_F(SessionTest, WithoutAStreamToPlayTheReasonOfEachIsSaid) {
  auto session = server.session;
  session.streams.push_back(session.streams[0]);
  session.streams[0].layout.groups = {"smell"};
  session.streams[1].id.id = session.streams[1].carries = 1;
  session.streams[1].layout.codec = "of the future";
  rehash(session);
  const auto chosen = choose_stream(session);
  ASSERT_FALSE(chosen.has_value());
  EXPECT_NE(chosen.error().message.find("unknown channel group 'smell'"), std::string::npos);
  EXPECT_NE(chosen.error().message.find("stream 1: "), std::string::npos) << chosen.error().message;
}

TEST_F(SessionTest, OrientationsNeedARadiusOfEachType) {
  const auto refused = [&](const std::vector<std::int32_t>& radii) {
    auto session = server.session;
    session.streams[0].layout.groups = {"position", "orientation"};
    session.streams[0].layout.radii = radii;
    rehash(session);
    const auto chosen = choose_stream(session);
    return !chosen && chosen.error().message.find("radius") != std::string::npos;
  };
  std::vector<std::int32_t> radii(server.session.types.size(), 1000);
  EXPECT_FALSE(refused(radii));
  EXPECT_TRUE(refused({}));
  for (const std::int32_t out_of_range : {0, -1, kPositionLimit + 1}) {
    radii.front() = out_of_range;
    EXPECT_TRUE(refused(radii)) << out_of_range;
  }
  radii.front() = 1000;
  radii.push_back(1000);
  EXPECT_TRUE(refused(radii));
}

TEST_F(SessionTest, RadiiArePartOfTheLayoutHash) {
  auto session = server.session;
  session.streams[0].layout.groups = {"position", "orientation"};
  session.streams[0].layout.radii.assign(session.types.size(), 1000);
  rehash(session);
  session.streams[0].layout.radii.front() = 1001;
  const auto chosen = choose_stream(session);
  ASSERT_FALSE(chosen.has_value());
  EXPECT_EQ(chosen.error().code, ErrorCode::kMismatch);
}

/// The session with that stream's twin behind it, of id 1.
transport::SessionMessage with_second(transport::SessionMessage session) {
  session.streams.push_back(session.streams[0]);
  session.streams[1].id.id = session.streams[1].carries = 1;
  rehash(session);
  return session;
}

TEST_F(SessionTest, AnOfferCarriesTheFramesOfOneThatEncodesTheSame) {
  const auto refused = [this](auto change) {
    auto session = server.session;
    session.streams.push_back(session.streams[0]);
    session.streams[1].id.id = 1;
    session.streams[1].delay_ms = 200;
    change(session.streams);
    rehash(session);
    const auto playable = playable_streams(session);
    return playable ? std::string() : playable.error().message;
  };
  using Streams = std::vector<transport::StreamMessage>;
  EXPECT_EQ(refused([](Streams&) {}), "");
  const std::string why = "session refused: carries of stream 1";
  EXPECT_EQ(refused([](Streams& s) { s[1].carries = 7; }), why) << "there is no such stream";
  EXPECT_EQ(refused([](Streams& s) { s[1].id.generation = 1; }), why);
  EXPECT_EQ(refused([](Streams& s) { s[1].layout.parameters.codec.threshold += 1; }), why) << "another hash";
  EXPECT_NE(refused([](Streams& s) { s[0].carries = 1; }), "") << "neither encodes";
  EXPECT_EQ(refused([](Streams& s) {
              s.push_back(s[1]);
              s[2].id.id = 2;
              s[2].carries = 1;
            }),
            "session refused: carries of stream 2")
      << "what it carries does not encode";
}

TEST_F(SessionTest, AStreamGoesOnWhenAnotherIsAnnouncedBesideIt) {
  start();
  join();
  frame();
  port.sessions.push_back(from_server(with_second(server.session)));
  poll();
  frame();
  EXPECT_EQ(core->phase(), ClientPhase::kPlaying);
  EXPECT_EQ(core->stream()->id.id, 0U);
  EXPECT_EQ(figures().resyncs, 0U);
  EXPECT_EQ(figures().epochs, 1U);
  expect_agreed();
}

TEST_F(SessionTest, AStreamAskedForThatIsOnlyMeasuredIsToldSoOnce) {
  start();
  core->prefer("hard");
  join();
  const auto told = [this] {
    return std::count_if(log.begin(), log.end(), [](const std::string& line) {
      return line == "the stream that was asked for is measured, not offered";
    });
  };
  transport::ServerStatusMessage status;
  status.epoch = server.session.epoch;
  status.predictor = "hard";
  const auto hear = [&](std::uint32_t stream) {
    status.stream = stream;
    port.server_statuses.push_back(from_server(status));
    frame();
  };
  hear(0);
  EXPECT_EQ(told(), 0) << "it is offered, by another name";
  hear(1);
  hear(1);
  EXPECT_EQ(told(), 1);
}

TEST_F(SessionTest, AStreamThatVanishesIsLeftForWhatIsThere) {
  start();
  join();
  frame();
  auto other = with_second(server.session);
  other.streams.erase(other.streams.begin());
  port.sessions.push_back(from_server(other));
  poll();
  EXPECT_EQ(core->phase(), ClientPhase::kJoining);
  EXPECT_EQ(port.streams_open, (std::set<std::uint32_t>{1}));
  poll(200 * kMs);
  EXPECT_EQ(port.acks.back().stream.id, 1U);
  EXPECT_EQ(port.acks.back().phase, transport::Phase::kJoining);
}

TEST_F(SessionTest, AStreamThatVanishesWithoutAnotherIsARefusalUntilItIsBack) {
  start();
  join();
  auto none = server.session;
  none.streams[0].id.id = none.streams[0].carries = 1;
  none.streams[0].layout.codec = "of the future";
  rehash(none);
  port.sessions.push_back(from_server(none));
  poll();
  EXPECT_EQ(core->phase(), ClientPhase::kRefused);
  EXPECT_TRUE(port.streams_open.empty());
  port.sessions.push_back(from_server(server.session));
  poll();
  EXPECT_EQ(core->phase(), ClientPhase::kJoining);
}

TEST_F(SessionTest, AStreamThatVanishesWhileItIsJoinedIsGivenUp) {
  start();
  core->prefer("0");
  const auto one = server.session;
  server.session = with_second(one);
  join();
  frame();
  core->prefer("1");
  poll();
  poll(200 * kMs);
  EXPECT_EQ(port.acks.back().stream.id, 1U);
  EXPECT_EQ(port.acks.back().phase, transport::Phase::kJoining);
  EXPECT_EQ(port.acks.back().applied, server.frame()) << "it goes on playing meanwhile";
  port.sessions.push_back(from_server(one));
  poll();
  poll(200 * kMs);
  EXPECT_EQ(core->phase(), ClientPhase::kPlaying);
  EXPECT_EQ(port.streams_open, (std::set<std::uint32_t>{0}));
  EXPECT_EQ(port.acks.back().stream.id, 0U);
  EXPECT_EQ(port.acks.back().phase, transport::Phase::kPlaying);
}

TEST_F(SessionTest, AnotherAnnouncementInTheMiddleOfAChangeLetsItGoOn) {
  start();
  core->prefer("0");
  server.session = with_second(server.session);
  join();
  core->prefer("1");
  poll();
  poll();
  auto third = server.session;
  third.streams.push_back(third.streams[0]);
  third.streams[2].id.id = third.streams[2].carries = 2;
  rehash(third);
  port.sessions.push_back(from_server(third));
  for (int i = 0; i < 30; ++i) frame();
  EXPECT_EQ(port.streams_open, (std::set<std::uint32_t>{0, 1}));
  EXPECT_EQ(core->status().stream, "1") << "on its way";
  EXPECT_EQ(core->phase(), ClientPhase::kPlaying);
  expect_agreed();
}

TEST_F(SessionTest, ASilentServerEndsNoChange) {
  start();
  core->prefer("0");
  server.session = with_second(server.session);
  join();
  frame();
  core->prefer("1");
  for (int i = 0; i < 60; ++i) poll(500 * kMs);
  EXPECT_EQ(port.streams_open, (std::set<std::uint32_t>{0, 1}));
}

TEST_F(SessionTest, AChangeThatNobodyAnswersIsGivenUp) {
  start();
  core->prefer("0");
  server.session = with_second(server.session);
  join();
  core->prefer("1");
  poll();
  poll();
  EXPECT_EQ(port.streams_open, (std::set<std::uint32_t>{0, 1}));
  for (int i = 0; i < 11 * 30; ++i) frame();
  EXPECT_EQ(core->phase(), ClientPhase::kPlaying);
  EXPECT_EQ(core->stream()->id.id, 0U);
  EXPECT_EQ(port.streams_open, (std::set<std::uint32_t>{0}));
  EXPECT_EQ(figures().resyncs, 0U);
  expect_agreed();
}

TEST_F(SessionTest, ANewEpochEmptiesEverything) {
  join();
  for (int i = 0; i < 5; ++i) frame();
  const auto sent = core->send(transport::InputKind::kGravity, {0, -1, 0}, {}, {now_ns, wall_ns()});
  ASSERT_TRUE(sent.has_value());
  FakeServer next(999);  // lower than the one held, and new all the same
  port.sessions.push_back(from_server(next.session));
  deliver(server.advance());  // of the old epoch
  poll();
  EXPECT_EQ(core->phase(), ClientPhase::kJoining);
  EXPECT_EQ(port.opened_epochs.back(), 999U);
  EXPECT_EQ(port.acks.back().epoch, 999U);
  EXPECT_EQ(figures().resyncs, 0U);
  ASSERT_EQ(recorder.outcomes.size(), 1U);
  EXPECT_EQ(recorder.outcomes[0].kind, InputOutcome::Kind::kUnknown);

  deliver(next.advance());
  port.snapshots.push_back(from_server(next.snapshot()));
  poll(100 * kMs);
  EXPECT_EQ(core->phase(), ClientPhase::kPlaying);
  EXPECT_EQ(core->timeline()->hash(), next.hashes.at(1));
  EXPECT_EQ(figures().stale_messages, 1U);
  EXPECT_EQ(core->send(transport::InputKind::kGravity, {0, -1, 0}, {}, {now_ns, wall_ns()}).value(), 2U);
}

TEST_F(SessionTest, WhatCannotBePlayedIsPassedOverAndTheNextIsLookedAt) {
  start();
  FakeServer foreign(3000);
  foreign.session.streams[0].layout.codec = "morse";
  port.sessions.push_back({foreign.session, {{9}}});
  poll();
  EXPECT_EQ(core->phase(), ClientPhase::kRefused);
  EXPECT_EQ(port.passed_over, (std::vector{transport::PassOver::kUntilAnnouncedAnew}));
  foreign.session.epoch = server.session.epoch;  // as the forger could say
  port.sessions.push_back({foreign.session, {{9}}});
  poll();
  EXPECT_EQ(core->phase(), ClientPhase::kRefused);
  join();
}

TEST_F(SessionTest, ARefusedClientHoldsNoReaderOfAStream) {
  join();
  EXPECT_TRUE(!port.streams_open.empty());
  FakeServer foreign(3000);
  foreign.session.streams[0].layout.codec = "morse";
  port.sessions.push_back({foreign.session, {{9}}});
  poll();
  EXPECT_EQ(core->phase(), ClientPhase::kRefused);
  EXPECT_FALSE(!port.streams_open.empty()) << "what comes would not be taken, and end every wait at once";
}

TEST_F(SessionTest, AServerFromWhichNothingComesMakesRoomForAnother) {
  start();
  port.sessions.push_back(from_server(server.session));
  for (int i = 0; i < 240; ++i) poll(40 * kMs);
  EXPECT_TRUE(port.passed_over.empty());
  deliver(server.advance());
  for (int i = 0; i < 240; ++i) poll(40 * kMs);
  EXPECT_TRUE(port.passed_over.empty());
  for (int i = 0; i < 20; ++i) poll(40 * kMs);
  EXPECT_EQ(port.passed_over, (std::vector{transport::PassOver::kWhileThereIsAnother}));
  EXPECT_EQ(core->phase(), ClientPhase::kJoining);
}

TEST_F(SessionTest, AServerThatFallsSilentMakesRoomForItsSuccessorAlone) {
  join();
  for (int i = 0; i < 20; ++i) {
    poll(40 * kMs);
    deliver(server.advance());
  }
  EXPECT_FALSE(port.successor_wanted);
  for (int i = 0; i < 45; ++i) poll(40 * kMs);
  EXPECT_TRUE(port.successor_wanted);
  EXPECT_TRUE(port.passed_over.empty());
  EXPECT_EQ(core->phase(), ClientPhase::kPlaying);
}

TEST_F(SessionTest, JoinAttemptsGoOnOverServersSoThatNoneTakesOneForServed) {
  join();
  EXPECT_EQ(core->join_attempt(), 1U);
  FakeServer other(2000);
  std::swap(server, other);
  auto unplayable = server.session;
  unplayable.epoch = 1500;
  unplayable.streams[0].layout.codec = "unknown";
  port.sessions.push_back(from_server(unplayable));
  poll();
  join();
  EXPECT_EQ(core->join_attempt(), 2U);
  std::swap(server, other);
  join();
  EXPECT_EQ(core->join_attempt(), 3U);
  EXPECT_EQ(port.acks.back().join_attempt, 3U);
}

TEST_F(SessionTest, TheSameAnnouncementAgainChangesNothing) {
  join();
  port.sessions.push_back(from_server(server.session));
  frame();
  EXPECT_EQ(core->phase(), ClientPhase::kPlaying);
  EXPECT_EQ(figures().epochs, 1U);
}

TEST_F(SessionTest, SamplesOfAParticipantThatIsNotTheServerAreCountedAndIgnored) {
  join();
  auto forged = server.advance();
  port.deltas.push_back({forged, {{9, 9, 9}}});
  poll();
  EXPECT_EQ(figures().foreign_messages, 1U);
  EXPECT_EQ(core->timeline()->applied(), 1U);
  deliver(forged);
  poll();
  EXPECT_EQ(core->timeline()->applied(), 2U);
}

}  // namespace
}  // namespace tandem::client
