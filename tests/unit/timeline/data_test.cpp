#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <string>

#include "sdk/core/data/data_queue.hpp"
#include "sdk/core/lattice/hash.hpp"
#include "sdk/core/timeline/snapshot.hpp"
#include "tests/unit/timeline/session.hpp"

namespace tandem::of_data {
namespace {

using namespace synthetic;

constexpr std::uint32_t kSlots = 100;

std::vector<DataField> fields(std::string_view text) {
  const auto parsed = parse_data_fields(text);
  EXPECT_TRUE(parsed) << text;
  return parsed.value_or(std::vector<DataField>());
}

Layout layout_with(std::string_view text, std::uint32_t capacity = kSlots) {
  Layout layout = layout_for("tracker", capacity);
  layout.data = fields(text);
  layout.groups.emplace_back(kDataGroup);
  return layout;
}

std::vector<std::byte> random_records(Random& random, std::size_t size) {
  std::vector<std::byte> records(size);
  for (std::byte& byte : records) byte = static_cast<std::byte>(random.below(256));
  return records;
}

std::vector<std::byte> of_living(std::vector<std::byte> records, const State& state) {
  const std::size_t size = records.size() / state.capacity();
  for (Slot slot = 0; slot < state.capacity(); ++slot)
    if (state.alive()[slot] == 0)
      std::fill_n(records.begin() + static_cast<std::ptrdiff_t>(slot * size), size, std::byte{0});
  return records;
}

ServerTimeline::FrameResult advance(ServerTimeline& server, const State& target,
                                    std::span<const std::byte> records, std::size_t most_bytes = SIZE_MAX,
                                    std::span<const LifecycleRecord> lifecycle = {}) {
  return server.advance(target, lifecycle, kNoBudget, nullptr, {}, {}, {records, most_bytes});
}

void expect_same(const BodyData* a, const BodyData* b) {
  ASSERT_TRUE(a != nullptr && b != nullptr);
  EXPECT_TRUE(std::equal(a->records().begin(), a->records().end(), b->records().begin(), b->records().end()));
  EXPECT_TRUE(std::equal(a->ages().begin(), a->ages().end(), b->ages().begin(), b->ages().end()));
}

TEST(DataFields, AreReadFromText) {
  const auto some = fields("u8 health,  f32 heat, rgba colour");
  ASSERT_EQ(some.size(), 3U);
  EXPECT_EQ(some[1].name, "heat");
  EXPECT_EQ(static_cast<DataKind>(some[2].kind), DataKind::kRgba);
  EXPECT_EQ(data_record_bytes(some), 9U);
  EXPECT_TRUE(fields("").empty());
  EXPECT_TRUE(parse_data_fields("u32 a, u32 b, u32 c, u32 d"));
  for (const char* bad :
       {"u8", "u8 Health", "u8 a b", "u64 a", "u8 a, u8 a", "u32 a, u32 b, u32 c, u32 d, u8 e", "u8 a,, u8 b",
        "u8 a23456789012345678901234567890123"})
    EXPECT_FALSE(parse_data_fields(bad)) << bad;
}

TEST(DataFields, ArePartOfTheLayout) {
  const Layout plain = layout_for("tracker", kSlots), with = layout_with("u8 health");
  EXPECT_TRUE(check_layout(with));
  EXPECT_NE(layout_hash(plain, 4, 1), layout_hash(with, 4, 1));
  EXPECT_NE(layout_hash(layout_with("i8 health"), 4, 1), layout_hash(with, 4, 1));
  Layout bad = with;
  bad.groups = {kPositionGroup};
  EXPECT_FALSE(check_layout(bad));
  bad = plain;
  bad.groups.emplace_back(kDataGroup);
  EXPECT_FALSE(check_layout(bad));
  bad = with;
  bad.data[0].kind = 8;
  EXPECT_FALSE(check_layout(bad));
}

TEST(DataOfBodies, FollowTheServersOnTheirFrame) {
  for (const char* text : {"u8 a", "i16 a, u16 b", "f32 a, rgba b, i32 c, u32 d", "rgba a",
                           "u8 a, u8 b, u8 c, u8 d, u8 e, u8 f, u8 g, u8 h, u8 i, u8 j, u8 k, u8 l, u8 m, "
                           "u8 n, u8 o, u8 p"}) {
    Random random(1);
    const Layout layout = layout_with(text);
    auto server = server_of(layout);
    auto client = client_of(layout);
    const State start = random_state(random, kSlots);
    auto records = of_living(random_records(random, kSlots * data_record_bytes(layout.data)), start);
    server.start(0, start, {}, 0, {}, nullptr, records);
    ASSERT_TRUE(client.load(snapshot_of(server), kEpoch));
    expect_same(client.data(), server.data());
    for (int frame = 0; frame < 300; ++frame) {
      const std::size_t changes = frame % 3 == 0 ? 0 : random.below(20);
      for (std::size_t i = 0; i < changes; ++i)
        records[random.below(records.size())] = std::byte(random.below(256));
      records = of_living(records, start);
      const auto made = advance(server, start, records);
      EXPECT_EQ(made.data_waiting, 0U);
      ASSERT_TRUE(apply(client, made)) << text << ' ' << frame;
      ASSERT_TRUE(std::equal(records.begin(), records.end(), client.data()->records().begin()));
    }
    expect_same(client.data(), server.data());
    // Who joins has the data and the models: it reads what follows, and passes the same snapshot on.
    auto late = client_of(layout);
    ASSERT_TRUE(late.load(snapshot_of(server), kEpoch));
    std::vector<std::byte> passed_on;
    client.snapshot(passed_on);
    EXPECT_EQ(passed_on, snapshot_of(server));
    records = of_living(random_records(random, records.size()), start);
    const auto made = advance(server, start, records);
    ASSERT_TRUE(apply(late, made));
    ASSERT_TRUE(apply(client, made));
    expect_same(late.data(), client.data());
  }
}

TEST(DataOfBodies, KeepEveryBitOfAFloat) {
  Random random(1);
  const Layout layout = layout_with("f32 heat", 8);
  auto server = server_of(layout);
  auto client = client_of(layout);
  State start(8);
  for (Slot slot = 0; slot < 8; ++slot) start.spawn(slot, 0, 0, {});
  server.start(0, start, {});
  ASSERT_TRUE(client.load(snapshot_of(server), kEpoch));
  const std::array<float, 8> values{-0.0F,
                                    0.0F,
                                    std::nanf("7"),
                                    -std::nanf("1"),
                                    std::numeric_limits<float>::infinity(),
                                    -std::numeric_limits<float>::infinity(),
                                    std::numeric_limits<float>::denorm_min(),
                                    -1.5F};
  for (std::size_t round = 0; round < 8; ++round) {
    std::vector<std::byte> records(32);
    for (std::size_t i = 0; i < 8; ++i) std::memcpy(&records[4 * i], &values.at((i + round) % 8), 4);
    ASSERT_TRUE(apply(client, advance(server, start, records)));
    EXPECT_TRUE(std::equal(records.begin(), records.end(), client.data()->records().begin()));
  }
}

TEST(DataOfBodies, TakeNothingInAFrameInWhichNoneChanges) {
  Random random(1);
  auto server = server_of(layout_with("u32 a"));
  auto plain = server_of(layout_for("tracker", kSlots));
  const State start = random_state(random, kSlots);
  const auto records = of_living(random_records(random, 4 * kSlots), start);
  server.start(0, start, {}, 0, {}, nullptr, records);
  plain.start(0, start, {});
  for (int frame = 0; frame < 300; ++frame) {
    const auto with = advance(server, start, records);
    const auto without = plain.advance(start, {});
    EXPECT_TRUE(
        std::equal(with.payload.begin(), with.payload.end(), without.payload.begin(), without.payload.end()));
    EXPECT_NE(with.hash, without.hash);
  }
  const auto& ages = server.data()->ages();
  EXPECT_EQ(*std::max_element(ages.begin(), ages.end()), 254U);
}

TEST(DataOfBodies, AreOfTheBodyThatTheSlotHolds) {
  const Layout layout = layout_with("u8 a", 4);
  auto server = server_of(layout);
  auto client = client_of(layout);
  State target(4);
  for (Slot slot = 0; slot < 3; ++slot) target.spawn(slot, 0, 0, {});
  std::vector<std::byte> records{std::byte{1}, std::byte{2}, std::byte{3}, std::byte{9}};
  server.start(0, target, {}, 0, {}, nullptr, records);
  ASSERT_TRUE(client.load(snapshot_of(server), kEpoch));
  EXPECT_EQ(client.data()->record(3)[0], std::byte{0});  // of a dead slot
  const auto with = [&](std::vector<LifecycleRecord> lifecycle) {
    const auto made = advance(server, target, records, SIZE_MAX, lifecycle);
    ASSERT_TRUE(apply(client, made));
    expect_same(client.data(), server.data());
  };
  LifecycleRecord gone, born, again;
  gone.slot = 0;
  born.kind = again.kind = LifecycleKind::kSpawn;
  born.slot = 3;
  target.despawn(0);
  target.spawn(3, 0, 0, {});
  records[3] = std::byte{7};
  with({gone, born});
  EXPECT_EQ(client.data()->record(0)[0], std::byte{0});
  EXPECT_EQ(client.data()->record(3)[0], std::byte{7});
  // A slot that is used anew within a frame, by a body with the same data as the one before, and one without.
  gone.slot = again.slot = 1;
  again.reuse = 1;
  with({gone, again});
  EXPECT_EQ(client.data()->record(1)[0], std::byte{2});
  records[1] = std::byte{0};
  again.reuse = 2;
  with({gone, again});
  EXPECT_EQ(client.data()->record(1)[0], std::byte{0});
  EXPECT_EQ(client.data()->ages()[1], 0U);
  EXPECT_EQ(client.data()->ages()[2], 3U);
}

TEST(DataOfBodies, ArePartOfTheHash) {
  Random random(1);
  const Layout layout = layout_with("u8 a");
  auto server = server_of(layout);
  auto client = client_of(layout);
  const State start = random_state(random, kSlots);
  server.start(0, start, {});
  ASSERT_TRUE(client.load(snapshot_of(server), kEpoch));
  const auto made = advance(server, start, of_living(random_records(random, kSlots), start));
  const auto none = server.advance(start, {});
  (void)made;
  // As if the frame had no data.
  EXPECT_EQ(client.apply(1, 0, none.hash, {}).error().code, ErrorCode::kMismatch);
}

TEST(DataOfBodies, MalformedSectionsAreRefusedAndChangeNothing) {
  Random random(1);
  const Layout layout = layout_with("u8 a, rgba b");
  auto server = server_of(layout);
  auto client = client_of(layout);
  const State start = random_state(random, kSlots);
  server.start(0, start, {});
  ASSERT_TRUE(client.load(snapshot_of(server), kEpoch));
  const auto made = advance(server, start, of_living(random_records(random, 5 * kSlots), start));
  const std::vector<std::byte> good(made.payload.begin(), made.payload.end());
  ASSERT_GT(made.data_bytes, 100U);
  const auto refused = [&](const std::vector<std::byte>& payload) {
    const auto result = client.apply(1, 0, made.hash, payload);
    return !result && result.error().code != ErrorCode::kMismatch;
  };
  EXPECT_TRUE(refused({std::byte{0x8b}, std::byte{0}}));                // no code: no body changes
  EXPECT_TRUE(refused({std::byte{0x8b}, std::byte{1}, std::byte{0}}));  // a zero that could be left out
  EXPECT_TRUE(refused({std::byte{0x8b}, std::byte{200}}));              // cut
  auto twice =
      std::vector<std::byte>(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(made.data_bytes));
  twice.insert(twice.end(), good.begin(), good.end());
  EXPECT_TRUE(refused(twice));
  auto longer = good;
  const auto behind = longer.begin() + static_cast<std::ptrdiff_t>(made.data_bytes);
  longer.insert(behind, 8, std::byte{1});  // more than the decoder reads ahead
  longer[1] = std::byte(std::to_integer<unsigned>(longer[1]) + 8);
  EXPECT_TRUE(refused(longer));
  ASSERT_TRUE(client.apply(1, 0, made.hash, good));
  // Random bytes never end a client, whatever they give.
  for (int i = 0; i < 2000; ++i) {
    auto bytes = random_records(random, 1 + random.below(60));
    bytes.insert(bytes.begin(), {std::byte{0x8b}, std::byte(bytes.size())});
    auto other = client_of(layout);
    ASSERT_TRUE(other.load(snapshot_of(server), kEpoch));
    EXPECT_FALSE(other.apply(2, 0, 0, bytes));
  }
}

TEST(DataOfBodies, AStreamWithoutThemRefusesThem) {
  Random random(1);
  const Layout plain = layout_for("tracker", kSlots), with = layout_with("u8 a");
  auto server = server_of(plain);
  auto client = client_of(plain);
  auto data_server = server_of(with);
  auto data_client = client_of(with);
  const State start = random_state(random, kSlots);
  server.start(0, start, {});
  data_server.start(0, start, {});
  EXPECT_EQ(client.data(), nullptr);
  EXPECT_FALSE(client.load(snapshot_of(data_server), kEpoch));
  EXPECT_FALSE(data_client.load(snapshot_of(server), kEpoch));
  ASSERT_TRUE(client.load(snapshot_of(server), kEpoch));
  const auto made = advance(data_server, start, of_living(random_records(random, kSlots), start));
  EXPECT_EQ(client.apply(1, 0, made.hash, made.payload).error().code, ErrorCode::kUnsupported);
}

TEST(DataOfBodies, SnapshotsThatAreCutOrChangedAreRefused) {
  Random random(1);
  const Layout layout = layout_with("i16 a", 10);
  auto server = server_of(layout);
  const State start = random_state(random, 10);
  server.start(0, start, {}, 0, {}, nullptr, of_living(random_records(random, 20), start));
  const auto good = snapshot_of(server);
  for (std::size_t i = 0; i < good.size(); ++i) {
    auto client = client_of(layout);
    EXPECT_FALSE(client.load(std::span(good).first(i), kEpoch)) << i;
    auto changed = good;
    changed[i] ^= std::byte{0x10};
    // The hashes do not cover what stands in front, nor models, which show in the next frame.
    if (client.load(changed, kEpoch)) expect_same(client.data(), server.data());
  }
}

TEST(DataQueue, TellsTheOldestChangeFirstWithTheNewestRecord) {
  const Layout layout = layout_with("u32 a", 200);
  auto server = server_of(layout);
  auto client = client_of(layout);
  State start(200);
  for (Slot slot = 0; slot < 200; ++slot) start.spawn(slot, 0, 0, {});
  server.start(0, start, {});
  ASSERT_TRUE(client.load(snapshot_of(server), kEpoch));
  Random random(1);
  auto records = random_records(random, 800);
  std::fill_n(records.begin(), 400, std::byte{0});  // the later half changes first
  auto made = advance(server, start, records, 100);
  ASSERT_TRUE(apply(client, made));
  EXPECT_LE(made.data_bytes, 103U);
  EXPECT_GT(made.data_waiting, 50U);
  records = random_records(random, 800);
  std::vector<bool> told(200);
  std::size_t frames = 0;
  for (; made.data_waiting > 0 && frames < 100; ++frames) {
    made = advance(server, start, records, 100);
    ASSERT_TRUE(apply(client, made));
    if (made.data_waiting > 120) {
      for (const Slot slot : client.data()->changed()) EXPECT_GE(slot, 100U);
    }
  }
  EXPECT_LT(frames, 20U);
  EXPECT_TRUE(std::equal(records.begin(), records.end(), client.data()->records().begin()));
  // Too little room for any: all wait.
  records[0] ^= std::byte{1};
  EXPECT_EQ(advance(server, start, records, 0).data_waiting, 1U);
}

// Prints what sdk/core/data/RESEARCH.md shows.
TEST(DataOfBodies, DISABLED_Measure) {
  constexpr std::uint32_t kBodies = 10'000;
  constexpr int kFrames = 1800, kRate = 30;
  enum class Change { kSameByOne, kSameUpOrDown, kAny, kNone, kColours };
  const auto measure = [&](const char* name, const char* text, Change change) {
    Random random(1);
    auto server = server_of(layout_with(text, kBodies));
    State start(kBodies);
    for (Slot slot = 0; slot < kBodies; ++slot) start.spawn(slot, 0, 0, {});
    auto records = random_records(random, kBodies * data_record_bytes(fields(text)));
    server.start(0, start, {}, 0, {}, nullptr, records);
    std::vector<Slot> same;
    while (same.size() < 500) same.push_back(static_cast<Slot>(random.below(kBodies)));
    std::size_t bytes = 0, late = 0, most = 0;
    for (int frame = 0; frame < kFrames; ++frame) {
      for (int i = 0; i < 50 && change != Change::kNone && change != Change::kColours; ++i) {
        std::byte& value = change == Change::kAny ? records[random.below(kBodies)]
                                                  : records[same[random.below(same.size())]];
        const unsigned by = change == Change::kSameUpOrDown && random.below(2) == 0 ? 255 : 1;
        value = change == Change::kAny ? std::byte(random.below(256))
                                       : std::byte(std::to_integer<unsigned>(value) + by);
      }
      if (change == Change::kColours) records = random_records(random, records.size());
      const auto made = advance(server, start, records);
      bytes += made.data_bytes;
      most = std::max(most, made.data_bytes);
      if (frame >= kFrames / 2) late += made.data_bytes;
    }
    const auto kbit = [](std::size_t n, int frames) {
      return static_cast<double>(n) * 8 * kRate / frames / 1000;
    };
    std::printf("%-40s %8.2f kbit/s, second half %8.2f, largest %zu bytes\n", name, kbit(bytes, kFrames),
                kbit(late, kFrames / 2), most);
  };
  measure("50 of the same 500 by 1", "u8 a", Change::kSameByOne);
  measure("50 of the same 500 by 1 or -1", "u8 a", Change::kSameUpOrDown);
  measure("any 50, any value", "u8 a", Change::kAny);
  measure("no change", "u8 a", Change::kNone);
  measure("all 10,000 colours, random, each frame", "rgba a", Change::kColours);
}

}  // namespace
}  // namespace tandem::of_data
