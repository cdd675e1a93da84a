// tandem::HandedColumns: a loop of its own that hands over columns, over DDS.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <thread>

#include "tandem/host.hpp"

namespace tandem {
namespace {

constexpr std::uint32_t kBodies = 4;

void fill(HandedColumns& columns, float x) {
  for (std::uint32_t s = 0; s < kBodies; ++s) columns.position(0)[s] = x + static_cast<float>(s);
}

engine::Input input_of(engine::InputKind kind, std::vector<double> values) {
  return {.kind = static_cast<std::uint32_t>(kind), .values = std::move(values)};
}

class ColumnsTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    ::setenv("CYCLONEDDS_URI",
             "<CycloneDDS><Domain id=\"any\"><General><Interfaces><NetworkInterface name=\"lo\" "
             "multicast=\"true\"/></Interfaces></General><Discovery><Tag>columns-test</Tag></Discovery>"
             "</Domain></CycloneDDS>",
             1);
  }
  ColumnsTest() {
    fill(columns, 0);
    std::ranges::fill(columns.alive(), std::uint8_t{1});
  }
  HandedColumns columns{
      {.capacity = kBodies, .dt_s = 0.01, .most_gravity = 10, .most_push = 5, .most_bytes = 3}};
  ServerOptions options{.session = "columns", .domain = 71};
};

TEST_F(ColumnsTest, ALoopOfItsOwnIsPacedByTheServerAndSeesInputs) {
  auto server = Server::start(options, columns);
  ASSERT_TRUE(server.has_value()) << server.error().message;
  int frames = 0, pushes = 0;
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds{20};
  while (server->poll() && frames < 20 && std::chrono::steady_clock::now() < end) {
    if (!columns.wanted()) continue;
    for (const engine::Input& input : columns.take_inputs()) pushes += input.kind == 2 ? 1 : 0;
    if (frames == 5) {
      ASSERT_TRUE(server->inject(input_of(engine::InputKind::kPush, {0, 0, 0, 1, 1, 0, 0})).has_value());
      EXPECT_FALSE(server->inject(input_of(engine::InputKind::kPush, {0, 0, 0, 1, 9, 0, 0})).has_value());
    }
    EXPECT_FALSE(columns.wanted() && !columns.wanted()) << "it stays wanted";
    fill(columns, static_cast<float>(++frames));
    columns.hand_over();
    columns.hand_over();
    EXPECT_FALSE(columns.wanted());
  }
  EXPECT_EQ(frames, 20) << server->error().message;
  EXPECT_GE(server->status().frame, 19U);
  EXPECT_EQ(pushes, 1);
}

TEST_F(ColumnsTest, AnotherThreadMayHandOver) {
  auto server = Server::start(options, columns);
  ASSERT_TRUE(server.has_value()) << server.error().message;
  std::atomic<bool> over{false};
  std::thread loop([&] {
    for (float x = 1; !over; x += 1) {
      while (!columns.wanted() && !over) std::this_thread::sleep_for(std::chrono::milliseconds{1});
      fill(columns, x);
      columns.hand_over();
    }
  });
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds{20};
  while (server->poll() && server->status().frame < 20 && std::chrono::steady_clock::now() < end) {
  }
  over = true;
  loop.join();
  EXPECT_GE(server->status().frame, 20U) << server->error().message;
}

// What a server does with a simulation, without one.
bool step(HandedColumns& columns) {
  columns.begin_step();
  EXPECT_FALSE(columns.step_ready());
  EXPECT_TRUE(columns.wanted());
  columns.hand_over();
  return columns.step_ready();
}

TEST_F(ColumnsTest, SlotsTellBirthsAndDeaths) {
  ASSERT_TRUE(step(columns));
  EXPECT_TRUE(columns.events().empty());
  columns.alive()[1] = 0;
  columns.alive()[2] = 2;
  ASSERT_TRUE(step(columns));
  ASSERT_EQ(columns.events().size(), 3U);
  EXPECT_EQ(columns.events()[0].slot, 1U);
  EXPECT_EQ(columns.events()[1].kind, engine::Event::Kind::kDespawned);
  EXPECT_EQ(columns.events()[2].kind, engine::Event::Kind::kSpawned);
}

TEST_F(ColumnsTest, InputsAreRefusedByWhatTheLoopSaid) {
  using Kind = engine::InputKind;
  const auto why = [&](const engine::Input& input) { return columns.classify(input).reason; };
  EXPECT_EQ(why(input_of(Kind::kGravity, {0, 9, 0})), "");
  EXPECT_EQ(why(input_of(Kind::kGravity, {0, 11, 0})), "this gravity is too large");
  EXPECT_EQ(why(input_of(Kind::kGravity, {0, 9})), "gravity takes 3 values");
  EXPECT_EQ(why(input_of(Kind::kPush, {0, 0, 0, 0, 1, 0, 0})), "a push's radius must be above 0");
  EXPECT_EQ(why({.kind = 16, .bytes = std::vector<std::byte>(4)}), "this input has too many bytes");
  EXPECT_EQ(why({.kind = 77}), "this simulation takes no input of this kind");
  HandedColumns none({.capacity = 1});
  EXPECT_EQ(none.classify(input_of(Kind::kGravity, {0, 0, 0})).reason, "this simulation takes no gravity");
}

TEST_F(ColumnsTest, WhatTheLoopSavesIsLoadedWithTheGravityInForce) {
  std::uint64_t state = 7;
  const HandedColumnsOptions saves{.capacity = 1,
                                   .most_gravity = 10,
                                   .save =
                                       [&] {
                                         std::vector<std::byte> bytes(sizeof state);
                                         std::memcpy(bytes.data(), &state, sizeof state);
                                         return bytes;
                                       },
                                   .load =
                                       [&](std::span<const std::byte> bytes) {
                                         if (bytes.size() != sizeof state) return false;
                                         std::memcpy(&state, bytes.data(), sizeof state);
                                         return true;
                                       }};
  HandedColumns first(saves), second(saves);
  first.apply(input_of(engine::InputKind::kGravity, {1, 2, 3}));
  std::vector<std::byte> bytes, nothing;
  first.save(bytes);
  columns.save(nothing);
  EXPECT_TRUE(nothing.empty());
  state = 8;
  ASSERT_TRUE(second.load(bytes));
  EXPECT_EQ(state, 7U);
  EXPECT_EQ(second.gravity(), (engine::Vec3{1, 2, 3}));
  bytes.pop_back();
  EXPECT_FALSE(second.load(bytes));
  EXPECT_FALSE(second.load({}));
}

}  // namespace
}  // namespace tandem
