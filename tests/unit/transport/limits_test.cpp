#include "sdk/wire/limits.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace tandem::transport {
namespace {

const Limits kLimits{1000, 2000};

SessionMessage good_session() {
  SessionMessage session;
  session.session = "a";
  session.capacity = 1;
  session.lattice_unit = 0.5;
  session.types.resize(1);
  session.streams.resize(1);
  return session;
}

template <class Change>
bool session_passes(Change&& change) {
  SessionMessage session = good_session();
  change(session);
  return within_limits(session, kLimits);
}

template <class Change>
bool stream_passes(Change&& change) {
  return session_passes([&](auto& session) { change(session.streams[0]); });
}

bool shape_passes(Shape shape, std::vector<float> values) {
  return session_passes([&](auto& session) {
    session.types[0].shape = shape;
    session.types[0].shape_values = std::move(values);
  });
}

TEST(Limits, ASessionWithinAllLimitsPasses) { EXPECT_TRUE(within_limits(good_session(), kLimits)); }

TEST(Limits, ASessionBeyondAnyLimitIsRefused) {
  EXPECT_FALSE(session_passes([](auto& s) { s.session = "a*"; }));
  EXPECT_FALSE(session_passes([](auto& s) { s.capacity = 0; }));
  EXPECT_FALSE(session_passes([](auto& s) { s.capacity = kMaxCapacity + 1; }));
  EXPECT_FALSE(session_passes([](auto& s) { s.dt_s = 0; }));
  EXPECT_FALSE(session_passes([](auto& s) { s.gravity[1] = std::numeric_limits<double>::infinity(); }));
  EXPECT_FALSE(session_passes([](auto& s) { s.up_axis = static_cast<UpAxis>(3); }));
  EXPECT_FALSE(session_passes([](auto& s) { s.server_role = static_cast<ServerRole>(2); }));
  EXPECT_FALSE(session_passes([](auto& s) { s.frame_rate_hz = 0; }));
  EXPECT_FALSE(session_passes([](auto& s) { s.lattice_unit = std::numeric_limits<double>::quiet_NaN(); }));
  EXPECT_FALSE(session_passes([](auto& s) { s.window_ceiling = 0; }));
  EXPECT_FALSE(session_passes([](auto& s) { s.window_ceiling = kMaxWindowCeiling + 1; }));
  EXPECT_FALSE(session_passes([](auto& s) { s.scene_json = std::string(kMaxSceneJsonBytes + 1, 's'); }));
  EXPECT_FALSE(session_passes([](auto& s) { s.types.clear(); }));
  EXPECT_FALSE(session_passes([](auto& s) { s.types.resize(kMaxTypes + 1); }));
  EXPECT_FALSE(session_passes([](auto& s) { s.types[0].radius = std::numeric_limits<float>::infinity(); }));
  EXPECT_FALSE(session_passes([](auto& s) { s.types[0].radius = -0.1F; }));
  EXPECT_FALSE(session_passes([](auto& s) { s.streams.clear(); }));
  EXPECT_FALSE(session_passes([](auto& s) { s.streams.resize(kMaxStreams + 1); }));
}

TEST(Limits, ASessionOfFourMillionBodiesPassesAndOneOfOneMoreDoesNot) {
  const auto passes = [](std::uint32_t capacity) {
    return session_passes([capacity](auto& s) {
      s.capacity = capacity;
      s.streams[0].max_delta_bytes = 1U << 27U;
      s.streams[0].max_snapshot_bytes = 1U << 28U;
    });
  };
  EXPECT_TRUE(passes(1U << 22U));
  EXPECT_FALSE(passes((1U << 22U) + 1));
}

TEST(Limits, NamesOfBodiesAscendAndAreTextsForPeople) {
  const auto passes = [](std::vector<BodyName> names) {
    return session_passes([&](auto& s) {
      s.capacity = 100'000;
      s.names = std::move(names);
    });
  };
  EXPECT_TRUE(passes({{0, 0, "crane"}, {7, 255, "J\xC3\xBCrgen"}, {99'999, 1, std::string(64, 'n')}}));
  EXPECT_FALSE(passes({{7, 0, "b"}, {0, 0, "a"}})) << "out of order";
  EXPECT_FALSE(passes({{7, 0, "b"}, {7, 1, "a"}})) << "a slot twice";
  EXPECT_FALSE(passes({{100'000, 0, "a"}})) << "no such slot";
  EXPECT_FALSE(passes({{0, 256, "a"}})) << "no such reuse";
  EXPECT_FALSE(passes({{0, 0, ""}}));
  EXPECT_FALSE(passes({{0, 0, std::string(65, 'n')}}));
  EXPECT_FALSE(passes({{0, 0, "a\nb"}})) << "a control character";
  EXPECT_FALSE(passes({{0, 0, "\xC3"}})) << "no UTF-8";
  std::vector<BodyName> many;
  for (std::uint32_t slot = 0; slot < kMaxBodyNames; ++slot) many.push_back({slot, 0, "n"});
  EXPECT_TRUE(passes(many));
  many.push_back({kMaxBodyNames, 0, "n"});
  EXPECT_FALSE(passes(many));
}

TEST(Limits, FeaturesAndDataAreAFewWords) {
  EXPECT_TRUE(session_passes([](auto& s) { s.features.assign(16, "events"); }));
  EXPECT_FALSE(session_passes([](auto& s) { s.features.assign(17, "events"); }));
  EXPECT_FALSE(session_passes([](auto& s) { s.features = {"Events"}; }));
  EXPECT_TRUE(session_passes([](auto& s) { s.data.assign(16, {1, "health"}); }));
  EXPECT_FALSE(session_passes([](auto& s) { s.data.assign(17, {1, "health"}); }));
  EXPECT_FALSE(session_passes([](auto& s) { s.data = {{1, ""}}; }));
}

TEST(Limits, AStreamBeyondAnyLimitIsRefused) {
  EXPECT_TRUE(stream_passes([](auto& s) { s.name = "thin_2-b"; }));
  EXPECT_FALSE(stream_passes([](auto& s) { s.name = "Thin"; }));
  EXPECT_TRUE(stream_passes([](auto& s) { s.id = {65535, 65535}; }));
  EXPECT_FALSE(stream_passes([](auto& s) { s.id.id = 65536; })) << "it travels in 16 bits";
  EXPECT_FALSE(stream_passes([](auto& s) { s.id.generation = 65536; }));
  EXPECT_FALSE(stream_passes([](auto& s) { s.name = std::string(33, 'n'); }));
  EXPECT_FALSE(stream_passes([](auto& s) { s.max_delta_bytes = (1U << 27U) + 1; }));
  EXPECT_FALSE(stream_passes([](auto& s) { s.max_snapshot_bytes = (1U << 28U) + 1; }));
  EXPECT_FALSE(stream_passes([](auto& s) { s.layout.codec = std::string(65, 'c'); }));
  EXPECT_FALSE(stream_passes([](auto& s) { s.layout.predictor = std::string(65, 'p'); }));
  EXPECT_FALSE(stream_passes([](auto& s) { s.layout.groups.clear(); }));
  EXPECT_FALSE(stream_passes([](auto& s) { s.layout.groups.resize(kMaxGroups + 1); }));
  EXPECT_FALSE(stream_passes([](auto& s) { s.layout.groups[0] = std::string(65, 'g'); }));
  EXPECT_FALSE(stream_passes([](auto& s) { s.layout.radii.resize(kMaxTypes + 1); }));
  EXPECT_FALSE(stream_passes([](auto& s) { s.layout.codec_tables.resize(kMaxTableBytes + 1); }));
  EXPECT_FALSE(
      stream_passes([](auto& s) { s.layout.predictor_constants.resize(kMaxPredictorConstants + 1); }));
}

TEST(Limits, AShapeHasTheNumberOfValuesThatItsKindSays) {
  EXPECT_TRUE(shape_passes(Shape::kNone, {}));
  EXPECT_FALSE(shape_passes(Shape::kNone, {1}));
  EXPECT_TRUE(shape_passes(Shape::kSphere, {}));
  EXPECT_TRUE(shape_passes(Shape::kBox, {1, 2, 3}));
  EXPECT_FALSE(shape_passes(Shape::kBox, {1, 2}));
  EXPECT_FALSE(shape_passes(Shape::kBox, {1, 2, std::numeric_limits<float>::quiet_NaN()}));
  EXPECT_TRUE(shape_passes(Shape::kCapsule, {1, 2}));
  EXPECT_TRUE(shape_passes(Shape::kCylinder, {1, 2}));
  EXPECT_TRUE(shape_passes(Shape::kHull, std::vector<float>(12)));
  EXPECT_FALSE(shape_passes(Shape::kHull, std::vector<float>(9)));
  EXPECT_FALSE(shape_passes(Shape::kHull, std::vector<float>(13)));
  EXPECT_FALSE(shape_passes(Shape::kHull, std::vector<float>(kMaxHullValues + 3)));
  EXPECT_FALSE(shape_passes(static_cast<Shape>(6), {}));
}

TEST(Limits, AnotherProtocolVersionPassesBecauseItIsAnsweredNotDropped) {
  EXPECT_TRUE(session_passes([](auto& s) { s.protocol_version = 99; }));
}

TEST(Limits, ADeltaIsRefusedForItsSizeOrItsPart) {
  DeltaMessage delta;
  delta.payload.resize(1000);
  EXPECT_TRUE(within_limits(delta, kLimits));
  delta.payload.resize(1001);
  EXPECT_FALSE(within_limits(delta, kLimits));
  delta.payload.clear();
  delta.parts = 0;
  EXPECT_FALSE(within_limits(delta, kLimits));
  delta.parts = delta.part = 2;
  EXPECT_FALSE(within_limits(delta, kLimits));
  delta.parts = kMaxParts + 1;
  EXPECT_FALSE(within_limits(delta, kLimits));
}

TEST(Limits, EarlierFramesAreRefusedInPartsAndWithoutABound) {
  DeltaMessage delta;
  delta.frame = 2000;
  delta.earlier = 1024;
  EXPECT_TRUE(within_limits(delta, kLimits));
  delta.earlier = 1025;
  EXPECT_FALSE(within_limits(delta, kLimits));
  delta.frame = delta.earlier = 7;
  EXPECT_FALSE(within_limits(delta, kLimits)) << "frame 0 has no delta";
  delta.earlier = 6;
  EXPECT_TRUE(within_limits(delta, kLimits));
  delta.parts = 2;
  EXPECT_FALSE(within_limits(delta, kLimits));
  EXPECT_EQ(max_earlier(1), 1024U);
  EXPECT_EQ(max_earlier(10'000), 419U);
  EXPECT_EQ(max_earlier(1U << 22U), 1U);
}

TEST(Limits, ASnapshotIsRefusedForItsSizesOrItsPart) {
  const auto passes = [](auto&& change) {
    SnapshotMessage snapshot;
    snapshot.part = 1;
    snapshot.parts = 2;
    snapshot.total_bytes = 2000;
    snapshot.bytes.resize(1000);
    change(snapshot);
    return within_limits(snapshot, kLimits);
  };
  EXPECT_TRUE(passes([](auto&) {}));
  EXPECT_FALSE(passes([](auto& s) { s.total_bytes = 2001; }));
  EXPECT_FALSE(passes([](auto& s) { s.bytes.resize(2001); }));
  EXPECT_FALSE(passes([](auto& s) { s.bytes.clear(); }));
  EXPECT_FALSE(passes([](auto& s) { s.part = 2; }));
  EXPECT_FALSE(passes([](auto& s) { s.parts = 0; }));
  EXPECT_FALSE(passes([](auto& s) { s.parts = s.total_bytes + 1; }));
  EXPECT_FALSE(passes([](auto& s) { s.parts = kMaxSnapshotParts + 1; }));
}

TEST(Limits, WhatAClientSendsIsBounded) {
  InputMessage input;
  EXPECT_FALSE(within_limits(input, kLimits)) << "client 0";
  input.client = 1;
  input.values.resize(16);
  input.bytes.resize(1024);
  EXPECT_TRUE(within_limits(input, kLimits));
  input.values.resize(17);
  EXPECT_FALSE(within_limits(input, kLimits));
  input.values.resize(16, std::numeric_limits<double>::quiet_NaN());
  input.bytes.resize(1025);
  EXPECT_FALSE(within_limits(input, kLimits));

  AckMessage ack;
  EXPECT_FALSE(within_limits(ack, kLimits)) << "client 0";
  ack.client = 1;
  EXPECT_TRUE(within_limits(ack, kLimits));
  ack.role_wanted = static_cast<Role>(2);
  EXPECT_FALSE(within_limits(ack, kLimits));
  ack.role_wanted = Role::kObserver;
  ack.phase = static_cast<Phase>(2);
  EXPECT_FALSE(within_limits(ack, kLimits));
  ack.phase = Phase::kJoining;
  ack.max_delay_ms = 1000;
  EXPECT_TRUE(within_limits(ack, kLimits));
  ack.max_delay_ms = 1001;
  EXPECT_FALSE(within_limits(ack, kLimits)) << "a delay above a second";
  ack.cap_kbit_s = 1;
  ack.max_delay_ms = 0;
  EXPECT_TRUE(within_limits(ack, kLimits)) << "a cap out of range is answered";
  ack.missing.resize(2 * kMaxMissingRuns);
  EXPECT_TRUE(within_limits(ack, kLimits));
  ack.missing.resize(2 * kMaxMissingRuns - 1);
  EXPECT_FALSE(within_limits(ack, kLimits)) << "a run without its count";
  ack.missing.resize(2 * kMaxMissingRuns + 2);
  EXPECT_FALSE(within_limits(ack, kLimits));
}

TEST(Limits, WhyAClientPlaysAStreamIsAShortText) {
  ClientStatusMessage status;
  status.client = 1;
  status.session = "a";
  status.stream_reason = std::string(64, 'r');
  EXPECT_TRUE(within_limits(status, kLimits));
  status.stream_reason += 'r';
  EXPECT_FALSE(within_limits(status, kLimits));
  status.stream_reason = "a\tb";
  EXPECT_FALSE(within_limits(status, kLimits));
}

TEST(Limits, WhatAServerAnswersIsBounded) {
  ReplyMessage reply;
  reply.client = 1;
  reply.entries.resize(kReplyRing);
  EXPECT_TRUE(within_limits(reply, kLimits));
  reply.entries.resize(kReplyRing + 1);
  EXPECT_FALSE(within_limits(reply, kLimits));
  reply.entries.clear();
  reply.texts.resize(kMaxReplyTexts, {1, std::string(200, 't')});
  EXPECT_TRUE(within_limits(reply, kLimits));
  reply.texts[3].text += 't';
  EXPECT_FALSE(within_limits(reply, kLimits));
  reply.texts[3].text = "\x1b[2J";
  EXPECT_FALSE(within_limits(reply, kLimits)) << "a control character";
  reply.texts.assign(kMaxReplyTexts + 1, {1, "t"});
  EXPECT_FALSE(within_limits(reply, kLimits));
  ScheduledInputMessage scheduled;
  EXPECT_FALSE(within_limits(scheduled, kLimits)) << "numbers start at 1";
  scheduled.number = 1;
  scheduled.values.resize(kMaxScheduledValues);
  EXPECT_TRUE(within_limits(scheduled, kLimits));
  scheduled.values.resize(kMaxScheduledValues + 1);
  EXPECT_FALSE(within_limits(scheduled, kLimits));
}

TEST(DeltaDepth, HoldsHalfAMinuteTwoWindowsAndAtLeast64) {
  EXPECT_EQ(delta_depth(30, 24, 1000), 900U);
  EXPECT_EQ(delta_depth(30, 24, 4 * kPartBytes), 3600U);
  EXPECT_EQ(delta_depth(1, 24, 1000), 64U);
  EXPECT_EQ(delta_depth(1, 100, 1000), 200U);
}

TEST(DeltaDepth, IsBoundedByMemoryButNeverBelowOneWindow) {
  EXPECT_EQ(delta_depth(30, 24, 4 * kPartBytes, 60'000'000), 1000U);
  EXPECT_EQ(delta_depth(30, 24, 4 * kPartBytes, 1), 100U);
  EXPECT_LT(delta_depth(1e9, 24, 1), 1U << 21U) << "whatever the rate";
}

}  // namespace
}  // namespace tandem::transport
