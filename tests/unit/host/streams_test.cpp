// Several streams of one world.
#include <gtest/gtest.h>

#include "tests/unit/host_offers/streams_bench.hpp"

namespace tandem::host {
namespace {

using transport::Phase;
using transport::Reason;
using transport::Role;

class StreamsTest : public StreamsBench, public ::testing::Test {
 protected:
  StreamsTest() : StreamsBench(two_streams()) {}
};

TEST_F(StreamsTest, AreAnnouncedWithTheirNamesAndWritersOfTheirOwn) {
  const auto& session = bench.host->session();
  ASSERT_EQ(session.streams.size(), 2U);
  EXPECT_EQ(session.streams[kThin].layout.codec, "selective");
  EXPECT_EQ(session.streams[kRich].layout.codec, "tracker");
  EXPECT_EQ(session.streams[kRich].id, (StreamId{kRich, 0}));
  EXPECT_EQ(session.streams[kThin].name, "thin");
  EXPECT_EQ(session.streams[kRich].name, "rich");
  EXPECT_EQ(session.scene_json, "");
  EXPECT_EQ(bench.port.open_stream_count, 2U);
}

TEST_F(StreamsTest, OneThatNobodyPlaysIsNotMade) {
  bench.run_ms(3000);
  EXPECT_EQ(deltas_of(kRich), 0U);
  EXPECT_EQ(totals(kRich).frames, 0U);
  EXPECT_FALSE(totals(kRich).made);
  joining(1, kRich);
  bench.port.unmatched.insert(participant(1));
  bench.run_ms(1000);
  EXPECT_EQ(deltas_of(kRich), 0U) << "nor for one who cannot be served yet";
}

TEST_F(StreamsTest, TheFirstIsMadeAsIfItWereAlone) {
  Bench alone;
  alone.simulation.on_step = [&](std::uint64_t step) {
    for (std::size_t body = 0; body < alone.simulation.alive.size(); ++body)
      alone.simulation.position[1][body] += 0.05F * static_cast<float>((step + body) % 7) - 0.15F;
    if (step % 11 == 0) alone.simulation.alive[3] ^= 1U;
  };
  alone.run_to(100);
  bench.enter(2);
  joining(1, kRich);
  bench.on_ms = [this] { bench.playing(2, bench.host->frame()); };
  while (bench.host->frame() < 100) bench.run_ms(1);
  EXPECT_GT(deltas_of(kRich), 0U);
  std::size_t at = 0;
  for (const auto& delta : bench.port.deltas) {
    if (delta.stream.id != kThin) continue;
    EXPECT_EQ(delta.hash, alone.port.deltas.at(at).hash) << delta.frame;
    EXPECT_EQ(delta.payload, alone.port.deltas.at(at).payload);
    ++at;
  }
  EXPECT_EQ(at, 100U);
}

// It is begun anew in the middle: of the bodies, their slots, the drive in force and the inputs still to act.
TEST_F(StreamsTest, WhoJoinsAnIdleOneWhileInputsWaitToActFollowsItForHundredsOfFrames) {
  bench.enter(2);
  std::uint64_t number = 0;
  bench.on_ms = [&] {
    bench.playing(2, bench.host->frame());
    if (bench.now / kMillisecond % 20 == 0) {
      ++number;
      bench.send(bench.gravity(2, number, -1 - static_cast<double>(number % 9)));
    }
  };
  bench.run_ms(2000);
  joining(1, kRich);
  bench.run_ms(200);
  ASSERT_EQ(snapshots_of(kRich), 1U);
  const Frame cut = bench.port.snapshots.back().frame;
  EXPECT_GT(cut, 50U);
  auto ack = bench.on_ms;
  bench.on_ms = [&] {
    ack();
    playing(1, kRich);
  };
  bench.run_ms(20'000);
  EXPECT_GT(number, 500U);
  const ClientTimeline client = follow(kRich);
  EXPECT_EQ(client.applied(), bench.host->frame());
  EXPECT_GT(client.applied(), cut + 500);
  const State& rich = client.state(client.applied());
  EXPECT_TRUE(std::ranges::equal(rich.reuse(), bench.host->agreed().reuse())) << "slots are those of all";
  EXPECT_TRUE(std::ranges::equal(rich.alive(), bench.host->agreed().alive()));
  EXPECT_EQ(bench.host->first_made(), kThin);
}

TEST_F(StreamsTest, OneThatBeginsInAWorldUnderWayHasSlowBodiesAtRest) {
  bench.simulation.on_step = [](std::uint64_t /*step*/) {};  // they stand, whatever gravity says
  bench.simulation.rests = true;
  bench.run_to(20);
  joining(7, kRich);
  bench.run_to(30);
  ASSERT_EQ(snapshots_of(kRich), 1U);
  const ClientTimeline client = follow(kRich);
  const State& state = client.state(client.applied());
  EXPECT_GT(state.alive_count(), 0U);
  EXPECT_EQ(state.rest_count(), state.alive_count());
}

TEST_F(StreamsTest, OneEndsFiveSecondsAfterItsLastPlayerAndComesBack) {
  joining(1, kRich);
  bench.run_ms(200);
  bench.on_ms = [this] { playing(1, kRich); };
  bench.run_ms(6000);
  EXPECT_TRUE(totals(kRich).made);
  EXPECT_FALSE(totals(kThin).made) << "whom nobody plays";
  EXPECT_EQ(bench.host->first_made(), kRich);
  bench.on_ms = {};
  bench.port.dead.insert(participant(1));
  bench.port.gone.insert(participant(1));
  bench.run_ms(4500);
  EXPECT_TRUE(totals(kRich).made) << "for a while";
  bench.run_ms(1500);
  EXPECT_FALSE(totals(kRich).made);
  EXPECT_TRUE(totals(kThin).made) << "a session has an agreed state";
  const std::size_t made = deltas_of(kRich);
  bench.run_ms(2000);
  EXPECT_EQ(deltas_of(kRich), made);
  joining(2, kRich);
  bench.run_ms(200);
  bench.on_ms = [this] { playing(2, kRich); };
  bench.run_ms(3000);
  EXPECT_EQ(follow(kRich).applied(), bench.host->frame());
}

TEST_F(StreamsTest, WhoChangesGoesOnPlayingUntilItPlaysTheOther) {
  bench.enter(1);
  bench.run_ms(100);
  bench.on_ms = [this] { changing(1, kRich, 2); };
  bench.run_ms(1000);
  EXPECT_EQ(bench.last_reply(1)->phase, Phase::kPlaying);
  EXPECT_EQ(bench.last_reply(1)->role, Role::kParticipant);
  EXPECT_EQ(bench.host->participants(), 1U);
  EXPECT_EQ(totals(kThin).participants, 1U);
  EXPECT_GE(snapshots_of(kRich), 1U);
  EXPECT_EQ(totals(kRich).snapshots, 1U);
  EXPECT_TRUE(totals(kThin).made && totals(kRich).made) << "both meanwhile";
  bench.send(bench.gravity(1, 1));
  bench.run_ms(100);
  EXPECT_EQ(bench.refusal(1, 1), Reason::kNone);
  bench.on_ms = {};
  const Frame waits_at = bench.host->frame();
  bench.run_ms(300);
  EXPECT_LE(bench.host->frame(), waits_at + bench.host->window() + 1) << "it is waited for";
  bench.on_ms = [this] { playing(1, kRich, 2); };
  bench.run_ms(200);
  EXPECT_EQ(totals(kThin).participants, 0U);
  EXPECT_EQ(totals(kRich).participants, 1U);
  bench.run_ms(6000);
  EXPECT_FALSE(totals(kThin).made);
  EXPECT_EQ(bench.host->totals().snapshots, 1U) << "nobody waited for the first";
}

TEST_F(StreamsTest, WhoGivesUpAChangeIsWhereItWas) {
  bench.enter(1);
  bench.on_ms = [this] { changing(1, kRich, 2); };
  bench.run_ms(500);
  bench.on_ms = [this] { playing(1, kThin, 2); };
  bench.run_ms(500);
  EXPECT_EQ(totals(kThin).participants, 1U);
  EXPECT_EQ(totals(kRich).participants + totals(kRich).observers, 0U);
  bench.run_ms(6000);
  EXPECT_FALSE(totals(kRich).made);
}

// Its `playing` of the other stream was overwritten by the question for its way back.
TEST_F(StreamsTest, WhoChangesBackBeforeItWasHeardToPlayTheOtherKeepsItsSeat) {
  bench.enter(1);
  bench.on_ms = [this] { changing(1, kRich, 2); };
  bench.run_ms(500);
  const std::size_t before = snapshots_of(kThin);
  bench.on_ms = [this] { changing(1, kThin, 3); };
  bench.run_ms(1000);
  EXPECT_EQ(bench.last_reply(1)->phase, Phase::kPlaying);
  EXPECT_EQ(bench.last_reply(1)->role, Role::kParticipant);
  EXPECT_EQ(totals(kRich).participants, 1U);
  EXPECT_EQ(totals(kThin).participants, 0U);
  EXPECT_GT(snapshots_of(kThin), before);
  bench.on_ms = [this] { playing(1, kThin, 3); };
  bench.run_ms(500);
  EXPECT_EQ(totals(kThin).participants, 1U);
  EXPECT_EQ(totals(kRich).participants, 0U);
}

TEST_F(StreamsTest, AChangeWithANonsensicalAppliedIsRefusedAndChangesNothing) {
  bench.enter(1);
  bench.send(ack_of(1, kRich, Phase::kJoining, bench.host->frame() + 1000, 2));
  const auto refused = bench.host->totals().refused_messages;
  bench.poll();
  EXPECT_EQ(bench.host->totals().refused_messages, refused + 1);
  bench.run_ms(60);
  EXPECT_EQ(snapshots_of(kRich), 0U);
  EXPECT_EQ(totals(kThin).participants, 1U);
}

TEST_F(StreamsTest, AStreamOrGenerationThatIsNotThereIsAnsweredSo) {
  bench.enter(1);
  bench.run_ms(50);
  for (const StreamId missing : {StreamId{2, 0}, StreamId{UINT32_MAX, 0}, StreamId{kRich, 1}}) {
    const auto refused = bench.host->totals().refused_messages;
    for (const transport::ClientId client : {1U, 2U}) {
      auto ack = ack_of(client, 0, Phase::kJoining, bench.host->frame(), 5);
      ack.stream = missing;
      bench.send(ack);
    }
    bench.run_ms(1100);
    EXPECT_EQ(bench.host->totals().refused_messages, refused + 2);
    EXPECT_EQ(bench.host->totals().streams.size(), 2U);
    bool known = false, stranger = false;
    for (const auto& reply : bench.port.replies) {
      if (reply.reason != static_cast<std::uint32_t>(Reason::kNoStream)) continue;
      known = known || reply.client == 1;
      stranger = stranger || reply.client == 2;
    }
    EXPECT_TRUE(known && stranger);
    bench.port.replies.clear();
    playing(1, kThin);
  }
  EXPECT_EQ(bench.host->totals().clients_seen, 1U) << "no account for it";
}

TEST_F(StreamsTest, WhoFlapsAsFastAsItCanCostsTheOthersNothing) {
  bench.enter(2);
  std::uint32_t attempt = 1;
  bench.on_ms = [&] {
    bench.playing(2, bench.host->frame());
    ++attempt;
    const bool rich = attempt % 2 == 0;
    bench.port.acks.push_back(
        {ack_of(1, rich ? kRich : kThin, attempt % 3 == 0 ? Phase::kPlaying : Phase::kJoining,
                attempt % 5 == 0 ? 0 : bench.host->frame(), attempt),
         participant(1)});
  };
  const Frame before = bench.host->frame();
  bench.run_ms(20'000);
  EXPECT_NEAR(static_cast<double>(bench.host->frame() - before), 600, 3);
  EXPECT_LE(bench.host->totals().snapshots, 1 + 1 + 4 + 10U);
  EXPECT_GE(bench.host->participants(), 1U);
}

TEST_F(StreamsTest, HaveAStatusEachAndAnIdleOneKeepsWhatItLastCost) {
  const auto last = [this](std::uint32_t stream) {
    for (auto status = bench.port.statuses.rbegin(); status != bench.port.statuses.rend(); ++status)
      if (status->stream == stream) return *status;
    return transport::ServerStatusMessage{};
  };
  bench.run_ms(1500);
  EXPECT_EQ(last(kThin).codec, "selective");
  EXPECT_EQ(last(kRich).codec, "tracker");
  EXPECT_GT(last(kThin).mbit_per_s, 0);
  EXPECT_EQ(last(kRich).mbit_per_s, 0);
  EXPECT_GT(last(kRich).threshold, 0);
  joining(1, kRich);
  bench.run_ms(200);
  bench.on_ms = [this] { playing(1, kRich); };
  bench.run_ms(3000);
  EXPECT_EQ(last(kRich).participants, 1U);
  EXPECT_EQ(last(kThin).participants, 0U);
  EXPECT_GT(last(kRich).mbit_per_s, 0);
  bench.run_ms(6000);
  EXPECT_FALSE(totals(kThin).made);
  EXPECT_GT(last(kThin).mbit_per_s, 0) << "of the last second in which it was made";
}

TEST_F(StreamsTest, ThatTheConfigurationGetsWrongAreRefusedByName) {
  const auto refusal = [](auto&& change) {
    HostConfig config = two_streams();
    change(config.streams);
    FakeSimulation simulation(4);
    FakePort port(participant(0xAA));
    const auto host = Host::create(std::move(config), simulation, port);
    return host ? std::string("accepted") : host.error().message;
  };
  using Streams = std::vector<StreamConfig>;
  EXPECT_NE(refusal([](Streams& s) { s[1].name = "thin"; }).find("two streams are called 'thin'"),
            std::string::npos);
  for (const char* name : {"", "Rich", "a b", "a/1", "012345678901234567890123456789012"})
    EXPECT_NE(refusal([name](Streams& s) { s[1].name = name; }).find("a stream's name has"),
              std::string::npos);
  for (const char* name : {"auto", "bandwidth", "computing", "error"})
    EXPECT_NE(refusal([name](Streams& s) { s[1].name = name; }).find("cannot be called"), std::string::npos);
  EXPECT_NE(refusal([](Streams& s) {
              for (int i = 2; i < 9; ++i) {
                s.push_back(s[0]);
                s.back().name = std::to_string(i);
              }
            }).find("1 to 8 streams, not 9"),
            std::string::npos);
  EXPECT_NE(refusal([](Streams& s) { s.clear(); }).find("not 0"), std::string::npos);
  EXPECT_NE(refusal([](Streams& s) { s[1].lattice.unit *= 2; }).find("the same lattice"), std::string::npos);
  EXPECT_NE(refusal([](Streams& s) { s[1].layout.lead = 0; }).find("the same lead"), std::string::npos);
  EXPECT_NE(refusal([](Streams& s) { s[1].layout.codec = "morse"; }).find("stream rich: "),
            std::string::npos);
}

// One of two streams lists positions alone.
TEST(StreamsThatTurn, ShareSlotsWithOneThatHasPositionsAlone) {
  HostConfig config = turning_config();
  config.streams.push_back(config.streams[0]);
  config.streams[0].name = "turning";
  config.streams[1].name = "flat";
  config.streams[1].layout.codec = "selective";
  config.streams[1].layout.groups = {kPositionGroup};
  config.streams[1].layout.radii.clear();
  Bench bench(config);
  bench.poll();
  bench.run_to(5);
  auto ack = bench.ack(1, Phase::kJoining, 0);
  ack.stream.id = 1;
  bench.send(ack);
  bench.run_ms(200);
  ASSERT_FALSE(bench.port.snapshots.empty());
  auto client = ClientTimeline::create(bench.host->session().streams[1].layout);
  ASSERT_TRUE(client);
  const auto cut = bench.port.snapshots.back();
  ASSERT_TRUE(client->load(cut.bytes, bench.host->session().epoch, cut.stream));
  bench.on_ms = [&] {
    auto playing = bench.ack(1, Phase::kPlaying, bench.host->frame());
    playing.stream.id = 1;
    bench.send(playing);
  };
  bench.simulation.on_step = [&](std::uint64_t step) {
    bench.simulation.events_now = {{.kind = engine::Event::Kind::kTeleported, .slot = 1}};
    bench.simulation.position[0][1] = static_cast<float>(step % 3);
  };
  bench.run_ms(1000);
  for (const auto& delta : bench.port.deltas) {
    if (delta.stream.id != 1 || delta.frame <= cut.frame) continue;
    const auto applied = client->apply(delta.frame, delta.last_input, delta.hash, delta.payload);
    ASSERT_TRUE(applied) << applied.error().message;
  }
  EXPECT_EQ(client->applied(), bench.host->frame());
}

}  // namespace
}  // namespace tandem::host
