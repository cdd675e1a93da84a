// Worlds in which hardly anybody moves: what is left out changes no byte and no hash.

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <tuple>

#include "sdk/core/predict/contact/constants.hpp"
#include "sdk/core/tables/codec_table.hpp"
#include "sdk/core/tables/predictor_table.hpp"
#include "sdk/core/timeline/parts.hpp"
#include "sdk/workers/workers.hpp"
#include "tests/unit/timeline/session.hpp"

namespace tandem {
namespace {

using namespace synthetic;

constexpr std::int32_t kThreshold = 2048;
constexpr Drive kDown{{0, -6400, 0}, 30};

RunBlocks on_threads(std::uint32_t threads) {
  if (threads == 1) return {};
  return [workers = std::make_shared<Workers>(threads)](std::uint32_t count,
                                                        const std::function<void(std::uint32_t)>& job) {
    workers->run(count, 1, [&job](std::uint32_t begin, std::uint32_t end) {
      for (std::uint32_t i = begin; i < end; ++i) job(i);
    });
  };
}

Layout layout_of(std::string_view codec, std::string_view predictor, std::uint32_t capacity,
                 bool turns = false) {
  Layout layout = layout_for(codec, capacity);
  layout.parameters.codec.threshold = kThreshold;
  layout.predictor = predictor;
  if (predictor != "ballistic") {
    ContactConstants constants;
    constants.types.resize(kTypes);
    layout.predictor_constants = write_contact_constants(constants);
  }
  if (!turns) return layout;
  layout.groups = {kPositionGroup, kOrientationGroup};
  layout.radii.assign(kTypes, 4000);
  return layout;
}

// The full simulation, with the numbers of its blocks.
struct World {
  explicit World(const Layout& layout)
      : state(layout.capacity, groups_of(layout)), numbers(block_count(layout.capacity), 1) {
    for (Slot slot = 0; slot + 100 < layout.capacity; ++slot) state.spawn(slot, 0, 0, {.p = place(slot)});
  }
  static Vec3i place(Slot slot) {
    return {static_cast<std::int32_t>(slot % 256) * 20'000, 77,
            static_cast<std::int32_t>(slot / 256) * 20'000};
  }
  void touch(Slot slot) { numbers[slot / kBlockSlots] = ++last; }
  void push(Slot slot, std::int32_t way) {
    state.p(0)[slot] += way;
    touch(slot);
  }
  void spawn(Slot slot, std::uint8_t reuse) {
    state.spawn(slot, reuse, 0, {.p = place(slot)});
    records.push_back({LifecycleKind::kSpawn, slot, reuse, 0, state.body(slot)});
    touch(slot);
  }
  void remove(Slot slot) {
    state.despawn(slot);
    records.push_back({LifecycleKind::kDespawn, slot, 0, 0, {}});
    touch(slot);
  }
  void teleport(Slot slot, std::int32_t way) {
    state.p(2)[slot] += way;
    records.push_back({LifecycleKind::kTeleport, slot, 0, 0, state.body(slot), bits_of(state.groups())});
    touch(slot);
  }

  State state;
  std::vector<std::uint64_t> numbers;
  std::uint64_t last = 1;
  std::vector<LifecycleRecord> records;  // of the next frame
};

// A server that reads every body in every frame.
struct PlainServer {
  PlainServer(const Layout& layout, const World& world)
      : parts(*make_parts(layout, {},
                          *make_predictor(layout.predictor, layout.capacity, layout.predictor_constants))),
        state(world.state),
        payload(parts.delta.bound()) {
    state.keep_for_predictor(parts.predictor->own_bytes());
  }
  std::span<const std::byte> advance(const World& world, const Drive& drive) {
    parts.predictor->step(state, state, parts.step_input(drive, gravity));
    gravity = drive.gravity;
    parts.delta.set_gravity(gravity);
    const auto encoded = parts.delta.encode(state, world.state, world.records, kNoBudget, payload);
    hash = StateHasher().hash(
        state, {.codec = parts.delta.codec().columns(), .predictor = std::as_bytes(state.own())});
    return std::span(payload).first(encoded.size_bytes);
  }
  TimelineParts parts;
  State state;
  std::vector<std::byte> payload;
  Vec3i gravity = kDown.gravity;
  std::uint64_t hash = 0;
};

// A server, the plain one beside it, a client from the start, and one that joined late.
struct Session {
  Session(const Layout& layout, std::uint32_t threads)
      : world(layout),
        plain(layout, world),
        server(*ServerTimeline::create(layout, kEpoch, {.run_blocks = on_threads(threads)})),
        client(*ClientTimeline::create(layout, {.run_blocks = on_threads(threads)})),
        late(client_of(layout)) {
    server.start(0, world.state, kDown);
    EXPECT_TRUE(client.load(snapshot_of(server), kEpoch));
  }
  void join_late() { ASSERT_TRUE(late.load(snapshot_of(server), kEpoch)); }
  void round_next() {
    server.round_next();
    plain.parts.delta.round_next();
  }
  // Gravity of the frame after the next and all after it.
  void turn_gravity(const Vec3i& gravity) {
    const ScheduledDrive input{++inputs, server.frame() + 2, {gravity, kDown.damping}};
    ASSERT_TRUE(server.schedule(input));
    ASSERT_TRUE(client.schedule(input));
    ASSERT_TRUE(!late.playing() || late.schedule(input));
  }
  void play(int frames) {
    for (int i = 0; i < frames && !testing::Test::HasFatalFailure(); ++i) frame();
  }
  void frame() {
    const auto made = server.advance(world.state, world.records, kNoBudget, nullptr, world.numbers);
    corrected = made.corrected;
    const auto expected = plain.advance(world, server.drive());
    world.records.clear();
    ASSERT_TRUE(std::equal(made.payload.begin(), made.payload.end(), expected.begin(), expected.end()))
        << "frame " << made.frame;
    ASSERT_EQ(made.hash, plain.hash) << "frame " << made.frame;
    ASSERT_EQ(server.state(), plain.state);
    const auto applied = apply(client, made);
    ASSERT_TRUE(applied) << applied.error().message;
    made.frame % 3 == 0 ? client.prepare() : static_cast<void>(client.step(1));
    if (!late.playing()) return;
    const auto followed = apply(late, made);
    ASSERT_TRUE(followed) << followed.error().message;
  }

  World world;
  PlainServer plain;
  ServerTimeline server;
  ClientTimeline client, late;
  std::uint64_t inputs = 0;
  std::uint32_t corrected = 0;  // in the last frame
};

class Silence : public testing::TestWithParam<std::tuple<const char*, const char*, bool, std::uint32_t>> {};

TEST_P(Silence, LeavesNothingOutThatMatters) {
  const auto [codec, predictor, turns, threads] = GetParam();
  constexpr std::uint32_t kSlots = 2 * kBlockSlots + 3000;
  Session session(layout_of(codec, predictor, kSlots, turns), threads);
  World& world = session.world;
  // Long enough for every age to reach its end.
  session.play(290);
  // The codecs of the thesis put nobody to rest.
  EXPECT_EQ(session.corrected == 0, std::string(codec) == "tracker");
  if (testing::Test::HasFatalFailure()) return;

  SCOPED_TRACE("a user stirs a block");
  std::uint32_t stirred = 0;
  for (int i = 0; i < 6; ++i) {
    for (Slot slot = kBlockSlots + 40; slot < kBlockSlots + 90; ++slot) world.push(slot, 900 * (i + 1));
    session.frame();
    stirred += session.corrected;
  }
  EXPECT_GT(stirred, 0U);
  session.play(20);

  SCOPED_TRACE("bodies come and go");
  world.remove(7);
  world.remove(2 * kBlockSlots + 1);
  session.play(3);
  world.spawn(7, 1);
  world.teleport(9, 70'000);
  world.spawn(kSlots - 1, 0);
  session.play(12);

  SCOPED_TRACE("a client joins");
  session.round_next();
  session.frame();
  session.join_late();
  session.play(20);

  SCOPED_TRACE("gravity turns");
  session.turn_gravity({2000, -6000, 0});
  session.play(30);
  session.turn_gravity(kDown.gravity);
  session.play(30);
  world.push(3, -5000);
  session.play(5);
}

std::string name_of(const testing::TestParamInfo<Silence::ParamType>& each) {
  const auto& [codec, predictor, turns, threads] = each.param;
  return std::string(codec) + "_" + predictor + (turns ? "_turning_" : "_") + std::to_string(threads);
}

INSTANTIATE_TEST_SUITE_P(Of, Silence,
                         testing::Values(std::tuple{"tracker", "ballistic", false, 1U},
                                         std::tuple{"tracker", "ballistic", false, 3U},
                                         std::tuple{"tracker", "ballistic", true, 2U},
                                         std::tuple{"tracker", "contact", false, 1U},
                                         std::tuple{"tracker", "field", false, 3U},
                                         std::tuple{"entropy", "ballistic", false, 1U}),
                         name_of);

// Where nobody moves, the step leaves the columns alone.
TEST(SilentBlocks, AreNotRead) {
  const Layout layout = layout_of("tracker", "ballistic", 2 * kBlockSlots);
  Session session(layout, 1);
  session.play(40);
  const auto predictor = *make_predictor("ballistic", layout.capacity, {});
  State state = session.server.state();
  BlockLedger ledger(layout.capacity);
  ledger.renew_all(1);
  const StepInput input{kDown, layout.parameters.step, kThreshold, kDown.gravity};
  predictor->step_blocks(state, state, input, {ledger, ledger, 2, {}});
  EXPECT_EQ(ledger.numbers, (std::vector<std::uint64_t>{2, 2}));
  EXPECT_EQ(ledger.at_rest, (std::vector<std::uint8_t>{1, 1}));
  state.v(0)[5] = 999;  // as nobody may do without renewing the block
  predictor->step_blocks(state, state, input, {ledger, ledger, 3, {}});
  EXPECT_EQ(state.v(0)[5], 999);
  EXPECT_EQ(ledger.numbers, (std::vector<std::uint64_t>{2, 2}));
  ledger.renew_blocks_of(std::vector<Slot>{5, 6}, 4);
  predictor->step_blocks(state, state, input, {ledger, ledger, 5, {}});
  EXPECT_EQ(ledger.numbers, (std::vector<std::uint64_t>{5, 2}));
  StepInput turned = input;
  turned.drive.gravity[0] = 64;
  predictor->step_blocks(state, state, turned, {ledger, ledger, 6, {}});
  EXPECT_EQ(ledger.numbers, (std::vector<std::uint64_t>{6, 6}));
}

// With contacts one block may move and another rest. Of the block that moves, runs of slots that both states
// of a client have in common are left alone.
TEST(SilentBlocks, KeepTheirNumbersWhereOthersTouch) {
  const Layout layout = layout_of("tracker", "field", 2 * kBlockSlots);
  State state(layout.capacity);
  for (Slot slot = 0; slot < layout.capacity; ++slot) {
    state.spawn(slot, 0, 0, {.p = World::place(slot)});
    if (slot == 5) continue;
    state.rest()[slot] = 1;
    state.c(1)[slot] = -kDown.gravity[1];
  }
  State other(layout.capacity);
  BlockLedger ledger(layout.capacity), ledger_of_other(layout.capacity);
  ledger.renew_all(1);
  const auto predictor = *make_predictor("field", layout.capacity, layout.predictor_constants);
  const StepInput input{kDown, layout.parameters.step, kThreshold, kDown.gravity};
  predictor->step_blocks(state, other, input, {ledger, ledger_of_other, 2, {}});
  EXPECT_EQ(ledger_of_other.numbers, (std::vector<std::uint64_t>{2, 1}));
  EXPECT_EQ(ledger_of_other.at_rest, (std::vector<std::uint8_t>{0, 1}));
  EXPECT_EQ(ledger_of_other.runs[0], 2U);
  EXPECT_EQ(ledger_of_other.runs[1], 1U);
  // As nobody may do without renewing the runs.
  state.v(0)[BlockLedger::kRunSlots] = 999;
  state.v(0)[kBlockSlots] = 999;
  predictor->step_blocks(other, state, input, {ledger_of_other, ledger, 3, {}});
  EXPECT_EQ(state.v(0)[BlockLedger::kRunSlots], 999);
  EXPECT_EQ(state.v(0)[kBlockSlots], 999);
  EXPECT_EQ(ledger.numbers, (std::vector<std::uint64_t>{3, 1}));
  const std::vector<Slot> touched{BlockLedger::kRunSlots, kBlockSlots};
  ledger.renew_blocks_of(touched, 4);
  EXPECT_EQ(ledger.numbers, (std::vector<std::uint64_t>{4, 4}));
  EXPECT_EQ(ledger.runs[0], 3U);
  EXPECT_EQ(ledger.runs[1], 4U);
  predictor->step_blocks(other, state, input, {ledger_of_other, ledger, 5, {}});
  EXPECT_EQ(state.v(0)[BlockLedger::kRunSlots], 0);
  EXPECT_EQ(state.v(0)[kBlockSlots], 0);
}

TEST(SilentBlocks, KeepTheirLeaves) {
  Random random(3);
  State state = random_state(random, kBlockSlots + 50);
  StateHasher hasher, plain;
  std::vector<std::uint64_t> numbers{1, 1};
  const std::vector<std::byte> columns(2 * std::size_t{state.capacity()}, std::byte{3});
  std::vector<std::uint64_t> of_columns{1, 1};
  const auto hash = [&] {
    return hasher.hash(state, {.codec = columns, .predictor = {}}, {}, {numbers, of_columns});
  };
  const auto expected = [&] { return plain.hash(state, {.codec = columns, .predictor = {}}); };
  const std::uint64_t before = hash();
  EXPECT_EQ(before, expected());
  state.p(0)[kBlockSlots + 3] += 5;
  EXPECT_EQ(hash(), before) << "it does not read what has not changed";
  numbers[1] = 2;
  EXPECT_EQ(hash(), expected());
  state.p(0)[1] += 5;
  numbers[0] = 0;
  EXPECT_EQ(hash(), expected());
  state.p(0)[1] += 5;
  EXPECT_EQ(hash(), expected()) << "0 is no number";
}

// At 100,000 bodies, with bodies that move in some blocks only.
TEST(Threads, GiveTheSameBits) {
  const Layout layout = layout_of("tracker", "ballistic", 100'000);
  std::vector<std::vector<std::byte>> payloads;
  std::vector<std::uint64_t> hashes;
  for (const std::uint32_t threads : {1U, 2U, 3U}) {
    World world(layout);
    auto server = *ServerTimeline::create(layout, kEpoch, {.run_blocks = on_threads(threads)});
    auto client = *ClientTimeline::create(layout, {.run_blocks = on_threads(threads)});
    server.start(0, world.state, kDown);
    ASSERT_TRUE(client.load(snapshot_of(server), kEpoch));
    for (int frame = 0; frame < 30; ++frame) {
      for (Slot slot = 30'000; slot < 50'000; ++slot) {
        if (frame > 5) world.push(slot, 300 + static_cast<std::int32_t>(slot % 700));
      }
      const auto made = server.advance(world.state, {}, kNoBudget, nullptr, world.numbers);
      ASSERT_TRUE(apply(client, made));
      client.step(1);
      const std::vector<std::byte> bytes(made.payload.begin(), made.payload.end());
      if (threads == 1) {
        payloads.push_back(bytes);
        hashes.push_back(made.hash);
        continue;
      }
      ASSERT_EQ(bytes, payloads[static_cast<std::size_t>(frame)]) << threads << " threads, frame " << frame;
      ASSERT_EQ(made.hash, hashes[static_cast<std::size_t>(frame)]);
    }
  }
}

}  // namespace
}  // namespace tandem
