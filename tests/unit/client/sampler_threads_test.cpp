// A sample of many bodies on several threads.

#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <random>
#include <vector>

#include "sdk/client/drawing/picture.hpp"
#include "sdk/client/drawing/sampler.hpp"
#include "sdk/workers/workers.hpp"

namespace tandem::client {
namespace {

constexpr std::uint32_t kBodies = 100'000;

// Packed columns, and columns in an array of the application's own structs.
struct ManyColumns {
  std::vector<float> positions = std::vector<float>(3 * kBodies),
                     velocities = std::vector<float>(3 * kBodies);
  std::vector<std::uint8_t> changes = std::vector<std::uint8_t>(kBodies);
  std::vector<std::byte> structs = std::vector<std::byte>(40 * std::size_t{kBodies});
  friend bool operator==(const ManyColumns&, const ManyColumns&) = default;
};

SampleColumns columns_of(ManyColumns& taken, bool strided) {
  SampleColumns columns{.capacity = kBodies};
  columns.changes = packed(taken.changes.data());
  if (strided) {
    std::byte* const at = taken.structs.data();
    columns.positions = {reinterpret_cast<float*>(at), 40};
    columns.velocities = {reinterpret_cast<float*>(at + 12), 40};
    columns.orientations = {reinterpret_cast<float*>(at + 24), 40};
  } else {
    columns.positions = packed(taken.positions.data(), 3);
    columns.velocities = packed(taken.velocities.data(), 3);
  }
  return columns;
}

State random_state(std::mt19937& random) {
  State state(kBodies, {.orientation = true});
  const auto any = [&](std::int32_t most) {
    return static_cast<std::int32_t>(random() % static_cast<std::uint32_t>(2 * most)) - most;
  };
  for (Slot slot = 0; slot < kBodies; ++slot) {
    if (random() % 50 == 0) continue;
    state.spawn(slot, static_cast<std::uint8_t>(random() % 2), 0,
                {.p = {any(1 << 24), any(1 << 24), any(1 << 24)},
                 .v = {any(1 << 12), any(1 << 12), any(1 << 12)},
                 .w = {any(1 << 20), any(1 << 20), any(1 << 20)}});
  }
  return state;
}

TEST(SamplerThreads, GiveTheSameBits) {
  std::mt19937 random(4);
  std::array<DrawnFrame, 4> frames;
  const std::vector<std::uint8_t> jumps(kBodies);
  Accelerations accelerations;
  accelerations.forget(kBodies);
  accelerations.gravity = {0, -300, 0};
  for (Frame frame = 0; frame < frames.size(); ++frame)
    draw(random_state(random), frame, jumps, accelerations, frames[frame]);

  Workers workers(3);
  const RunBlocks run = [&](std::uint32_t count, const std::function<void(std::uint32_t)>& job) {
    workers.run(count, 1, [&job](std::uint32_t begin, std::uint32_t end) {
      for (std::uint32_t i = begin; i < end; ++i) job(i);
    });
  };
  Sampler alone, together;
  auto one = std::make_unique<ManyColumns>(), other = std::make_unique<ManyColumns>();
  std::int64_t now_ns = 1'000'000'000;
  for (std::size_t i = 0; i < 8; ++i, now_ns += 21'000'000) {
    Picture picture{.epoch = 5, .lattice_unit = 0.001, .load = 1 + i / 5, .pacer = Pacer(30)};
    picture.before = &frames[i % 2];
    picture.agreed = &frames[i % 2 + 1];
    picture.ahead = &frames[i % 2 + 2];
    picture.agreed_ns = now_ns;
    picture.echo = GravityEcho{{0, 500, 0}, 2.0};
    const SampleRequest request{.mode = i % 3 == 0 ? SampleMode::kInterpolate : SampleMode::kExtrapolate};
    const auto a = alone.sample(picture, request, columns_of(*one, i % 2 == 1), now_ns);
    const auto b = together.sample(picture, request, columns_of(*other, i % 2 == 1), now_ns, run);
    ASSERT_TRUE(a && b);
    EXPECT_EQ(a->alive, b->alive);
    ASSERT_TRUE(*one == *other) << "sample " << i;
  }
}

}  // namespace
}  // namespace tandem::client
