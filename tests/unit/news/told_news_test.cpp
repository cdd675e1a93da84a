// Each event is told once, and the keys that the application knows are the server's.
#include "sdk/client/session/told_news.hpp"

#include <gtest/gtest.h>

#include <map>
#include <string>

#include "tests/support/client/fake_server.hpp"

namespace tandem::client::of_news {
namespace {

constexpr WorldFeatures kBoth{.keys = true, .events = true};

std::vector<std::byte> section(SectionType type, const std::function<void(ByteWriter&)>& write) {
  std::vector<std::byte> bytes(4096);
  ByteWriter out(bytes);
  put_section(type, out, write);
  bytes.resize(out.size());
  return bytes;
}
std::vector<std::byte> event(std::uint32_t kind, std::string_view text = {}) {
  return section(SectionType::kEvents, [&](ByteWriter& out) {
    write_event({kind, {}, std::as_bytes(std::span(text))}, out);
  });
}
std::vector<std::byte> key(std::string_view name, std::string_view value) {
  return section(SectionType::kKeys, [&](ByteWriter& out) {
    write_key_change({name, std::as_bytes(std::span(value))}, out);
  });
}
std::vector<std::byte> no_key(std::string_view name) {
  return section(SectionType::kKeys, [&](ByteWriter& out) { write_key_change({name, std::nullopt}, out); });
}

// What an application would note.
class Notes final : public CoreListener {
 public:
  void on_happened(const Happened& it) override {
    lines.push_back("event " + std::to_string(it.number) + " kind " + std::to_string(it.event.kind) +
                    " frame " + std::to_string(it.frame));
  }
  void on_events_lost(Epoch, Frame frame, std::uint64_t count) override {
    lines.push_back("lost " + std::to_string(count) + " to frame " + std::to_string(frame));
  }
  void on_events_taken_back(Epoch, Frame frame, std::uint64_t count) override {
    lines.push_back("back " + std::to_string(count) + " to frame " + std::to_string(frame));
  }
  void on_key(Epoch, Frame, const KeyChange& change) override {
    lines.push_back(std::string(change.key) + (change.value ? "=" + text(*change.value) : " gone"));
  }
  [[nodiscard]] std::vector<std::string> take() { return std::exchange(lines, {}); }
  static std::string text(std::span<const std::byte> bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }
  std::vector<std::string> lines;
};
using Lines = std::vector<std::string>;

class Told : public ::testing::Test {
 protected:
  Told() { news.enter(1000, std::nullopt); }

  [[nodiscard]] ClientTimeline timeline() const {
    return std::move(*ClientTimeline::create(server.session.streams[0].layout));
  }
  void load() {
    ASSERT_TRUE(client.load(server.snapshot().bytes, server.session.epoch));
    news.on_loaded(client);
  }
  // Applies a frame, of which the payload lives until the next.
  void apply(transport::DeltaMessage delta) {
    last = std::move(delta);
    ASSERT_TRUE(client.apply(last.frame, last.last_input, last.hash, last.payload));
    news.on_applied(client);
  }
  transport::DeltaMessage with(std::vector<std::byte> bytes) {
    server.news = std::move(bytes);
    return server.advance();
  }

  FakeServer server{1000, 40, 1, {}, kBoth};
  Notes notes;
  ToldNews news{notes};
  ClientTimeline client = timeline();
  transport::DeltaMessage last;
};

TEST_F(Told, WhoJoinsHasTheKeysAndHearsNoOldEvents) {
  with(key("phase", "play"));
  with(event(1));
  load();
  EXPECT_EQ(notes.take(), Lines{"phase=play"});
  apply(with(event(2)));
  apply(with({}));
  apply(with(key("phase", "over")));
  apply(with(no_key("phase")));
  EXPECT_EQ(notes.take(), (Lines{"event 2 kind 2 frame 3", "phase=over", "phase gone"}));
  EXPECT_TRUE(news.keys().empty());
}

TEST_F(Told, ASnapshotOlderThanWhatWasToldTellsNothingTwice) {
  load();
  with({});
  const auto snapshot = server.snapshot();
  auto one = with(event(1)), two = with(key("a", "1")), three = with(event(2));
  ASSERT_TRUE(client.load(snapshot.bytes, 1000));
  news.on_loaded(client);
  apply(one);
  apply(two);
  EXPECT_EQ(notes.take(), (Lines{"event 1 kind 1 frame 2", "a=1"}));
  ASSERT_TRUE(client.load(snapshot.bytes, 1000));
  news.on_loaded(client);
  apply(one);
  apply(two);
  apply(three);
  EXPECT_EQ(notes.take(), Lines{"event 2 kind 2 frame 4"});
  EXPECT_EQ(news.keys().size(), 1U);
}

TEST_F(Told, WhatALaterSnapshotPassesOverIsNamedAsLost) {
  load();
  apply(with(event(1)));
  with(event(2));
  with(key("a", "1"));
  with(event(3));
  notes.lines.clear();
  load();
  apply(with(event(4)));
  EXPECT_EQ(notes.take(), (Lines{"lost 2 to frame 4", "a=1", "event 4 kind 4 frame 5"}));
}

TEST_F(Told, AnotherStreamTellsWhatItIsAheadByOnceItIsPlayed) {
  load();
  ClientTimeline other = timeline();
  ASSERT_TRUE(other.load(server.snapshot().bytes, 1000));
  const auto one = with(event(1, "text")), two = with(key("a", "1")), three = with(event(3)),
             four = with(event(4));
  const auto ahead = [&](const transport::DeltaMessage& delta) {
    ASSERT_TRUE(other.apply(delta.frame, 0, delta.hash, delta.payload));
    news.keep(other);
  };
  apply(one);
  for (const auto& delta : {one, two, three}) ahead(delta);
  EXPECT_EQ(notes.take(), Lines{"event 1 kind 1 frame 1"});
  news.move_over(other);
  EXPECT_EQ(notes.take(), (Lines{"event 2 kind 3 frame 3", "a=1"}));
  ASSERT_TRUE(other.apply(four.frame, 0, four.hash, four.payload));
  news.on_applied(other);
  EXPECT_EQ(notes.take(), Lines{"event 3 kind 4 frame 4"});
}

TEST_F(Told, WhatAChangeHeldIsForgottenIfItIsGivenUp) {
  load();
  ClientTimeline other = timeline();
  ASSERT_TRUE(other.load(server.snapshot().bytes, 1000));
  const auto one = with(event(1));
  ASSERT_TRUE(other.apply(one.frame, 0, one.hash, one.payload));
  news.keep(other);
  news.forget_kept();
  apply(one);
  EXPECT_EQ(notes.take(), Lines{"event 1 kind 1 frame 1"});
}

TEST_F(Told, AnEpochThatGoesOnFromAnEarlierFrameTakesBackWhatItDoesNotShare) {
  load();
  apply(with(event(1)));                        // frame 1
  apply(with(key("a", "old")));                 // 2
  const SessionWorld shared = *client.world();  // the world of the checkpoint
  apply(with(event(2)));                        // 3
  apply(with(key("a", "new")));                 // 4
  notes.lines.clear();
  news.enter(2000, 2);
  EXPECT_EQ(notes.take(), Lines{"back 1 to frame 2"});
  // The other server goes on from frame 2, and tells two events before the client is there.
  ServerTimeline next = std::move(*ServerTimeline::create(server.session.streams[0].layout, 2000));
  const State state = server.timeline().state();
  next.start(2, state, server.timeline().drive(), 0, {}, &shared);
  next.advance(state, {}, kNoBudget, nullptr, {}, event(7));
  next.advance(state, {}, kNoBudget, nullptr, {}, event(8));
  std::vector<std::byte> snapshot;
  next.snapshot(snapshot);
  ASSERT_TRUE(client.load(snapshot, 2000));
  news.on_loaded(client);
  const auto frame = next.advance(state, {}, kNoBudget, nullptr, {}, event(9));
  ASSERT_TRUE(client.apply(frame.frame, 0, frame.hash, frame.payload));
  news.on_applied(client);
  EXPECT_EQ(notes.take(), (Lines{"lost 2 to frame 4", "a=old", "event 4 kind 9 frame 5"}));
}

TEST_F(Told, AnEpochThatSharesNothingIsJoinedAnew) {
  with(key("a", "1"));
  load();
  apply(with(event(1)));
  notes.lines.clear();
  news.enter(2000, std::nullopt);
  FakeServer other(2000, 40, 1, {}, kBoth);
  other.news = event(5);
  other.advance();
  ASSERT_TRUE(client.load(other.snapshot().bytes, 2000));
  news.on_loaded(client);
  EXPECT_EQ(notes.take(), Lines{"a gone"});
}

TEST_F(Told, TheSameEpochUnderAnotherServerGoesOn) {
  load();
  apply(with(event(1)));
  news.enter(1000, std::nullopt);
  load();
  apply(with(event(2)));
  EXPECT_EQ(notes.take(), (Lines{"event 1 kind 1 frame 1", "event 2 kind 2 frame 2"}));
}

class NewsOfAClient : public ::testing::Test {};

TEST_F(NewsOfAClient, AreToldOverAGapAndARejoin) {
  FakeServer server(1000, 40, 1, {}, kBoth);
  FakePort port;
  Notes notes;
  CoreOptions options;
  options.id = kClient;
  ClientCore core(options, port, &notes);
  std::int64_t now_ns = 1'000'000'000'000;
  const auto poll = [&](std::int64_t later_ns) {
    now_ns += later_ns;
    core.poll({now_ns, now_ns});
  };
  const auto deliver = [&](std::vector<std::byte> bytes) {
    server.news = std::move(bytes);
    port.deltas.push_back(from_server(server.advance()));
    poll(kFrameNs);
  };
  port.sessions.push_back(from_server(server.session));
  poll(kMs);
  server.news = key("score", "1");
  port.deltas.push_back(from_server(server.advance()));
  poll(kMs);
  port.snapshots.push_back(from_server(server.snapshot()));
  poll(kMs);
  ASSERT_EQ(core.phase(), ClientPhase::kPlaying);
  EXPECT_EQ(notes.take(), Lines{"score=1"});
  deliver(event(1));
  server.news = event(2);
  server.advance();  // never arrives
  deliver(event(3));
  for (int i = 0; i < 100 && core.phase() != ClientPhase::kPlaying; ++i) {
    if (i == 50) port.snapshots.push_back(from_server(server.snapshot()));
    poll(10 * kMs);
  }
  deliver(event(4));
  EXPECT_EQ(notes.take(), (Lines{"event 1 kind 1 frame 2", "lost 2 to frame 4", "event 4 kind 4 frame 5"}));
  EXPECT_EQ(core.keys().size(), 1U);
}

}  // namespace
}  // namespace tandem::client::of_news
