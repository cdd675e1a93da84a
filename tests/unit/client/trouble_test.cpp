// Tests the picture while the network is cut, and when it is back.

#include <algorithm>
#include <cmath>

#include "sdk/transport/simulated/network.hpp"
#include "tests/support/client/fake_server.hpp"
#include "tests/support/client/taken.hpp"

namespace tandem::client {
namespace {

/// A server whose bodies move as predicted, and a client, on the simulated network, sampled at 125 Hz.
class TroubleTest : public ::testing::Test {
 protected:
  TroubleTest() : network({.seed = 3, .link = {.delay_ns = 4 * kMs, .jitter_ns = 2 * kMs}}) {
    server.undisturbed = true;
    server_port = std::move(*network.make_server("default", 1024));
    client_port = std::move(*network.make_client("default", 1024));
    CoreOptions options;
    options.session = "default";
    options.id = kClient;
    core = std::make_unique<ClientCore>(options, *client_port);
    core->start_sampling();
    EXPECT_TRUE(server_port->write(server.session).has_value());
    EXPECT_TRUE(server_port->open_client(kClient).has_value());
  }

  /// Goes on for so long; looks at the second differences of what is drawn.
  void go_on(double seconds) {
    const std::int64_t end_ns = now_ns + static_cast<std::int64_t>(seconds * 1e9);
    while (now_ns < end_ns) {
      now_ns += kMs;
      network.advance_to(now_ns);
      asks.clear();
      server_port->take(asks);
      for (const auto& ask : asks) {
        if (ask.message.phase != transport::Phase::kJoining || core->phase() != ClientPhase::kJoining)
          continue;
        EXPECT_TRUE(server_port->write(kClient, server.snapshot()).has_value());
      }
      if (now_ns >= next_frame_ns) {
        next_frame_ns += kFrameNs;
        EXPECT_TRUE(server_port->write(server.advance(now_ns)).has_value());
      }
      core->poll({now_ns, now_ns});
      if (now_ns % (8 * kMs) != 0 || !core->drawable()) continue;
      const auto taken = core->sample({}, sample.make_room(40), {now_ns, now_ns});
      ASSERT_TRUE(taken.has_value());
      static_cast<SampledFrame&>(sample) = *taken;
      look();
    }
  }
  void look() {
    if (before_last.size() == sample.positions.size()) {
      for (std::size_t i = 0; i < last.size(); ++i)
        bend = std::max(bend, std::abs(sample.positions[i] - 2 * last[i] + before_last[i]));
    }
    before_last = std::exchange(last, sample.positions);
  }
  void cut(bool on) { network.set_cut(server_port->self(), client_port->self(), on); }
  /// The distance between a body as it is drawn and as the server has it now.
  [[nodiscard]] double off(Slot slot) const {
    double squared = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double now = server.timeline().state().p(axis)[slot] * 0.001;
      squared += std::pow(double{sample.positions[3 * slot + axis]} - now, 2);
    }
    return std::sqrt(squared);
  }

  transport::simulated::Network network;
  FakeServer server;
  std::unique_ptr<transport::ServerPort> server_port;
  std::unique_ptr<transport::ClientPort> client_port;
  std::unique_ptr<ClientCore> core;
  std::vector<transport::Received<transport::AckMessage>> asks;
  Taken sample;
  std::vector<float> last, before_last;
  float bend = 0;
  std::int64_t now_ns = 0, next_frame_ns = 100 * kMs;
};

TEST_F(TroubleTest, ATenthOfASecondIsNotSeen) {
  go_on(3);
  ASSERT_EQ(core->phase(), ClientPhase::kPlaying);
  ASSERT_LT(off(3), 0.2);
  const float usual = std::exchange(bend, 0.0F);
  cut(true);
  go_on(0.1);
  EXPECT_LT(off(3), 0.2);
  cut(false);
  go_on(1);
  EXPECT_LT(bend, 2 * usual + 0.01F);
  EXPECT_EQ(core->statistics().resyncs, 0U);
}

TEST_F(TroubleTest, AfterAThirdOfASecondBodiesStandAndThenComeBackWithoutAJump) {
  go_on(3);
  bend = 0;
  cut(true);
  go_on(0.45);
  const std::vector<float> stood = sample.positions;
  go_on(0.05);
  for (std::size_t i = 0; i < stood.size(); ++i) EXPECT_NEAR(sample.positions[i], stood[i], 2e-2);
  EXPECT_GT(sample.since_delta_s, 0.45);
  const double behind = off(3);
  EXPECT_GT(behind, 0.1);
  cut(false);
  go_on(1);
  EXPECT_LT(off(3), 0.2);
  // A body that is far off comes back over several samples: none takes a third of the way at once.
  EXPECT_LT(bend, 0.35 * behind);
}

TEST_F(TroubleTest, AfterFiveSecondsTheyComeBackToo) {
  go_on(3);
  cut(true);
  go_on(5);
  const std::vector<float> stood = sample.positions;
  go_on(0.1);
  EXPECT_EQ(sample.positions, stood);
  cut(false);
  go_on(3);
  EXPECT_EQ(core->phase(), ClientPhase::kPlaying);
  EXPECT_LT(off(3), 0.2);
}

}  // namespace
}  // namespace tandem::client
