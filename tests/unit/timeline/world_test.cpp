#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <string>

#include "sdk/core/lattice/hash.hpp"
#include "sdk/core/news/session_world.hpp"
#include "sdk/core/timeline/snapshot.hpp"
#include "tests/unit/timeline/session.hpp"

namespace tandem::of_world {
namespace {

using namespace synthetic;

constexpr WorldFeatures kBoth{.keys = true, .events = true};
constexpr std::uint32_t kSlots = 20;

std::span<const std::byte> as_bytes(std::string_view text) { return std::as_bytes(std::span(text)); }
KeyChange set(std::string_view key, std::string_view value) { return {key, as_bytes(value)}; }
KeyChange gone(std::string_view key) { return {key, std::nullopt}; }

std::vector<std::byte> section(SectionType type, const std::function<void(ByteWriter&)>& write) {
  std::vector<std::byte> bytes(200'000);
  ByteWriter out(bytes);
  put_section(type, out, write);
  EXPECT_FALSE(out.overflow());
  bytes.resize(out.size());
  return bytes;
}
std::vector<std::byte> keys_section(const std::vector<KeyChange>& changes) {
  return section(SectionType::kKeys, [&](ByteWriter& out) {
    for (const KeyChange& change : changes) write_key_change(change, out);
  });
}
std::vector<std::byte> events_section(const std::vector<WorldEvent>& events) {
  return section(SectionType::kEvents, [&](ByteWriter& out) {
    for (const WorldEvent& event : events) write_event(event, out);
  });
}
std::vector<std::byte> joined(std::vector<std::byte> a, const std::vector<std::byte>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}
bool reads(const std::vector<std::byte>& payload, const WorldFeatures& features = kBoth) {
  News news;
  return read_news(payload, features, kSlots, news).has_value();
}
std::vector<std::byte> raw(SectionType type, std::initializer_list<int> body) {
  return section(type, [&](ByteWriter& out) {
    for (const int byte : body) out.put(static_cast<std::uint8_t>(byte));
  });
}

SessionWorld world_with(const std::vector<KeyChange>& changes) {
  SessionWorld world;
  News news;
  news.keys = changes;
  EXPECT_TRUE(world.check(news));
  world.apply(news);
  return world;
}

TEST(News, AreReadAsTheyWereWritten) {
  const auto payload =
      joined(keys_section({set("phase", "play"), gone("score"), set("sky", "")}),
             events_section({{7, WorldEvent::Body{19, 3}, as_bytes("bang")}, {0xFFFFFFFF, {}, {}}}));
  News news;
  const auto rest = read_news(joined(payload, {std::byte{1}, std::byte{0}}), kBoth, kSlots, news);
  ASSERT_TRUE(rest);
  EXPECT_EQ(rest->size(), 2U);
  const auto kept = joined(payload, {});
  ASSERT_TRUE(read_news(kept, kBoth, kSlots, news));
  ASSERT_EQ(news.keys.size(), 3U);
  EXPECT_EQ(news.keys[0].key, "phase");
  EXPECT_EQ(news.keys[0].value->size(), 4U);
  EXPECT_FALSE(news.keys[1].value);
  EXPECT_TRUE(news.keys[2].value && news.keys[2].value->empty());
  ASSERT_EQ(news.events.size(), 2U);
  EXPECT_EQ(news.events[0].kind, 7U);
  EXPECT_EQ(news.events[0].body, (WorldEvent::Body{19, 3}));
  EXPECT_EQ(news.events[0].bytes.size(), 4U);
  EXPECT_EQ(news.events[1].kind, 0xFFFFFFFFU);
  EXPECT_FALSE(news.events[1].body);
}

TEST(News, AreLeftToTheReaderOfTheRestWithoutTheirFeature) {
  const auto keys = keys_section({set("a", "b")});
  News news;
  EXPECT_EQ(read_news(keys, {}, kSlots, news)->size(), keys.size());
  EXPECT_EQ(read_news(keys, {.keys = false, .events = true}, kSlots, news)->size(), keys.size());
  EXPECT_TRUE(news.empty());
}

TEST(News, MayFollowASectionThatMayBeSkipped) {
  const auto skipped = raw(static_cast<SectionType>(0x11), {1, 2, 3});
  News news;
  const auto payload = joined(skipped, keys_section({set("a", "b")}));
  ASSERT_EQ(read_news(payload, kBoth, kSlots, news)->size(), 0U);
  EXPECT_EQ(news.keys.size(), 1U);
}

TEST(News, AreRefusedIfTheyBreakARule) {
  const auto keys = keys_section({set("a", "b")});
  const auto events = events_section({{1, {}, {}}});
  EXPECT_TRUE(reads(joined(keys, events)));
  EXPECT_FALSE(reads(joined(events, keys)));
  EXPECT_FALSE(reads(joined(keys, keys)));
  EXPECT_FALSE(reads(raw(SectionType::kKeys, {})));
  EXPECT_FALSE(reads(raw(SectionType::kEvents, {})));
  EXPECT_FALSE(reads(keys_section({set("b", ""), set("a", "")})));
  EXPECT_FALSE(reads(keys_section({set("a", ""), set("a", "")})));
  EXPECT_FALSE(reads(raw(SectionType::kKeys, {0, 1})));              // without a key
  EXPECT_FALSE(reads(raw(SectionType::kKeys, {1, '\n', 1})));        // a control character
  EXPECT_FALSE(reads(raw(SectionType::kKeys, {2, 0xC3, 0xA4, 1})));  // no ASCII
  EXPECT_FALSE(reads(raw(SectionType::kKeys, {65, 'a'})));
  EXPECT_FALSE(reads(raw(SectionType::kKeys, {1, 'a', 3, 'b'})));        // cut
  EXPECT_FALSE(reads(raw(SectionType::kKeys, {1, 'a', 0x81, 0, 'b'})));  // not the shortest form
  EXPECT_TRUE(reads(raw(SectionType::kEvents, {1, 20, 0, 0})));
  EXPECT_FALSE(reads(raw(SectionType::kEvents, {1, 21, 0, 0})));  // beyond the capacity
  EXPECT_FALSE(reads(raw(SectionType::kEvents, {1, 0, 2, 'a'})));
  EXPECT_FALSE(reads(raw(SectionType::kEvents, {0x80, 0x80, 0x80, 0x80, 0x10, 0, 0})));  // 2^32
  const std::vector<std::byte> long_bytes(kMaxEventBytes + 1);
  EXPECT_FALSE(reads(section(SectionType::kEvents, [&](ByteWriter& out) {
    out.put_leb128(1);
    out.put_leb128(0);
    out.put_leb128(long_bytes.size());
    out.put_bytes(long_bytes);
  })));
  EXPECT_TRUE(reads(events_section(std::vector<WorldEvent>(64, {1, {}, {}}))));
  EXPECT_FALSE(reads(events_section(std::vector<WorldEvent>(65, {1, {}, {}}))));
  const std::span<const std::byte> kilobyte(long_bytes.data(), kMaxEventBytes);
  EXPECT_TRUE(reads(events_section(std::vector<WorldEvent>(15, {1, {}, kilobyte}))));
  EXPECT_FALSE(reads(events_section(std::vector<WorldEvent>(16, {1, {}, kilobyte}))));
}

TEST(SessionWorld, RefusesWhatASessionMayNotHold) {
  const std::string large(kMaxKeysBytes - 2, 'x');
  SessionWorld world = world_with({set("a", "1")});
  const auto fits = [&world](std::vector<KeyChange> changes) {
    News news;
    news.keys = std::move(changes);
    return world.check(news).has_value();
  };
  EXPECT_FALSE(fits({gone("b")}));
  EXPECT_FALSE(fits({set("b", large)}));            // 65,534 + 1 beside "a" and "1"
  EXPECT_TRUE(fits({set("a", large)}));             // in its place
  EXPECT_TRUE(fits({gone("a"), set("b", large)}));  // likewise
  std::vector<std::string> names;
  for (int i = 0; i < 256; ++i) names.push_back("k" + std::to_string(1000 + i));
  std::vector<KeyChange> many;
  for (const std::string& name : names) many.push_back(set(name, ""));
  EXPECT_FALSE(fits(many));  // and "a"
  many.insert(many.begin(), gone("a"));
  EXPECT_TRUE(fits(many));
}

TEST(SessionWorld, HashesAllThatItHolds) {
  const SessionWorld empty;
  const SessionWorld a = world_with({set("a", "1")});
  EXPECT_NE(empty.hash(), a.hash());
  EXPECT_NE(world_with({set("a", "2")}).hash(), a.hash());
  EXPECT_NE(world_with({set("a1", "")}).hash(), a.hash());
  SessionWorld back = a;
  News news;
  news.keys = {gone("a")};
  back.apply(news);
  EXPECT_EQ(back.hash(), empty.hash());
  // As the protocol says, computed beside it.
  std::vector<std::byte> key{std::byte{1}, std::byte{'a'}, std::byte{1}, {}, {}, {}, std::byte{'1'}};
  const std::array<std::uint64_t, 3> all{0, 0, hash_bytes(key)};
  EXPECT_EQ(a.hash(), hash_bytes(std::as_bytes(std::span(all))));
}

TEST(SessionWorld, EventsChangeItsHashByOrderAndContent) {
  const auto after = [](std::vector<std::vector<std::byte>> frames) {
    SessionWorld world;
    for (const auto& frame : frames) {
      News news;
      EXPECT_TRUE(read_news(frame, kBoth, kSlots, news));
      world.apply(news);
    }
    return std::pair(world.hash(), world.event_count());
  };
  const auto one = events_section({{1, {}, {}}}), two = events_section({{2, {}, {}}});
  EXPECT_NE(after({one, two}), after({two, one}));
  EXPECT_EQ(after({one, two}).second, 2U);
  EXPECT_NE(after({one}).first, after({one, one}).first);
}

TEST(SessionWorld, IsReadAsItWasWrittenAndAnythingElseIsRefused) {
  SessionWorld world = world_with({set("a", "1"), set("b", std::string(300, 'x'))});
  News news;
  const auto events = events_section({{1, {}, {}}});
  ASSERT_TRUE(read_news(events, kBoth, kSlots, news));
  world.apply(news);
  std::vector<std::byte> bytes(SessionWorld::kMaxBytes);
  ByteWriter out(bytes);
  world.write(out);
  bytes.resize(out.size());
  const auto again = SessionWorld::read(bytes, kBoth);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->hash(), world.hash());
  EXPECT_EQ(again->keys(), world.keys());
  EXPECT_EQ(again->event_count(), 1U);
  EXPECT_FALSE(SessionWorld::read(bytes, {.keys = true, .events = false}));
  EXPECT_FALSE(SessionWorld::read(bytes, {.keys = false, .events = true}));
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    if (size == 16 || size == 20) continue;  // fewer keys: the hash tells
    EXPECT_FALSE(SessionWorld::read(std::span(bytes).first(size), kBoth)) << size;
  }
}

Layout layout_with_world(std::uint32_t capacity = 100) {
  Layout layout = layout_for("tracker", capacity);
  layout.world = kBoth;
  return layout;
}

TEST(WorldOfAStream, FollowsTheServersOnItsFrame) {
  Random random(1);
  auto server = server_of(layout_with_world());
  auto client = client_of(layout_with_world());
  const State start = random_state(random, 100);
  const SessionWorld begun = world_with({set("phase", "wait")});
  server.start(0, start, {}, 0, {}, &begun);
  ASSERT_TRUE(client.load(snapshot_of(server), kEpoch));
  EXPECT_EQ(client.world()->keys(), begun.keys());
  EXPECT_TRUE(client.news().empty());
  const auto news = joined(keys_section({set("phase", "play")}),
                           events_section({{5, WorldEvent::Body{3, 0}, as_bytes("goal")}}));
  const auto frame = server.advance(start, {}, kNoBudget, nullptr, {}, news);
  ASSERT_TRUE(apply(client, frame));
  EXPECT_EQ(client.news().events.size(), 1U);
  EXPECT_EQ(client.world()->event_count(), 1U);
  EXPECT_EQ(client.world()->keys().at("phase").size(), 4U);
  ASSERT_TRUE(apply(client, server.advance(start, {})));
  EXPECT_TRUE(client.news().empty());
  // Who joins has the keys, and knows how many events there were.
  auto late = client_of(layout_with_world());
  ASSERT_TRUE(late.load(snapshot_of(server), kEpoch));
  EXPECT_EQ(late.world()->event_count(), 1U);
  EXPECT_EQ(late.world()->keys(), client.world()->keys());
  std::vector<std::byte> passed_on;
  late.snapshot(passed_on);
  EXPECT_EQ(passed_on, snapshot_of(server));
}

TEST(WorldOfAStream, IsPartOfTheHash) {
  Random random(1);
  auto server = server_of(layout_with_world());
  auto client = client_of(layout_with_world());
  const State start = random_state(random, 100);
  server.start(0, start, {});
  ASSERT_TRUE(client.load(snapshot_of(server), kEpoch));
  const auto frame =
      server.advance(start, {}, kNoBudget, nullptr, {}, events_section({{5, {}, as_bytes("x")}}));
  std::vector<std::byte> forged(frame.payload.begin(), frame.payload.end());
  forged[5] = std::byte{'y'};  // the event's byte
  EXPECT_EQ(client.apply(frame.frame, 0, frame.hash, forged).error().code, ErrorCode::kMismatch);
}

TEST(WorldOfAStream, ARefusedDeltaLeavesItAsItWas) {
  Random random(1);
  auto server = server_of(layout_with_world());
  auto client = client_of(layout_with_world());
  const State start = random_state(random, 100);
  server.start(0, start, {});
  ASSERT_TRUE(client.load(snapshot_of(server), kEpoch));
  const auto frame = server.advance(start, {}, kNoBudget, nullptr, {}, keys_section({set("a", "b")}));
  const std::vector<std::byte> good(frame.payload.begin(), frame.payload.end());
  EXPECT_FALSE(client.apply(1, 0, frame.hash, joined(good, {std::byte{0xFF}, {}})));
  EXPECT_FALSE(client.apply(1, 0, frame.hash, keys_section({gone("a")})));
  EXPECT_TRUE(client.world()->keys().empty());
  EXPECT_TRUE(client.apply(1, 0, frame.hash, good));
}

TEST(WorldOfAStream, ASessionWithoutFeaturesRefusesNewsAndHasAnotherLayoutHash) {
  Random random(1);
  const Layout plain = layout_for("tracker", 100), with = layout_with_world();
  EXPECT_NE(layout_hash(plain, 4, 1), layout_hash(with, 4, 1));
  auto server = server_of(plain);
  auto client = client_of(plain);
  server.start(0, random_state(random, 100), {});
  EXPECT_EQ(client.world(), nullptr);
  ASSERT_TRUE(client.load(snapshot_of(server), kEpoch));
  EXPECT_EQ(client.apply(1, 0, 0, keys_section({set("a", "b")})).error().code, ErrorCode::kUnsupported);
  // Nor does a snapshot of one fit the other.
  auto other = client_of(with);
  EXPECT_FALSE(other.load(snapshot_of(server), kEpoch));
  auto with_world = server_of(with);
  with_world.start(0, random_state(random, 100), {});
  EXPECT_FALSE(client.load(snapshot_of(with_world), kEpoch));
}

}  // namespace
}  // namespace tandem::of_world
