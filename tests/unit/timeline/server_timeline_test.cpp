#include <gtest/gtest.h>

#include "sdk/core/predict/ballistic/ballistic.hpp"
#include "sdk/core/tables/codec_table.hpp"
#include "sdk/core/timeline/snapshot.hpp"
#include "tests/unit/timeline/session.hpp"

namespace tandem {
namespace {

using namespace synthetic;

TEST(ServerTimeline, RefusesConfigurationsThatMakeNoSession) {
  const auto code = [](const Layout& layout) { return ServerTimeline::create(layout, 1).error().code; };
  Layout layout = layout_for("none", 10);
  layout.codec = "zip";
  EXPECT_EQ(code(layout), ErrorCode::kUnsupported);
  layout = layout_for("none", 10);
  layout.predictor = "oracle";
  EXPECT_EQ(code(layout), ErrorCode::kUnsupported);
  EXPECT_EQ(code(layout_for("none", 0)), ErrorCode::kInvalidArgument);
  EXPECT_EQ(code(layout_for("none", kMaxCapacity + 1)), ErrorCode::kInvalidArgument);
  EXPECT_EQ(code(layout_for("none", 10, kMaxLead + 1)), ErrorCode::kInvalidArgument);
  layout = layout_for("none", 10);
  layout.parameters.codec.threshold = 0;
  EXPECT_EQ(code(layout), ErrorCode::kInvalidArgument);
  layout = layout_for("none", 10);
  layout.type_count = 0;
  EXPECT_EQ(code(layout), ErrorCode::kInvalidArgument);
}

TEST(ServerTimeline, ASnapshotAfterARoundedFrameIsSmallerAndAClientFollowsFromIt) {
  Random random(3);
  Layout layout = layout_for("tracker", 1000);
  layout.parameters.codec.threshold = 4096;
  auto server = server_of(layout);
  auto rounded = server_of(layout);
  auto client = client_of(layout);
  const State start = random_state(random, 1000);
  const Drive drive{{0, -640, 0}, 10};
  server.start(7, start, drive);
  rounded.start(7, start, drive);
  ASSERT_TRUE(client.load(snapshot_of(rounded), kEpoch));
  client.step(1);
  State target = random_target(random, start, 3);
  server.advance(target, {});
  rounded.round_next();
  ASSERT_TRUE(apply(client, rounded.advance(target, {})));
  EXPECT_EQ(client.state(8), rounded.state());
  // 9, 13 and 10 bits on each axis; of c most are 0.
  EXPECT_LT(snapshot_of(rounded).size() + rounded.state().alive_count() * 3 * 22 / 8 * 9 / 10,
            snapshot_of(server).size());
  auto late = client_of(layout);
  ASSERT_TRUE(late.load(snapshot_of(rounded), kEpoch));
  client.step(1);
  late.step(1);
  const auto next = rounded.advance(target, {});
  EXPECT_TRUE(apply(client, next));
  EXPECT_TRUE(apply(late, next));
  EXPECT_EQ(late.state(9), client.state(9));
}

TEST(ServerTimeline, AFrameThatTheTargetPredictsCostsNothing) {
  Random random(1);
  const State start = random_state(random, 50);
  const Drive drive{{0, -640, 0}, 10};
  auto server = server_of(layout_for("entropy", 50));
  server.start(7, start, drive);
  State target(50);
  Ballistic().step(start, target, {drive, {}});
  const auto frame = server.advance(target, {});
  EXPECT_EQ(frame.frame, 8U);
  EXPECT_EQ(frame.last_input, 0U);
  EXPECT_TRUE(frame.payload.empty());
  EXPECT_EQ(server.state(), target);
  EXPECT_EQ(frame.hash, StateHasher().hash(target));
}

TEST(ServerTimeline, AScheduledDriveActsInTheStepThatProducesItsFrame) {
  auto server = server_of(layout_for("entropy", 1));
  State state(1);
  state.spawn(0, 0, 0, {});
  server.start(0, state, Drive{});
  ASSERT_TRUE(server.schedule({1, 2, Drive{{640, 0, 0}, 0}}));
  EXPECT_EQ(server.advance(state, {}).last_input, 1U);
  EXPECT_EQ(server.drive().gravity[0], 0);
  server.advance(state, {});
  EXPECT_EQ(server.drive().gravity[0], 640);
  EXPECT_EQ(server.state().p(0)[0], 10);
  server.advance(state, {});
  EXPECT_EQ(server.state().p(0)[0], 30) << "in force from then on";
}

TEST(ServerTimeline, InputsAreNumberedWithoutGapsAndLieInTheFuture) {
  auto server = server_of(layout_for("entropy", 1));
  server.start(5, State(1), Drive{});
  EXPECT_EQ(server.schedule({2, 9, {}}).error().code, ErrorCode::kOutOfOrder);
  EXPECT_EQ(server.schedule({1, 5, {}}).error().code, ErrorCode::kOutOfOrder);
  EXPECT_EQ(server.schedule({1, 6, Drive{{INT32_MIN, 0, 0}, 0}}).error().code, ErrorCode::kInvalidArgument);
  EXPECT_TRUE(server.schedule({1, 6, {}}));
  EXPECT_EQ(server.schedule({1, 7, {}}).error().code, ErrorCode::kOutOfOrder);
}

TEST(ServerTimeline, TimesAreMeasuredByTheClockItIsGiven) {
  auto server = server_of(layout_for("entropy", 1));
  server.start(0, State(1), Drive{});
  EXPECT_EQ(server.advance(State(1), {}).predict_ns, 0);
  server.set_clock([] {
    static std::int64_t now_ns = 0;
    return now_ns += 1'000'000;
  });
  const auto frame = server.advance(State(1), {});
  EXPECT_EQ(frame.predict_ns, 1'000'000);
  EXPECT_EQ(frame.encode_ns, 1'000'000);
  EXPECT_EQ(frame.hash_ns, 1'000'000);
}

TEST(ServerTimeline, NoPayloadOrSnapshotExceedsItsBound) {
  Random random(4);
  for (const std::string_view codec : codec_names()) {
    auto server = server_of(layout_for(codec, 70));
    server.start(0, random_state(random, 70, 0), Drive{});
    State target = random_state(random, 70, 0);
    std::vector<LifecycleRecord> lifecycle;
    for (Slot slot = 0; slot < 70; ++slot) {
      lifecycle.push_back({LifecycleKind::kDespawn, slot, 0, 0, {}});
      lifecycle.push_back({LifecycleKind::kSpawn, slot, 0, 0, random_body(random)});
    }
    server.set_parameters({{1, 1, 1}});
    EXPECT_LE(server.advance(target, lifecycle).payload.size(), server.payload_bound());
    EXPECT_LE(snapshot_of(server).size(), server.snapshot_bound());
  }
}

}  // namespace
}  // namespace tandem
