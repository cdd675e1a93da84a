#include <gtest/gtest.h>

#include "sdk/core/codec/paper/residual.hpp"
#include "sdk/core/codec/tracker/tracker.hpp"
#include "tests/property/synthetic.hpp"

namespace tandem {
namespace {

using synthetic::Random;
using Bytes = std::vector<std::byte>;

constexpr StreamParameters kParameters{{200, 1, 1}};

TEST(TrackerBudget, IsNeverExceededByAByteAndSpentOnTheLargestErrors) {
  constexpr std::uint64_t kSeed = 21;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  Random random(kSeed);
  const State start = synthetic::random_state(random, 300);
  const State target = synthetic::random_target(random, start, 2);
  for (std::size_t budget = 0; budget < 700; ++budget) {
    DeltaCodec server = synthetic::make_delta("tracker", 300, kParameters);
    DeltaCodec client = synthetic::make_delta("tracker", 300, kParameters);
    Bytes out(server.bound());
    State agreed = start;
    const auto encoded = server.encode(agreed, target, {}, budget, out);
    ASSERT_LE(encoded.correction_bytes, budget);
    State held = start;
    ASSERT_TRUE(synthetic::receive(client, held, std::span(out).first(encoded.size_bytes)));
    ASSERT_EQ(held, agreed);
    // Beyond 2^24 lattice units errors count alike.
    const auto error_of = [&](Slot slot) {
      return std::min(error_squared(start, target, slot), (std::uint64_t{1} << 48U) - 1);
    };
    std::uint64_t least_sent = UINT64_MAX;
    for (const Slot slot : server.touched()) least_sent = std::min(least_sent, error_of(slot));
    for (Slot slot = 0; slot < 300; ++slot) {
      if (agreed.body(slot) == start.body(slot) && encoded.corrected > 0) {
        const std::uint64_t error = error_of(slot);
        ASSERT_TRUE(error <= 40'000 || error <= least_sent);
      }
    }
  }
}

TEST(TrackerBudget, ABodyThatWaitsIsServedThoughOthersAreAlwaysFurtherOff) {
  constexpr std::uint32_t kBodies = 40;
  DeltaCodec server = synthetic::make_delta("tracker", kBodies, kParameters);
  Bytes out(server.bound());
  State agreed(kBodies);
  for (Slot slot = 0; slot < kBodies; ++slot) agreed.spawn(slot, 0, 0, {});
  bool served = false;
  for (int frame = 1; frame <= 200 && !served; ++frame) {
    State target = agreed;
    for (Slot slot = 1; slot < kBodies; ++slot) target.p(0)[slot] = agreed.p(0)[slot] + 2000;
    target.p(0)[0] = 300;
    server.encode(agreed, target, {}, 24, out);
    served = agreed.p(0)[0] != 0;
  }
  EXPECT_TRUE(served);
}

TEST(TrackerBudget, FewBytesAreEnoughToMoveManyBodiesOn) {
  constexpr std::uint32_t kBodies = 20'000;  // two blocks, one as large as it can be
  DeltaCodec server = synthetic::make_delta("tracker", kBodies, kParameters);
  DeltaCodec client = synthetic::make_delta("tracker", kBodies, kParameters);
  Bytes out(server.bound());
  State agreed(kBodies);
  for (Slot slot = 0; slot < kBodies; ++slot) agreed.spawn(slot, 0, 0, {});
  State held = agreed;
  int moved = 0;
  // First all of them at once, so that corrections seem likely; then few bytes.
  for (int frame = 0; frame < 80; ++frame) {
    State target = agreed;
    for (Slot slot = 0; slot < kBodies; ++slot) target.p(0)[slot] = agreed.p(0)[slot] + 2000;
    const bool free = frame < 10;
    const auto encoded = server.encode(agreed, target, {}, free ? kNoBudget : 64, out);
    ASSERT_TRUE(free || encoded.size_bytes <= 64);
    ASSERT_TRUE(synthetic::receive(client, held, std::span(out).first(encoded.size_bytes)));
    ASSERT_EQ(held, agreed);
    moved += frame >= 40 && encoded.corrected > 0 ? 1 : 0;
  }
  EXPECT_GT(moved, 20);
}

TEST(TrackerBudget, CountsTheParametersToo) {
  DeltaCodec server = synthetic::make_delta("tracker", 300, kParameters);
  Bytes out(server.bound());
  State agreed(300);
  for (Slot slot = 0; slot < 300; ++slot) agreed.spawn(slot, 0, 0, {});
  for (std::int32_t frame = 1; frame <= 20; ++frame) {
    State target = agreed;
    for (Slot slot = 0; slot < 300; ++slot) target.p(0)[slot] = agreed.p(0)[slot] + 2000;
    StreamParameters parameters = kParameters;
    parameters.codec.threshold += frame;
    server.set_parameters(parameters);
    EXPECT_LE(server.encode(agreed, target, {}, 64, out).size_bytes, 64U);
  }
}

TEST(TrackerBudget, WithoutOneEveryBodyEndsWithinTheThreshold) {
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Random random(seed);
    const auto capacity = static_cast<std::uint32_t>(1 + random.below(seed % 20 == 0 ? 40'000 : 500));
    const auto threshold = static_cast<std::int32_t>(1 + random.below(1U << random.below(20)));
    DeltaCodec server = synthetic::make_delta("tracker", capacity, {threshold, 1, 1});
    Bytes out(server.bound());
    State agreed = synthetic::random_state(random, capacity);
    for (int frame = 0; frame < 4; ++frame) {
      const State target = synthetic::random_target(random, agreed, 1 + random.below(4));
      server.encode(agreed, target, {}, kNoBudget, out);
      const auto limit =
          static_cast<std::uint64_t>(threshold + 1) * static_cast<std::uint64_t>(threshold + 1);
      for (Slot slot = 0; slot < capacity; ++slot) ASSERT_LE(error_squared(agreed, target, slot), limit);
    }
  }
}

}  // namespace
}  // namespace tandem
