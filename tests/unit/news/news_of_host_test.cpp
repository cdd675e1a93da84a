// Keys and events that the application of a server tells.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "sdk/wire/frame_bundle.hpp"
#include "services/host/checkpoint/format.hpp"
#include "services/host/frames/roll_forward.hpp"
#include "services/host/news/news_desk.hpp"
#include "tests/unit/host/fakes.hpp"

namespace tandem::host::of_news {
namespace {

using ::testing::HasSubstr;

constexpr WorldFeatures kBoth{.keys = true, .events = true};

HostConfig news_config() {
  HostConfig config = test_config();
  config.streams[0].layout.world = kBoth;
  return config;
}

std::span<const std::byte> bytes(std::string_view text) { return std::as_bytes(std::span(text)); }

struct ToldEvent {
  Frame frame = 0;
  std::uint32_t kind = 0;
  std::optional<WorldEvent::Body> body;
  std::size_t size = 0;
};

// What the deltas tell, of sessions whose every delta is one frame.
std::vector<ToldEvent> events_told(const FakePort& port) {
  std::vector<ToldEvent> told;
  for (const transport::DeltaMessage& delta : port.deltas) {
    News news;
    EXPECT_TRUE(read_news(delta.payload, kBoth, 4, news));
    for (const WorldEvent& event : news.events)
      told.push_back({delta.frame, event.kind, event.body, event.bytes.size()});
  }
  return told;
}
std::vector<std::string> keys_told(const FakePort& port, Frame frame) {
  std::vector<std::string> told;
  for (const transport::DeltaMessage& delta : port.deltas) {
    if (delta.frame != frame) continue;
    News news;
    EXPECT_TRUE(read_news(delta.payload, kBoth, 4, news));
    for (const KeyChange& change : news.keys)
      told.push_back(std::string(change.key) +
                     (change.value ? "=" + std::to_string(change.value->size()) : "-"));
  }
  return told;
}

TEST(NewsOfAHost, ASessionWithoutFeaturesHasNone) {
  Bench bench;
  bench.poll();
  EXPECT_EQ(bench.host->news(), nullptr);
  EXPECT_TRUE(bench.host->session().features.empty());
}

TEST(NewsOfAHost, AreAnnouncedAndToldOnTheNextFrame) {
  Bench bench(news_config());
  bench.poll();
  EXPECT_EQ(bench.port.sessions.back().features, (std::vector<std::string>{"events", "keys"}));
  bench.run_to(3);
  NewsDesk& news = *bench.host->news();
  ASSERT_TRUE(news.set_key("score", bytes("12")));
  ASSERT_TRUE(news.broadcast(7, bytes("goal"), 2));
  ASSERT_TRUE(news.broadcast(8, {}, {}));
  bench.run_to(5);
  EXPECT_EQ(keys_told(bench.port, 4), std::vector<std::string>{"score=2"});
  EXPECT_TRUE(keys_told(bench.port, 5).empty());
  const auto events = events_told(bench.port);
  ASSERT_EQ(events.size(), 2U);
  EXPECT_EQ(events[0].frame, 4U);
  EXPECT_EQ(events[0].kind, 7U);
  EXPECT_EQ(events[0].body, (WorldEvent::Body{2, 0}));
  EXPECT_EQ(events[0].size, 4U);
  EXPECT_EQ(events[1].kind, 8U);
  EXPECT_FALSE(events[1].body);
  EXPECT_EQ(news.world().event_count(), 2U);
}

TEST(NewsOfAHost, OfTheSimulationsStepAreOfItsFrame) {
  for (const bool pipeline : {false, true}) {
    HostConfig config = news_config();
    config.pipeline = pipeline;
    Bench bench(std::move(config));
    bench.simulation.on_step = [&](std::uint64_t step) {
      EXPECT_TRUE(bench.host->news()->broadcast(static_cast<std::uint32_t>(step), {}, {}));
    };
    bench.poll();
    bench.run_to(20);
    const auto events = events_told(bench.port);
    ASSERT_EQ(events.size(), 20U);
    for (const ToldEvent& event : events) EXPECT_EQ(event.kind, event.frame);
  }
}

TEST(NewsOfAHost, ThatTheSimulationTellsAfterAStepAreOfItsFrame) {
  for (const bool pipeline : {false, true}) {
    HostConfig config = news_config();
    config.pipeline = pipeline;
    Bench bench(std::move(config));
    bench.simulation.on_tell = [](std::uint64_t step, engine::StepNews& news) {
      EXPECT_TRUE(news.broadcast(static_cast<std::uint32_t>(step), bytes("x"), 2));
      if (step == 3) {
        EXPECT_TRUE(news.set_key("step", bytes("33")));
      }
      if (step == 5) {
        EXPECT_TRUE(news.remove_key("step"));
      }
    };
    bench.poll();
    bench.run_to(20);
    const auto events = events_told(bench.port);
    ASSERT_EQ(events.size(), 20U);
    for (const ToldEvent& event : events) EXPECT_EQ(event.kind, event.frame);
    EXPECT_EQ(events[0].body, (WorldEvent::Body{2, 0}));
    EXPECT_EQ(keys_told(bench.port, 3), std::vector<std::string>{"step=2"});
    EXPECT_EQ(keys_told(bench.port, 5), std::vector<std::string>{"step-"});
  }
}

TEST(NewsOfAHost, ASimulationIsNotAskedIfTheSessionHasNone) {
  Bench bench;
  bench.simulation.on_tell = [](std::uint64_t, engine::StepNews&) { ADD_FAILURE(); };
  bench.poll();
  bench.run_to(3);
}

TEST(NewsOfAHost, OfASimulationThatBreakALimitAreCountedAndNamed) {
  Bench bench(news_config());
  bench.simulation.on_tell = [](std::uint64_t step, engine::StepNews& news) {
    if (step != 1) return;
    EXPECT_FALSE(news.set_key("two\nlines", {}));
    EXPECT_FALSE(news.remove_key(""));
    for (int i = 0; i < 1024; ++i) ASSERT_TRUE(news.broadcast(1, {}, {}));
    EXPECT_FALSE(news.broadcast(2, {}, {}));
  };
  bench.poll();
  bench.run_to(2);
  EXPECT_THAT(bench.host->take_warnings(),
              ::testing::Contains(
                  "3 keys or events of the simulation were refused since its start; the last: event of "
                  "kind 2 in frame 1: 1,024 events wait already for frames that have room"));
  bench.run_to(30);
  EXPECT_EQ(events_told(bench.port).size(), 1024U);
}

TEST(NewsOfAHost, AKeyIsToldOnceAFrameAndOnlyIfItChanged) {
  Bench bench(news_config());
  bench.poll();
  NewsDesk& news = *bench.host->news();
  ASSERT_TRUE(news.set_key("a", bytes("1")));
  ASSERT_TRUE(news.set_key("a", bytes("22")));
  ASSERT_TRUE(news.set_key("b", bytes("1")));
  ASSERT_TRUE(news.remove_key("b"));
  ASSERT_TRUE(news.remove_key("c"));
  bench.run_to(2);
  EXPECT_EQ(keys_told(bench.port, 2), std::vector<std::string>{"a=2"});
  ASSERT_TRUE(news.set_key("a", bytes("22")));
  bench.run_to(3);
  EXPECT_TRUE(keys_told(bench.port, 3).empty());
  ASSERT_TRUE(news.remove_key("a"));
  bench.run_to(4);
  EXPECT_EQ(keys_told(bench.port, 4), std::vector<std::string>{"a-"});
}

TEST(NewsOfAHost, MoreEventsThanAFrameHoldsWaitInOrder) {
  Bench bench(news_config());
  bench.poll();
  NewsDesk& news = *bench.host->news();
  for (std::uint32_t i = 0; i < 100; ++i) ASSERT_TRUE(news.broadcast(i, {}, {}));
  bench.run_to(3);
  const auto few = events_told(bench.port);
  ASSERT_EQ(few.size(), 100U);
  for (std::uint32_t i = 0; i < 100; ++i) {
    EXPECT_EQ(few[i].kind, i);
    EXPECT_EQ(few[i].frame, few[0].frame + (i < 64 ? 0 : 1));
  }
  bench.port.deltas.clear();
  for (std::uint32_t i = 0; i < 20; ++i)
    ASSERT_TRUE(news.broadcast(i, std::vector<std::byte>(kMaxEventBytes), {}));
  bench.run_to(6);
  const auto large = events_told(bench.port);
  ASSERT_EQ(large.size(), 20U);
  EXPECT_EQ(large[14].frame, large[0].frame);
  EXPECT_EQ(large[15].frame, large[0].frame + 1);  // 16 KiB with their headers are 15
}

TEST(NewsOfAHost, AnEventIsAboutTheBodyOfItsFrameAlsoIfThatIsGone) {
  Bench bench(news_config());
  bench.poll();
  bench.run_to(1);
  NewsDesk& news = *bench.host->news();
  bench.simulation.alive[1] = 0;
  ASSERT_TRUE(news.broadcast(1, {}, 1));
  bench.run_to(2);
  bench.simulation.alive[1] = 1;
  ASSERT_TRUE(news.broadcast(2, {}, 1));
  bench.run_to(3);
  const auto events = events_told(bench.port);
  ASSERT_EQ(events.size(), 2U);
  EXPECT_EQ(events[0].body, (WorldEvent::Body{1, 0}));
  EXPECT_EQ(events[1].body, (WorldEvent::Body{1, 1}));
}

TEST(NewsOfAHost, AreRefusedByNameBeyondTheirLimits) {
  Bench bench(news_config());
  bench.poll();
  NewsDesk& news = *bench.host->news();
  const auto code = [](const Result<void>& result) {
    return result ? std::optional<ErrorCode>() : result.error().code;
  };
  EXPECT_EQ(code(news.set_key("", {})), ErrorCode::kInvalidArgument);
  EXPECT_EQ(code(news.set_key("two\nlines", {})), ErrorCode::kInvalidArgument);
  EXPECT_EQ(code(news.set_key(std::string(65, 'k'), {})), ErrorCode::kInvalidArgument);
  EXPECT_EQ(code(news.remove_key("\x7f")), ErrorCode::kInvalidArgument);
  for (int i = 0; i < 256; ++i) ASSERT_TRUE(news.set_key("k" + std::to_string(i), {}));
  EXPECT_EQ(code(news.set_key("one more", {})), ErrorCode::kCapacity);
  EXPECT_TRUE(news.set_key("k7", bytes("again")));
  EXPECT_EQ(code(news.set_key("k7", std::vector<std::byte>(65'536))), ErrorCode::kCapacity);
  bench.run_to(1);
  EXPECT_EQ(code(news.set_key("one more", {})), ErrorCode::kCapacity);
  ASSERT_TRUE(news.remove_key("k7"));
  EXPECT_TRUE(news.set_key("one more", {}));
  bench.run_to(2);
  EXPECT_EQ(news.world().keys().size(), 256U);

  EXPECT_EQ(code(news.broadcast(kFirstReservedKind, {}, {})), ErrorCode::kInvalidArgument);
  EXPECT_EQ(code(news.broadcast(1, {}, 4)), ErrorCode::kInvalidArgument);
  EXPECT_EQ(code(news.broadcast(1, std::vector<std::byte>(1025), {})), ErrorCode::kInvalidArgument);
  for (int i = 0; i < 1024; ++i) ASSERT_TRUE(news.broadcast(1, {}, {}));
  const auto full = news.broadcast(1, {}, {});
  ASSERT_FALSE(full);
  EXPECT_EQ(full.error().code, ErrorCode::kCapacity);
  EXPECT_THAT(full.error().message, HasSubstr("1,024"));
  bench.run_to(3);
  EXPECT_TRUE(news.broadcast(1, {}, {}));
}

TEST(NewsOfAHost, OneFeatureDoesNotBringTheOther) {
  NewsDesk keys({.keys = true, .events = false}, 4), events({.keys = false, .events = true}, 4);
  EXPECT_EQ(keys.broadcast(1, {}, {}).error().code, ErrorCode::kUnsupported);
  EXPECT_EQ(events.set_key("a", {}).error().code, ErrorCode::kUnsupported);
  EXPECT_EQ(events.remove_key("a").error().code, ErrorCode::kUnsupported);
}

TEST(NewsOfAHost, AFrameWithAnEventIsNotCollectedTenTimesASecondAtMost) {
  HostConfig config = news_config();
  config.streams[0].delay_ms = 1000;
  Bench bench(std::move(config));
  bench.poll();
  bench.run_to(60);
  bench.port.deltas.clear();
  ASSERT_TRUE(bench.host->news()->broadcast(1, {}, {}));
  bench.run_to(61);
  ASSERT_EQ(bench.port.deltas.size(), 1U);
  EXPECT_EQ(bench.port.deltas.back().frame, 61U);
  for (Frame frame = 62; frame <= 91; ++frame) {
    ASSERT_TRUE(bench.host->news()->broadcast(1, {}, {}));
    bench.run_to(frame);
  }
  EXPECT_LE(bench.port.deltas.size(), 1U + 10U);
  EXPECT_GE(bench.port.deltas.size(), 1U + 7U);
}

TEST(NewsOfAHost, AKeyAloneMayBeCollected) {
  HostConfig config = news_config();
  config.streams[0].delay_ms = 1000;
  Bench bench(std::move(config));
  bench.poll();
  bench.run_to(60);
  bench.port.deltas.clear();
  ASSERT_TRUE(bench.host->news()->set_key("a", {}));
  bench.run_to(61);
  EXPECT_TRUE(bench.port.deltas.empty());
}

TEST(NewsOfAHost, AllStreamsTellTheSameNewsAndOneThatBeginsLaterHasTheKeys) {
  HostConfig config = news_config();
  config.streams[0].name = "one";
  config.streams.push_back(config.streams[0]);
  config.streams[1].name = "two";
  config.streams[1].layout.codec = "none";
  Bench bench(std::move(config));
  bench.poll();
  NewsDesk& news = *bench.host->news();
  ASSERT_TRUE(news.set_key("early", bytes("1")));
  ASSERT_TRUE(news.broadcast(1, {}, {}));
  bench.run_to(5);
  // The other begins with a client that joins it; somebody plays the first.
  bench.enter(8);
  auto join = bench.ack(9, transport::Phase::kJoining, 0);
  join.stream.id = 1;
  bench.send(join);
  for (int i = 0; i < 30 && bench.port.snapshots.empty(); ++i) bench.run_to(bench.host->frame() + 1);
  ASSERT_FALSE(bench.port.snapshots.empty());
  const transport::SnapshotMessage& snapshot = bench.port.snapshots.back();
  ASSERT_EQ(snapshot.parts, 1U);
  auto client = *ClientTimeline::create(bench.host->session().streams[1].layout);
  ASSERT_TRUE(client.load(snapshot.bytes, snapshot.epoch, snapshot.stream));
  EXPECT_EQ(client.world()->keys().size(), 1U);
  EXPECT_EQ(client.world()->event_count(), 1U);
  ASSERT_TRUE(news.broadcast(2, bytes("both"), {}));
  bench.port.deltas.clear();
  const Frame before = bench.host->frame();
  bench.run_to(before + 2);
  EXPECT_EQ(events_told(bench.port).size(), 2U);  // one in each stream
}

/// A server with a checkpoint of frame 3, in which 6 of 70 events and a key wait, and with a standby.
class NewsThatGoOn : public ::testing::Test {
 protected:
  NewsThatGoOn() {
    bench.simulation.rests = true;
    bench.poll();
    transport::StandbyMessage standby;
    standby.standby = 5;
    standby.epoch = bench.host->session().epoch;
    bench.port.standbys.push_back({standby, participant(0x55)});
    bench.run_to(2);
    NewsDesk& news = *bench.host->news();
    EXPECT_TRUE(news.set_key("a", bytes("1")));
    for (std::uint32_t i = 1; i <= 70; ++i) EXPECT_TRUE(news.broadcast(i, bytes("x"), 3));
    bench.run_to(3);
    EXPECT_TRUE(news.set_key("b", bytes("2")));
    EXPECT_TRUE(news.remove_key("a"));
    checkpoint::Checkpoint world;
    bench.host->capture(world);
    std::vector<std::byte> file;
    EXPECT_TRUE(checkpoint::encode(world, file));
    from = *checkpoint::decode(file);
    bench.port.journal.clear();
  }
  static HostConfig config_of(checkpoint::Checkpoint world) {
    HostConfig config = news_config();
    config.epoch += 1000;
    config.goes_on_from = std::make_shared<const checkpoint::Checkpoint>(std::move(world));
    return config;
  }

  Bench bench{news_config()};
  checkpoint::Checkpoint from;
};

TEST_F(NewsThatGoOn, FromACheckpointWithAllThatWaited) {
  Bench next(config_of(from));
  EXPECT_EQ(next.host->news()->world().event_count(), 64U);
  next.poll();
  next.run_to(4);
  const auto events = events_told(next.port);
  ASSERT_EQ(events.size(), 6U);
  EXPECT_EQ(events[0].kind, 65U);
  EXPECT_EQ(events[0].body, (WorldEvent::Body{3, 0}));
  EXPECT_EQ(keys_told(next.port, 4), (std::vector<std::string>{"a-", "b=1"}));
  EXPECT_EQ(next.host->news()->world().event_count(), 70U);
}

TEST_F(NewsThatGoOn, FromTheJournalWithoutTellingAnythingTwice) {
  ASSERT_TRUE(bench.host->news()->broadcast(71, {}, {}));
  bench.run_to(5);
  FakeSimulation simulation(4);
  simulation.rests = true;
  HostConfig config = news_config();
  config.streams[0].layout.capacity = 4;
  const auto world = roll_forward(config, simulation, from, bench.port.journal);
  ASSERT_TRUE(world) << world.error().message;
  Bench next(config_of(*world));
  next.poll();
  EXPECT_EQ(next.host->news()->world().event_count(), 71U);
  EXPECT_EQ(next.host->news()->world().hash(), bench.host->news()->world().hash());
  next.run_to(7);
  EXPECT_TRUE(events_told(next.port).empty());
  EXPECT_TRUE(keys_told(next.port, 6).empty());
}

// The standby's simulation makes the same steps, and what did not fit into their frames waits there as well.
TEST_F(NewsThatGoOn, FromTheJournalWithWhatTheSimulationToldAndNoFrameHeld) {
  const auto tells = [](std::uint64_t step, engine::StepNews& news) {
    if (step != 4) return;
    for (std::uint32_t i = 101; i <= 200; ++i) EXPECT_TRUE(news.broadcast(i, {}, {}));
  };
  bench.simulation.on_tell = tells;
  bench.run_to(4);
  FakeSimulation simulation(4);
  simulation.rests = true;
  simulation.on_tell = [&tells](std::uint64_t step, engine::StepNews& news) { tells(step + 3, news); };
  HostConfig config = news_config();
  config.streams[0].layout.capacity = 4;
  const auto world = roll_forward(config, simulation, from, bench.port.journal);
  ASSERT_TRUE(world) << world.error().message;
  Bench next(config_of(*world));
  next.poll();
  next.run_to(5);
  const auto events = events_told(next.port);
  ASSERT_EQ(events.size(), 42U);  // of 106 the frame 4 held 64
  EXPECT_EQ(events.front().kind, 159U);
  EXPECT_EQ(events.back().kind, 200U);
}

TEST_F(NewsThatGoOn, AJournalWithNewsThatDoNotFitIsRefused) {
  bench.run_to(5);
  for (transport::JournalMessage& entry : bench.port.journal)
    if (!entry.news.empty()) entry.news.pop_back();
  FakeSimulation simulation(4);
  simulation.rests = true;
  HostConfig config = news_config();
  config.streams[0].layout.capacity = 4;
  EXPECT_EQ(roll_forward(config, simulation, from, bench.port.journal).error().code, ErrorCode::kMalformed);
}

TEST_F(NewsThatGoOn, NothingInASessionThatHasNoNewsAnyMore) {
  HostConfig config = config_of(from);
  config.streams[0].layout.world = {};
  Bench next(std::move(config));
  next.poll();
  next.run_to(4);
  EXPECT_EQ(next.host->news(), nullptr);
}

TEST_F(NewsThatGoOn, ACheckpointWhoseNewsCannotBeReadIsRefused) {
  from.world.pop_back();
  from.world.push_back(std::byte{0x7F});
  from.world.push_back(std::byte{0x7F});
  EXPECT_ANY_THROW(Bench(config_of(from)));
}

}  // namespace
}  // namespace tandem::host::of_news
