#include "sdk/core/codec/tracker/tracker.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <thread>
#include <vector>

#include "sdk/core/codec/tracker/filter.hpp"
#include "sdk/core/timeline/timeline.hpp"
#include "tests/property/synthetic.hpp"

namespace tandem::of_both_ends {
namespace {

using synthetic::Random;
using Bytes = std::vector<std::byte>;

constexpr StreamParameters kParameters{{200, 1, 1}};

Bytes coder_state(const DeltaCodec& delta) { return synthetic::coder_state(delta.codec()); }

Layout layout_of(std::uint32_t capacity) {
  Layout layout;
  layout.capacity = capacity;
  layout.type_count = synthetic::kTypes;
  layout.codec = "tracker";
  layout.parameters = kParameters;
  layout.parameters.step.decay = 800;  // nothing chooses it here: what suits bodies at rest
  layout.predictor = "ballistic";
  return layout;
}

TEST(Tracker, ASnapshotInMidStreamContinuesToTheBit) {
  constexpr std::uint64_t kSeed = 31;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  Random random(kSeed);
  const Layout layout = layout_of(2 * kBlockSlots / 16);
  auto server = *ServerTimeline::create(layout, 1);
  server.start(0, synthetic::random_state(random, layout.capacity), {{0, -640, 0}, 300});
  std::vector<ClientTimeline> clients;
  Bytes snapshot;
  for (int frame = 0; frame < 60; ++frame) {
    if (frame % 15 == 0) {
      server.snapshot(snapshot);
      clients.push_back(*ClientTimeline::create(layout));
      ASSERT_TRUE(clients.back().load(snapshot, 1));
    }
    State target = synthetic::random_target(random, server.state(), 6);
    const auto lifecycle = synthetic::random_lifecycle(random, server.state(), target, 200);
    const auto delta = server.advance(target, lifecycle, random.one_in(4) ? 500 : kNoBudget);
    for (ClientTimeline& client : clients) {
      const auto applied = client.apply(delta.frame, delta.last_input, delta.hash, delta.payload);
      ASSERT_TRUE(applied) << applied.error().message;
    }
  }
}

TEST(Tracker, BlocksCodedSideBySideGiveTheSameBytes) {
  constexpr std::uint64_t kSeed = 35;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  Random random(kSeed);
  constexpr std::uint32_t kCapacity = 3 * kBlockSlots + 100;
  const RunBlocks in_reverse_on_threads = [](std::uint32_t count,
                                             const std::function<void(std::uint32_t)>& job) {
    std::vector<std::jthread> threads;
    for (std::uint32_t i = count; i-- > 0;) threads.emplace_back(job, i);
  };
  DeltaCodec alone = synthetic::make_delta("tracker", kCapacity, kParameters);
  DeltaCodec together = synthetic::make_delta("tracker", kCapacity, kParameters, in_reverse_on_threads);
  DeltaCodec client = synthetic::make_delta("tracker", kCapacity, kParameters, in_reverse_on_threads);
  Bytes out(alone.bound());
  Bytes same(alone.bound());
  State agreed = synthetic::random_state(random, kCapacity);
  State also = agreed;
  State held = agreed;
  for (int frame = 0; frame < 6; ++frame) {
    State target = synthetic::random_target(random, agreed, 4);
    const auto lifecycle = synthetic::random_lifecycle(random, agreed, target, 300);
    const std::size_t budget = frame == 3 ? 5000 : kNoBudget;
    const auto encoded = alone.encode(agreed, target, lifecycle, budget, out);
    ASSERT_EQ(together.encode(also, target, lifecycle, budget, same).size_bytes, encoded.size_bytes);
    const auto payload = std::span(out).first(encoded.size_bytes);
    ASSERT_TRUE(std::ranges::equal(payload, std::span(same).first(encoded.size_bytes)));
    ASSERT_TRUE(synthetic::receive(client, held, payload));
    ASSERT_EQ(held, agreed);
    ASSERT_EQ(also, agreed);
    ASSERT_TRUE(std::ranges::equal(client.touched(), alone.touched()));
    ASSERT_EQ(coder_state(client), coder_state(alone));
  }
}

TEST(Tracker, SpawnTeleportAndDespawnForgetTheBody) {
  for (const LifecycleKind kind :
       {LifecycleKind::kSpawn, LifecycleKind::kTeleport, LifecycleKind::kDespawn}) {
    DeltaCodec server = synthetic::make_delta("tracker", 2, kParameters);
    Bytes out(server.bound());
    State agreed(2);
    for (Slot slot = 0; slot < 2; ++slot) agreed.spawn(slot, 0, 0, {});
    State target = agreed;
    for (Slot slot = 0; slot < 2; ++slot) target.p(1)[slot] = 3000;
    server.encode(agreed, target, {}, kNoBudget, out);
    server.encode(agreed, target, {}, kNoBudget, out);
    const auto remembered = [&server](Slot slot) {
      int sum = 0;
      for (std::size_t at = slot; at < 10; at += 2)
        sum += server.codec().columns()[at] != std::byte{0} ? 1 : 0;
      return sum;
    };
    EXPECT_GT(remembered(0), 1);
    std::vector<LifecycleRecord> records;
    if (kind == LifecycleKind::kSpawn) records.push_back({LifecycleKind::kDespawn, 0, 0, 0, {}});
    records.push_back({kind, 0, 1, 0, {}});
    target = agreed;
    target.despawn(0);
    if (kind != LifecycleKind::kDespawn) target.spawn(0, kind == LifecycleKind::kSpawn ? 1 : 0, 0, {});
    server.encode(agreed, target, records, kNoBudget, out);
    EXPECT_EQ(agreed, target);
    EXPECT_EQ(remembered(0), 0);
    EXPECT_GT(remembered(1), 1);
  }
}

TEST(Tracker, ARefusedDeltaLeavesCoderAndBodiesUntouched) {
  constexpr std::uint64_t kSeed = 32;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  Random random(kSeed);
  DeltaCodec server = synthetic::make_delta("tracker", 60, kParameters);
  DeltaCodec client = synthetic::make_delta("tracker", 60, kParameters);
  Bytes out(server.bound());
  State agreed = synthetic::random_state(random, 60);
  State held = agreed;
  int refused = 0;
  for (int frame = 0; frame < 100; ++frame) {
    State target = synthetic::random_target(random, agreed, 3);
    const auto lifecycle = synthetic::random_lifecycle(random, agreed, target, 30);
    const Bytes payload(
        out.begin(), out.begin() + static_cast<std::ptrdiff_t>(
                                       server.encode(agreed, target, lifecycle, kNoBudget, out).size_bytes));
    const Bytes before = coder_state(client);
    const State held_before = held;
    for (int i = 0; i < 50; ++i) {
      Bytes mutated = payload;
      synthetic::mutate(random, mutated);
      DeltaCodec probe = synthetic::make_delta("tracker", 60, kParameters);
      ASSERT_TRUE(synthetic::load_coder_state(probe.codec(), before, held.alive()));
      State state = held;
      if (synthetic::receive(probe, state, mutated)) {
        ASSERT_EQ(synthetic::broken_invariant(state), nullptr);
        continue;
      }
      ++refused;
      ASSERT_EQ(state, held);
      ASSERT_FALSE(synthetic::receive(client, held, mutated));
      ASSERT_EQ(coder_state(client), before);
      ASSERT_EQ(held, held_before);
    }
    ASSERT_TRUE(synthetic::receive(client, held, payload));
    ASSERT_EQ(held, agreed);
    ASSERT_EQ(coder_state(client), coder_state(server));
  }
  EXPECT_GT(refused, 500);
}

TEST(Tracker, RefusesCoderStatesThatAreNone) {
  constexpr std::uint64_t kSeed = 33;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  Random random(kSeed);
  DeltaCodec server = synthetic::make_delta("tracker", 20, kParameters);
  Bytes out(server.bound());
  State agreed = synthetic::random_state(random, 20, 0);
  for (int frame = 0; frame < 20; ++frame) {
    server.encode(agreed, synthetic::random_target(random, agreed, 2), {}, kNoBudget, out);
  }
  const Bytes good = coder_state(server);
  DeltaCodec client = synthetic::make_delta("tracker", 20, kParameters);
  EXPECT_TRUE(synthetic::load_coder_state(client.codec(), good, agreed.alive()));
  EXPECT_EQ(coder_state(client), good);
  Bytes impossible_age = good;
  impossible_age[3] = std::byte{255};
  EXPECT_EQ(synthetic::load_coder_state(client.codec(), impossible_age, agreed.alive()).error().code,
            ErrorCode::kMalformed);
  Bytes impossible_steps = good;
  impossible_steps[2 * 20 + 3] = std::byte{0x80};
  EXPECT_FALSE(synthetic::load_coder_state(client.codec(), impossible_steps, agreed.alive()));
  std::vector<std::uint8_t> dead(agreed.alive().begin(), agreed.alive().end());
  dead[static_cast<std::size_t>(
      std::find_if(good.begin(), good.begin() + 20, [](std::byte age) { return age != std::byte{0}; }) -
      good.begin())] = 0;
  EXPECT_FALSE(synthetic::load_coder_state(client.codec(), good, dead));
  Bytes longer = good;
  longer.resize(good.size() + 8, std::byte{1});
  EXPECT_FALSE(synthetic::load_coder_state(client.codec(), longer, agreed.alive()));
  for (std::size_t size = 0; size < server.codec().columns().size(); ++size) {
    EXPECT_FALSE(synthetic::load_coder_state(client.codec(), std::span(good).first(size), agreed.alive()));
  }
  EXPECT_EQ(coder_state(client), good);
}

TEST(Tracker, AThresholdThatChangesActsInItsOwnDelta) {
  DeltaCodec server = synthetic::make_delta("tracker", 1, kParameters);
  DeltaCodec client = synthetic::make_delta("tracker", 1, kParameters);
  Bytes out(server.bound());
  State agreed(1);
  agreed.spawn(0, 0, 0, {});
  State held = agreed;
  State target = agreed;
  target.p(0)[0] = 150;
  EXPECT_EQ(server.encode(agreed, target, {}, kNoBudget, out).corrected, 0U);
  ASSERT_TRUE(synthetic::receive(client, held, {}));
  server.set_parameters({{100, 1, 1}});
  const auto encoded = server.encode(agreed, target, {}, kNoBudget, out);
  EXPECT_EQ(encoded.corrected, 1U);
  ASSERT_TRUE(synthetic::receive(client, held, std::span(out).first(encoded.size_bytes)));
  EXPECT_EQ(held, agreed);
  EXPECT_NEAR(held.p(0)[0], 150, 100);
}

TEST(Tracker, ABodyAtRestOnOthersIsCorrectedRarely) {
  // Gravity pulls the predicted body down every frame; the full simulation holds it. Without a learned
  // acceleration it would be off by the threshold after every six frames.
  auto server = *ServerTimeline::create(layout_of(1), 1);
  State start(1);
  start.spawn(0, 0, 0, {});
  server.start(0, start, {{0, -700, 0}, 20});
  std::uint32_t late = 0;
  for (int frame = 0; frame < 1000; ++frame) {
    const auto delta = server.advance(start, {});
    if (frame >= 500) late += delta.corrected;
  }
  EXPECT_LT(late, 70U);
}

TEST(Tracker, CorrectionsBeyondTheCapacityRepeatedOrEmptyAreRefused) {
  DeltaCodec client = synthetic::make_delta("tracker", 4, kParameters);
  Random random(34);
  State state = synthetic::random_state(random, 4, 0);
  const auto refused = [&](std::initializer_list<int> bytes) {
    Bytes payload;
    for (const int byte : bytes) payload.push_back(static_cast<std::byte>(byte));
    return !synthetic::receive(client, state, payload);
  };
  EXPECT_TRUE(refused({0x83, 0}));                  // no block
  EXPECT_TRUE(refused({0x86}));                     // nothing
  EXPECT_TRUE(refused({0x83, 1, 1}));               // block 1 of 1
  EXPECT_TRUE(refused({0x83, 4, 0, 255, 255, 0}));  // a zero that nobody writes
  EXPECT_TRUE(refused({0x83, 11, 0, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255}));
  EXPECT_TRUE(refused({0x86, 255, 255, 0}));
}

}  // namespace
}  // namespace tandem::of_both_ends
