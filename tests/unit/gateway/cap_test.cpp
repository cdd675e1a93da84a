// A viewer with a cap: its connection ends when it takes more, and snapshots come at the pace that it leaves.

#include "fake_world.hpp"

namespace tandem::gateway {
namespace {

using transport::Phase;

constexpr transport::ClientId kClient = 1;

class CapTest : public GatewayTest {
 protected:
  static constexpr std::int64_t kPeriodNs = 20 * kMillisecond;

  CapTest() { gateway.on_session(fake_session()); }

  void caps(ViewerId id, std::uint32_t kbit_s, Phase phase = Phase::kPlaying) {
    auto message = ack(kClient, phase);
    message.applied = phase == Phase::kPlaying ? world.frame : 0;
    message.cap_kbit_s = kbit_s;
    EXPECT_FALSE(say(id, message));
  }
  /// 50 frames a second of so many bytes.
  void play(ViewerId id, int frames, std::size_t bytes) {
    for (int i = 0; i < frames; ++i) {
      frame(bytes, kPeriodNs);
      read(id);
    }
  }
  /// What a viewer over its cap is told; empty: it is within.
  std::string over() {
    std::vector<std::pair<ViewerId, std::string>> viewers;
    gateway.list_over_cap(now_ns, viewers);
    return viewers.empty() ? "" : viewers.front().second;
  }
};

TEST_F(CapTest, AViewerThatTakesMoreInTwoSecondsIsToldBothNumbers) {
  const ViewerId id = join(kClient), other = join(2);
  caps(id, 64);
  for (int second = 0; second < 4; ++second) {
    play(id, 50, 10);
    read(other);
    EXPECT_EQ(over(), "") << "50 messages of some 150 bytes";
  }
  play(id, 4, 200);
  EXPECT_EQ(over(), "") << "a moment is no two seconds";
  play(id, 100, 200);
  EXPECT_NE(over().find("the session takes 1"), std::string::npos) << over();
  EXPECT_NE(over().find("kbit/s, above the viewer's cap of 64"), std::string::npos) << over();
  std::vector<std::pair<ViewerId, std::string>> viewers;
  gateway.list_over_cap(now_ns, viewers);
  EXPECT_EQ(viewers.size(), 1U) << "nobody else";
  EXPECT_EQ(closing(Refusal::kCap).code, 4012);
  EXPECT_LE(viewers.front().second.size(), 123U) << "a close frame has no more";
}

TEST_F(CapTest, ADelayThatSharesHeadersKeepsAViewerWithinItsCap) {
  const ViewerId id = join(kClient);
  auto message = ack(kClient, Phase::kPlaying);
  message.applied = world.frame;
  message.cap_kbit_s = 32;
  message.max_delay_ms = 200;
  EXPECT_FALSE(say(id, message));
  play(id, 300, 10);
  EXPECT_EQ(over(), "");
  message.max_delay_ms = 0;
  message.applied = world.frame;
  EXPECT_FALSE(say(id, message));
  play(id, 300, 10);
  EXPECT_NE(over(), "");
}

TEST_F(CapTest, JoiningCountsForNothing) {
  const ViewerId id = join(kClient);
  caps(id, 64);
  caps(id, 64, Phase::kJoining);
  play(id, 200, 200);
  EXPECT_EQ(over(), "");
  caps(id, 64);
  play(id, 200, 200);
  EXPECT_NE(over(), "");
}

TEST_F(CapTest, WithoutACapNobodyIsCounted) {
  const ViewerId id = join(kClient);
  play(id, 300, 5000);
  EXPECT_EQ(over(), "");
}

TEST_F(CapTest, OneOutOfRangeEndsTheConnection) {
  for (const std::uint32_t kbit_s : {1U, 15U, 10'000'001U, UINT32_MAX}) {
    const ViewerId id = *gateway.admit();
    auto message = ack(kClient, Phase::kJoining);
    message.cap_kbit_s = kbit_s;
    EXPECT_EQ(say(id, message), Refusal::kMalformed) << kbit_s;
  }
}

TEST_F(CapTest, OfCapsThatFlipTheOneSaidLastCountsAndATwoSecondsOldOneStays) {
  const ViewerId id = join(kClient);
  caps(id, 10'000);
  for (int i = 0; i < 19; ++i) {
    caps(id, i % 2 == 0 ? 16 : 10'000);
    play(id, 5, 200);
  }
  EXPECT_EQ(over(), "") << "the first one still holds";
  caps(id, 16);
  play(id, 50, 200);
  EXPECT_NE(over().find("cap of 16"), std::string::npos) << over();
  caps(id, 10'000);
  EXPECT_NE(over(), "") << "and that one, too, for two seconds";
}

/// Milliseconds until a viewer with a cap was sent the whole snapshot, which it acknowledges at once.
TEST_F(CapTest, ASnapshotTakesWhatTheDeltasLeaveAndAtLeastAQuarter) {
  constexpr std::uint32_t kCap = 128;
  constexpr double kBytesPerS = kCap * 1000 / 8.0;
  const auto joins_in_ms = [&](std::size_t bytes) {
    for (int i = 0; i < 150; ++i) frame(bytes, kPeriodNs);
    const ViewerId id = *gateway.admit();
    caps(id, kCap, Phase::kJoining);
    later(accounts::kSnapshotSpacingNs);
    std::uint32_t held = 0, parts = 1, milliseconds = 0;
    Frame of = 0;
    for (; held < parts && milliseconds < 60'000; ++milliseconds) {
      if (milliseconds % 20 == 0) {
        frame(bytes, kMillisecond);
      } else {
        later(kMillisecond);
      }
      for (const auto& part : only<transport::SnapshotMessage>(read(id))) {
        ++held;
        parts = part.parts;
        of = part.frame;
        auto holds = ack(kClient, Phase::kJoining);
        holds.cap_kbit_s = kCap;
        holds.snapshot_frame = of;
        holds.snapshot_parts = parts;
        if (held < parts) holds.missing = {held, parts - held};
        EXPECT_FALSE(say(id, holds));
      }
    }
    gateway.leave(id);
    return milliseconds;
  };
  const double alone_ms = 1000.0 * static_cast<double>(world.snapshot.size()) / kBytesPerS;
  const std::uint32_t beside_little = joins_in_ms(1), beside_much = joins_in_ms(5'000);
  EXPECT_GT(beside_little, 1.1 * alone_ms);
  EXPECT_GT(beside_much, 4 * alone_ms) << "a quarter, and headers";
  EXPECT_LT(beside_much, 8 * alone_ms);
}

}  // namespace
}  // namespace tandem::gateway
