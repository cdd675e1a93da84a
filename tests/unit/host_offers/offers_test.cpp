// Streams that are offered in two delays.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "tests/unit/host_offers/streams_bench.hpp"

namespace tandem::host {
namespace {

using transport::Phase;

constexpr std::uint32_t kLate = 2;  // the other offer of `thin`

HostConfig with_offer(std::string name = "thin") {
  HostConfig config = two_streams();
  config.streams.push_back(config.streams[kThin]);
  config.streams[kLate].name = std::move(name);
  config.streams[kLate].delay_ms = 200;
  static std::int64_t clock_ns = 0;
  config.clock_ns = [] { return ++clock_ns; };
  return config;
}

struct OffersTest : ::testing::Test {
  StreamsBench test{with_offer()};
  Bench& bench = test.bench;

  /// One client plays without a delay, and another the offer with one.
  void play_both() {
    test.joining(1, kThin);
    test.joining(2, kLate);
    bench.run_ms(500);
    bench.on_ms = [this] {
      test.playing(1, kThin);
      test.playing(2, kLate);
    };
    bench.run_ms(100);
  }
  void tell_all() {
    bench.host->tell_collected_frames();
    bench.drained();
  }
};

TEST_F(OffersTest, AreAnnouncedAsOneStreamWithWritersOfTheirOwn) {
  const auto& streams = bench.host->session().streams;
  ASSERT_EQ(streams.size(), 3U);
  EXPECT_EQ(bench.port.open_stream_count, 3U);
  transport::StreamMessage late = streams[kThin];
  late.id.id = kLate;
  late.delay_ms = 200;
  EXPECT_EQ(streams[kLate], late) << "all else is the same";
  EXPECT_EQ(late.carries, kThin);
  EXPECT_EQ(streams[kRich].carries, kRich);
}

TEST_F(OffersTest, AreEncodedOnceAndToldTheSameFrames) {
  play_both();
  bool encoded = false;
  for (int i = 0; i < 3000; ++i) {
    bench.run_ms(1);
    const auto& deltas = bench.host->report().deltas;
    if (deltas.size() < 2) continue;
    ASSERT_EQ(deltas[1].stream, kLate);
    EXPECT_EQ(deltas[1].hash, deltas[0].hash);
    EXPECT_EQ(deltas[1].payload_bytes, deltas[0].payload_bytes);
    EXPECT_EQ(deltas[1].encode_ns + deltas[1].predict_ns, 0);
    encoded = encoded || deltas[0].encode_ns > 0;
  }
  EXPECT_TRUE(encoded);
  tell_all();
  EXPECT_TRUE(test.totals(kThin).made && test.totals(kLate).made);
  EXPECT_GT(test.deltas_of(kLate), 10U);
  EXPECT_LT(test.deltas_of(kLate) * 2, test.deltas_of(kThin));
  const ClientTimeline at_once = test.follow(kThin), late = test.follow(kLate);
  EXPECT_EQ(late.applied(), bench.host->frame());
  EXPECT_EQ(late.hash(), at_once.hash());
}

TEST_F(OffersTest, AStreamGoesOnWhoeverPlaysWhichOfThem) {
  play_both();
  const auto learned = bench.host->parameters(kThin);
  bench.on_ms = [this] { test.playing(2, kLate); };
  bench.port.dead.insert(participant(1));
  bench.run_ms(8000);
  EXPECT_FALSE(test.totals(kThin).made);
  EXPECT_TRUE(test.totals(kLate).made);
  EXPECT_EQ(bench.host->parameters(kThin), learned) << "of the stream, not of the offer";
  tell_all();
  EXPECT_EQ(test.follow(kLate).hash(), bench.host->hash());
}

TEST_F(OffersTest, AnIdleOneIsSaidToTakeWhatItsStreamTakes) {
  test.joining(2, kLate);
  bench.run_ms(500);
  bench.on_ms = [this] { test.playing(2, kLate); };
  bench.run_ms(8000);
  const auto last = [&](std::uint32_t stream) {
    const auto found = std::ranges::find(bench.port.statuses.rbegin(), bench.port.statuses.rend(), stream,
                                         &transport::ServerStatusMessage::stream);
    return *found;
  };
  EXPECT_EQ(last(kThin).observers + last(kThin).participants, 0U);
  EXPECT_EQ(last(kLate).participants, 1U);
  EXPECT_GT(last(kLate).mbit_per_s, 0);
  EXPECT_NEAR(last(kThin).mbit_per_s, last(kLate).mbit_per_s, 0.5 * last(kLate).mbit_per_s);
  EXPECT_EQ(last(kRich).mbit_per_s, 0) << "nothing is known of it";
}

TEST_F(OffersTest, AParticipantOfOneThatStallsIsDemotedAndTheOtherPlaysOn) {
  play_both();
  bench.on_ms = [this] { test.playing(1, kThin); };  // the other one is frozen
  const Frame before = bench.host->frame();
  bench.run_ms(4000);
  EXPECT_EQ(bench.host->totals().demotions, 1U);
  ASSERT_NE(bench.last_reply(2), nullptr);
  EXPECT_EQ(bench.last_reply(2)->role, transport::Role::kObserver);
  EXPECT_EQ(bench.last_reply(1)->role, transport::Role::kParticipant);
  EXPECT_GT(bench.host->frame(), before + 60);
}

TEST_F(OffersTest, WhoChangesFromOneToTheOtherIsServedASnapshotAndGoesOn) {
  play_both();
  const std::size_t before = test.snapshots_of(kLate);
  bench.on_ms = [this] {
    test.changing(1, kLate, 2);
    test.playing(2, kLate);
  };
  bench.run_ms(1000);
  EXPECT_GT(test.snapshots_of(kLate), before);
  EXPECT_EQ(test.totals(kThin).participants, 1U);
  bench.on_ms = [this] {
    test.playing(1, kLate, 2);
    test.playing(2, kLate);
  };
  bench.run_ms(1000);
  EXPECT_EQ(test.totals(kThin).participants, 0U);
  EXPECT_EQ(test.totals(kLate).participants, 2U);
  tell_all();
  EXPECT_EQ(test.follow(kLate).hash(), bench.host->hash());
}

TEST_F(OffersTest, ACheckpointHasEachStreamOnce) {
  play_both();
  bench.on_ms = [this] { test.playing(2, kLate); };
  checkpoint::Checkpoint taken;
  while (bench.host->frame_under_way()) bench.run_ms(1);
  bench.host->capture(taken);
  ASSERT_EQ(taken.streams.size(), 2U);
  EXPECT_EQ(taken.streams[kThin].name, "thin");
  EXPECT_EQ(taken.streams[kRich].name, "rich");
  EXPECT_EQ(taken.streams[kThin].parameters, bench.host->parameters(kLate));
}

TEST(Offers, OfOneStreamDifferInTheirDelayAlone) {
  const auto refusal = [](auto change) {
    HostConfig config = with_offer();
    change(config.streams);
    FakeSimulation simulation(4);
    FakePort port(participant(9));
    const auto made = Host::create(std::move(config), simulation, port);
    return made ? std::string("accepted") : made.error().message;
  };
  using Streams = std::vector<StreamConfig>;
  EXPECT_EQ(refusal([](Streams&) {}), "accepted");
  const std::string twice = "two streams are called 'thin': every stream needs a name of its own";
  EXPECT_EQ(refusal([](Streams& s) { s[kLate].delay_ms = 0; }), twice);
  EXPECT_EQ(refusal([](Streams& s) { s[kLate].budget = 500; }), twice);
  EXPECT_EQ(refusal([](Streams& s) {
              s.push_back(s[kLate]);
              s.back().delay_ms = 500;
            }),
            "stream 'thin' is offered in more than 2 delays");
  EXPECT_EQ(refusal([](Streams& s) { std::swap(s[kRich], s[kLate]); }),
            "offers that encode stand before those that carry their frames");
}

TEST(Offers, StreamsOfTwoNamesThatDifferInTheirDelayAloneAreEncodedOnceToo) {
  StreamsBench test(with_offer("late"));
  EXPECT_EQ(test.bench.host->session().streams[kLate].carries, kLate) << "it is a stream of its own";
  test.joining(1, kThin);
  test.joining(2, kLate);
  test.bench.run_ms(500);
  test.playing(1, kThin);
  test.playing(2, kLate);
  test.bench.run_ms(3000);
  test.bench.host->tell_collected_frames();
  test.bench.drained();
  EXPECT_EQ(test.bench.host->report().deltas[1].encode_ns, 0);
  EXPECT_LT(test.deltas_of(kLate) * 2, test.deltas_of(kThin));
  EXPECT_EQ(test.follow(kLate).hash(), test.follow(kThin).hash());
}

}  // namespace
}  // namespace tandem::host
