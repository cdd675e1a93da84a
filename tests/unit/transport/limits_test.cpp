#include "sdk/transport/limits.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace tandem::transport {
namespace {

const Limits kLimits{1000, 2000};

SessionMessage good_session() {
  SessionMessage session;
  session.session = "a";
  session.layout.capacity = 1;
  session.lattice_unit = 0.5;
  return session;
}

template <class Change>
bool session_passes(Change&& change) {
  SessionMessage session = good_session();
  change(session);
  return within_limits(session, kLimits);
}

TEST(Limits, ASessionWithinAllLimitsPasses) { EXPECT_TRUE(within_limits(good_session(), kLimits)); }

TEST(Limits, ASessionBeyondAnyLimitIsRefused) {
  EXPECT_FALSE(session_passes([](auto& s) { s.session = "a*"; }));
  EXPECT_FALSE(session_passes([](auto& s) { s.layout.capacity = 0; }));
  EXPECT_FALSE(session_passes([](auto& s) { s.layout.capacity = kMaxCapacity + 1; }));
  EXPECT_FALSE(session_passes([](auto& s) { s.frame_rate_hz = 0; }));
  EXPECT_FALSE(session_passes([](auto& s) { s.lattice_unit = std::numeric_limits<double>::quiet_NaN(); }));
  EXPECT_FALSE(session_passes([](auto& s) { s.window_ceiling = 0; }));
  EXPECT_FALSE(session_passes([](auto& s) { s.window_ceiling = kMaxWindowCeiling + 1; }));
  EXPECT_FALSE(session_passes([](auto& s) { s.max_delta_bytes = kMaxSampleBytes + 1; }));
  EXPECT_FALSE(session_passes([](auto& s) { s.max_snapshot_bytes = kMaxSampleBytes + 1; }));
  EXPECT_FALSE(session_passes([](auto& s) { s.layout.codec = std::string(65, 'c'); }));
  EXPECT_FALSE(
      session_passes([](auto& s) { s.scene_description = std::string(kMaxDescriptionBytes + 1, 's'); }));
  EXPECT_FALSE(session_passes([](auto& s) { s.types.resize(kMaxTypes + 1); }));
  EXPECT_FALSE(session_passes([](auto& s) {
    s.types = {BodyType{"t", std::numeric_limits<float>::infinity(), 0}};
  }));
  EXPECT_FALSE(session_passes([](auto& s) { s.layout.codec_tables.resize(kMaxTableBytes + 1); }));
  EXPECT_FALSE(
      session_passes([](auto& s) { s.layout.predictor_constants.resize(kMaxPredictorConstants + 1); }));
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

TEST(Limits, ASnapshotIsRefusedForItsSizeOrAForeignKey) {
  SnapshotMessage snapshot;
  snapshot.frame = 7;
  snapshot.slot = 3;
  snapshot.bytes.resize(2000);
  EXPECT_TRUE(within_limits(snapshot, kLimits));
  snapshot.slot = 2;
  EXPECT_FALSE(within_limits(snapshot, kLimits));
  snapshot.slot = 3;
  snapshot.bytes.resize(2001);
  EXPECT_FALSE(within_limits(snapshot, kLimits));
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
}

TEST(Limits, WhatAServerAnswersIsBounded) {
  ReplyMessage reply;
  reply.client = 1;
  reply.entries.resize(kReplyRing);
  EXPECT_TRUE(within_limits(reply, kLimits));
  reply.entries.resize(kReplyRing + 1);
  EXPECT_FALSE(within_limits(reply, kLimits));
  ScheduledInputMessage scheduled;
  EXPECT_FALSE(within_limits(scheduled, kLimits)) << "numbers start at 1";
  scheduled.number = 1;
  scheduled.values.resize(kMaxScheduledValues);
  EXPECT_TRUE(within_limits(scheduled, kLimits));
  scheduled.values.resize(kMaxScheduledValues + 1);
  EXPECT_FALSE(within_limits(scheduled, kLimits));
}

TEST(DeltaDepth, HoldsTwoWindowsButAtLeast64) {
  EXPECT_EQ(delta_depth(2, 1, 1000), 64U);
  EXPECT_EQ(delta_depth(24, 1, 1000), 64U);
  EXPECT_EQ(delta_depth(24, 4, 1000), 192U);
}

TEST(DeltaDepth, IsBoundedByMemoryButNeverBelowOneWindow) {
  EXPECT_EQ(delta_depth(24, 4, 1U << 20U, 128ULL << 20U), 128U);
  EXPECT_EQ(delta_depth(24, 4, 1U << 20U, 1), 100U);
}

}  // namespace
}  // namespace tandem::transport
