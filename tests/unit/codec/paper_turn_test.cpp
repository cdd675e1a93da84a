// Tests the thesis's codecs on bodies that turn.

#include <gtest/gtest.h>

#include <cmath>

#include "sdk/core/codec/errors.hpp"
#include "sdk/core/tables/codec_table.hpp"
#include "sdk/core/timeline/timeline.hpp"
#include "tests/property/synthetic.hpp"

namespace tandem::of_paper_turn {
namespace {

using synthetic::kRadii;
using synthetic::kTurning;
using synthetic::Random;

constexpr std::array<std::string_view, 5> kPaperCodecs{"none", "selective", "quantized", "entropy",
                                                       "limited"};
constexpr TypeId kType = 1;
constexpr std::int32_t kRadian = 1 << 28;

CodecParameters parameters_for(std::string_view codec) {
  CodecParameters parameters{.threshold = 75, .position_step = 3, .velocity_step = 3};
  if (!codec_traits(codec)->reads_steps) return parameters;
  parameters.turn_step = kRadian / 1000;
  parameters.spin_step = kRadian / 5000;
  return parameters;
}

DeltaCodec delta_of(std::string_view codec, std::uint32_t capacity) {
  return synthetic::make_delta(codec, capacity, {parameters_for(codec)}, {}, kTurning);
}

State turning_bodies(Random& random, std::uint32_t count) {
  State state(count, kTurning);
  for (Slot slot = 0; slot < count; ++slot) {
    BodyState body;
    body.q = synthetic::any_quaternion(random);
    body.w = {kRadian / 100, -kRadian / 50, 0};
    state.spawn(slot, 0, kType, body);
  }
  return state;
}

// One body turned by so much.
State turned_by(const State& state, Slot slot, const Spin& by) {
  State target = state;
  target.set_quaternion(slot, turned(state.quaternion(slot), by));
  return target;
}

std::uint64_t error_of(const State& state, const State& target, Slot slot) {
  return surface_error(state.body(slot), target.body(slot), kRadii[kType]);
}

struct Encoded {
  std::vector<std::byte> bytes;
  std::vector<Slot> corrected;
};
Encoded encode(DeltaCodec& server, State& state, const State& target, std::size_t budget = kNoBudget) {
  Encoded encoded{std::vector<std::byte>(server.bound()), {}};
  encoded.bytes.resize(server.encode(state, target, {}, budget, encoded.bytes).size_bytes);
  encoded.corrected.assign(server.touched().begin(), server.touched().end());
  return encoded;
}

TEST(PaperTurns, ABodyWhoseSurfaceIsBeyondTheThresholdIsSentAndNoOther) {
  Random random(1);
  const State predicted = turning_bodies(random, 3);
  // With a radius of 3,000 a turn of 1/40 rad moves the surface by 75.
  State target = turned_by(predicted, 0, {kRadian / 41, 0, 0});
  target = turned_by(target, 1, {0, kRadian / 39, 0});
  for (const std::string_view codec : kPaperCodecs) {
    SCOPED_TRACE(codec);
    DeltaCodec server = delta_of(codec, 3);
    State agreed = predicted;
    const auto expected = codec == "none" ? std::vector<Slot>{0, 1, 2} : std::vector<Slot>{1};
    EXPECT_EQ(encode(server, agreed, target).corrected, expected);
    EXPECT_LT(error_of(agreed, target, 1), 8U);
  }
}

TEST(PaperTurns, ATurnOfABallIsWorthItsOwnRadius) {
  Random random(2);
  State predicted = turning_bodies(random, 1);
  predicted.type()[0] = 0;  // of radius 1
  State target = turned_by(predicted, 0, {kRadian, 0, 0});
  DeltaCodec server = delta_of("selective", 1);
  EXPECT_TRUE(encode(server, predicted, target).bytes.empty());
}

TEST(PaperTurns, WholeValuesTake52BytesAndResidualsTwelve) {
  Random random(3);
  const State predicted = turning_bodies(random, 1);
  const State target = turned_by(predicted, 0, {kRadian / 9, 0, 0});
  const auto size = [&](std::string_view codec) {
    DeltaCodec server = delta_of(codec, 1);
    State agreed = predicted;
    return encode(server, agreed, target).bytes.size();
  };
  constexpr std::size_t kSection = 4;
  EXPECT_EQ(size("none"), kSection + 52);
  EXPECT_EQ(size("selective"), kSection + 52);
  EXPECT_EQ(size("quantized"), kSection + 12);
}

TEST(PaperTurns, WhatExceedsTheRangeIsFinishedInLaterFrames) {
  Random random(4);
  for (const std::string_view codec : {"quantized", "entropy", "limited"}) {
    SCOPED_TRACE(codec);
    DeltaCodec server = delta_of(codec, 1);
    State agreed = turning_bodies(random, 1);
    // The opposite orientation, and a w that is off by 60 ranges.
    State target = turned_by(agreed, 0, {0, kSpinLimit, 0});
    target = turned_by(target, 0, {0, 306'000'000, 0});
    for (std::size_t i = 0; i < kSpinChannels; ++i) target.w(i)[0] = i == 2 ? kRadian * 3 / 2 : 0;
    int frames = 0;
    std::uint64_t error = error_of(agreed, target, 0);
    for (; frames < 100 && error > 75; ++frames) {
      encode(server, agreed, target);
      const std::uint64_t now = error_of(agreed, target, 0);
      ASSERT_LT(now, error);
      error = now;
    }
    EXPECT_NEAR(frames, 25, 1) << "3.14 rad of 0.127 rad a frame";
    EXPECT_TRUE(encode(server, agreed, target).bytes.empty());
  }
}

TEST(PaperTurns, ASpinAtTheLimitIsNotHalvedByRounding) {
  Random random(9);
  for (int round = 0; round < 100; ++round) {
    DeltaCodec server = delta_of("quantized", 1);
    StreamParameters coarse = server.parameters();
    coarse.codec.turn_step = coarse.codec.spin_step = kSpinLimit / 100;
    server.set_parameters(coarse);
    State agreed = turning_bodies(random, 1);
    State target = agreed;
    Spin fast{};
    double length = 0;
    for (std::int32_t& a : fast) {
      a = random.even(kSpinLimit);
      length += std::ldexp(a, -29) * std::ldexp(a, -29);
    }
    for (std::int32_t& a : fast) a = static_cast<std::int32_t>(0.99 * a / std::sqrt(length));
    target.set_quaternion(0, turned(agreed.quaternion(0), fast));
    for (std::size_t i = 0; i < kSpinChannels; ++i) target.w(i)[0] = fast[i];
    encode(server, agreed, target);
    for (std::size_t i = 0; i < kSpinChannels; ++i)
      EXPECT_NEAR(agreed.w(i)[0], target.w(i)[0], kSpinLimit / 100);
    EXPECT_LT(error_of(agreed, target, 0), 0.06 * kRadii[kType]);
  }
}

TEST(PaperTurns, ResidualsOfAnyBytesLeaveAValidOrientationAndSpin) {
  Random random(5);
  DeltaCodec client = synthetic::make_delta(
      "quantized", 1, {{.threshold = 1, .turn_step = kMaxStep, .spin_step = kMaxStep}}, {}, kTurning);
  State state = turning_bodies(random, 1);
  for (int round = 0; round < 2000; ++round) {
    std::vector<std::byte> payload{std::byte{0x83}, std::byte{14}, std::byte{0}, std::byte{2}};
    for (int i = 0; i < 12; ++i) payload.push_back(static_cast<std::byte>(random.below(256)));
    const auto received = synthetic::receive(client, state, payload);
    ASSERT_TRUE(received) << received.error().message;
    ASSERT_EQ(synthetic::broken_invariant(state), nullptr);
  }
}

TEST(PaperTurns, ValuesThatAreNoOrientationOrTurnTooFastAreRefused) {
  const BodyState good{{1, 2, 3}, {4, 5, 6}, kNoTurn, {7, 8, 9}};
  const auto received = [](const BodyState& body, std::size_t bytes = 52) {
    DeltaCodec client = delta_of("selective", 1);
    State state(1, kTurning);
    state.spawn(0, 0, kType, {});
    const State before = state;
    std::vector<std::byte> payload(56);
    ByteWriter out(payload);
    for (const std::size_t byte : {std::size_t{0x83}, 2 + bytes, std::size_t{0}, std::size_t{2}})
      out.put(static_cast<std::uint8_t>(byte));
    for (const std::int32_t value : body.p) out.put(value);
    for (const std::int32_t value : body.v) out.put(value);
    for (const std::int32_t value : body.q) out.put(value);
    for (const std::int32_t value : body.w) out.put(value);
    const bool accepted = synthetic::receive(client, state, std::span(payload).first(4 + bytes)).has_value();
    EXPECT_TRUE(state == (accepted ? state : before));
    return accepted && state.body(0) == body;
  };
  EXPECT_TRUE(received(good));
  EXPECT_FALSE(received(good, 24));
  EXPECT_FALSE(received(good, 51));
  for (const Quaternion& q : {Quaternion{}, Quaternion{kQuaternionOne, 0, 0, kQuaternionOne / 16},
                              Quaternion{0, 0, 0, INT32_MIN}}) {
    BodyState bad = good;
    bad.q = q;
    EXPECT_FALSE(received(bad));
  }
  for (const Spin& w : {Spin{kSpinLimit + 1, 0, 0}, Spin{kSpinLimit, 1, 0}, Spin{0, 0, INT32_MIN}}) {
    BodyState bad = good;
    bad.w = w;
    EXPECT_FALSE(received(bad));
  }
}

TEST(PaperTurns, ABudgetTakesTheLargestSurfaceErrorsFirst) {
  Random random(6);
  const State predicted = turning_bodies(random, 200);
  State target = predicted;
  for (Slot slot = 0; slot < 200; slot += 20) {
    const auto by = static_cast<std::int32_t>(kRadian / 30 + slot * 100000);
    target = turned_by(target, slot, {by, 0, 0});
    if (slot == 40) target.p(0)[slot] = 5000;
  }
  DeltaCodec server = delta_of("quantized", 200);
  State agreed = predicted;
  EXPECT_EQ(encode(server, agreed, target, 4 + 2 + 3 * 14).corrected, (std::vector<Slot>{40, 160, 180}));
}

Layout layout_of(std::string_view codec) {
  Layout layout;
  layout.capacity = 50;
  layout.type_count = synthetic::kTypes;
  layout.groups = {kPositionGroup, kOrientationGroup};
  layout.radii = {kRadii.begin(), kRadii.end()};
  layout.codec = codec;
  layout.codec_tables = synthetic::tables_for(codec, kTurning);
  layout.parameters.codec = parameters_for(codec);
  return layout;
}

TEST(PaperTurns, AStreamListsStepsOfTurnsWhereItsCodecReadsThem) {
  for (const std::string_view codec : codec_names()) {
    SCOPED_TRACE(codec);
    Layout layout = layout_of(codec);
    EXPECT_TRUE(ServerTimeline::create(layout, 1));
    EXPECT_EQ(list_parameters(layout.parameters).size(), codec_traits(codec)->reads_steps ? 8U : 6U);
    const bool listed = has_turn_steps(layout.parameters.codec);
    layout.parameters.codec.turn_step = layout.parameters.codec.spin_step = listed ? 0 : 1;
    EXPECT_FALSE(ServerTimeline::create(layout, 1));
    layout.parameters.codec.turn_step = layout.parameters.codec.spin_step = 1;
    layout.groups = {kPositionGroup};
    layout.radii.clear();
    layout.codec_tables = synthetic::tables_for(codec);
    EXPECT_FALSE(ServerTimeline::create(layout, 1));
  }
}

TEST(PaperTurns, StepsOfTurnsChangeInADeltaOfAStreamThatListsThem) {
  Random random(7);
  const State state = turning_bodies(random, 1);
  DeltaCodec server = delta_of("quantized", 1);
  StreamParameters changed = server.parameters();
  changed.codec.turn_step += 5;
  server.set_parameters(changed);
  State agreed = state;
  const auto payload = encode(server, agreed, state).bytes;
  EXPECT_EQ(payload.size(), 2 + 1 + 3U);
  DeltaCodec client = delta_of("quantized", 1);
  const auto read = client.decode(state, payload);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->parameters, changed);
  EXPECT_EQ(delta_of("selective", 1).decode(state, payload).error().code, ErrorCode::kMalformed);
}

TEST(PaperTurns, WhoJoinsInMidTurnContinuesToTheBit) {
  for (const std::string_view codec : kPaperCodecs) {
    SCOPED_TRACE(codec);
    Random random(8);
    const Layout layout = layout_of(codec);
    auto server = *ServerTimeline::create(layout, 1);
    State world = turning_bodies(random, layout.capacity);
    server.start(0, world, {});
    auto client = *ClientTimeline::create(layout);
    for (int frame = 0; frame < 30; ++frame) {
      if (frame == 10) {
        std::vector<std::byte> snapshot;
        server.snapshot(snapshot);
        const auto loaded = client.load(snapshot, 1);
        ASSERT_TRUE(loaded) << loaded.error().message;
        Layout other = layout_of(codec_traits(codec)->reads_steps ? "selective" : "quantized");
        EXPECT_FALSE(ClientTimeline::create(other)->load(snapshot, 1)) << "steps that it does not list";
      }
      for (Slot slot = 0; slot < layout.capacity; ++slot) {
        if (random.one_in(10)) world.w(random.below(3))[slot] = random.value(kRadian / 20);
        world.set_quaternion(slot, turned(world.quaternion(slot), world.body(slot).w));
      }
      const auto delta = server.advance(world, {});
      if (frame < 10) continue;
      const auto applied = client.apply(delta.frame, delta.last_input, delta.hash, delta.payload);
      ASSERT_TRUE(applied) << applied.error().message;
    }
    EXPECT_TRUE(client.state(30) == server.state());
  }
}

}  // namespace
}  // namespace tandem::of_paper_turn
