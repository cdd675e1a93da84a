// Clients of a server with two streams: whatever they play, and whenever they change, every frame is the
// server's.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "sdk/client/client_core.hpp"
#include "sdk/transport/simulated/network.hpp"
#include "services/host/host.hpp"
#include "services/host/outgoing/outbox.hpp"
#include "wanderers.hpp"

namespace tandem::client {
namespace {

constexpr std::int64_t kTickNs = 2'000'000;
constexpr std::uint32_t kBodies = 24;
constexpr double kFine = 0.01, kCoarse = 0.04;  // thresholds
constexpr std::int64_t kWallNs = 1'700'000'000'000'000'000;

/// A client that checks that it hears each frame once, in order, with the hash of the stream that it plays.
class Listening final : public CoreListener {
 public:
  Listening(transport::simulated::Network& network, transport::ClientId id, const std::string& prefer)
      : port(std::move(*network.make_client("default"))) {
    CoreOptions options;
    options.session = "default";
    options.id = id;
    options.prefer = prefer;
    core = std::make_unique<ClientCore>(std::move(options), *port, this);
    core->start_sampling();
  }
  void on_stream(const transport::StreamMessage& stream) override {
    played.push_back(stream.id.id);
    if (core->timeline() == nullptr) return;
    EXPECT_GE(core->timeline()->applied(), last);
    if (core->timeline()->applied() > last) ++jumps_ahead;
    last = core->timeline()->applied();
  }
  void on_snapshot(const transport::SnapshotMessage& snapshot) override {
    ++snapshots;
    last = snapshot.frame;
  }
  void on_applied(Epoch /*epoch*/, const CompleteDelta& delta) override {
    EXPECT_EQ(delta.frame, last + 1);
    last = delta.frame;
    ASSERT_NE(core->timeline(), nullptr);
    EXPECT_EQ(core->timeline()->hash(), delta.hash);
    const auto said = truth->find({core->stream()->id.id, delta.frame});
    ASSERT_NE(said, truth->end());
    EXPECT_EQ(said->second, delta.hash) << "of stream " << core->stream()->id.id;
  }
  void on_outcome(const InputOutcome& outcome) override { outcomes.push_back(outcome); }

  std::unique_ptr<transport::ClientPort> port;
  std::unique_ptr<ClientCore> core;
  const std::map<std::pair<std::uint32_t, Frame>, std::uint64_t>* truth = nullptr;
  std::vector<std::uint32_t> played;
  std::vector<InputOutcome> outcomes;
  std::size_t snapshots = 0, jumps_ahead = 0;
  Frame last = 0;
};

class TwoStreams : public ::testing::Test {
 protected:
  void SetUp() override {
    network.advance_to(now_ns);
    server_port = std::move(*network.make_server("default"));
    simulation = std::make_unique<Wanderers>(kBodies, 5);
    host::HostConfig config;
    config.epoch = 1000;
    config.stall_timeout_ns.reset();
    host::StreamConfig stream;
    stream.lattice = *host::choose_lattice(kFine, 3, simulation->dt_s());
    stream.layout.lead = 1;
    stream.layout.capacity = kBodies;
    stream.layout.codec = "tracker";
    host::set_first_gains(**find_predictor(stream.layout.predictor), stream.layout.parameters);
    config.streams = {stream, stream};
    config.streams[0].name = "fine";
    config.streams[0].layout.parameters.codec = *host::codec_parameters(stream.lattice, kFine, 0.1, 2);
    config.streams[1].name = "coarse";
    config.streams[1].layout.parameters.codec = *host::codec_parameters(stream.lattice, kCoarse, 0.1, 2);
    config.types = {{"ball", 0.1F, 0xFFFFFFFF}};
    auto made = host::Host::create(std::move(config), *simulation, *server_port);
    ASSERT_TRUE(made.has_value()) << made.error().message;
    host_ = std::move(*made);
  }

  Listening& join(const std::string& prefer) {
    clients.push_back(std::make_unique<Listening>(network, 100 + clients.size(), prefer));
    clients.back()->truth = &truth;
    return *clients.back();
  }
  void run(double seconds) {
    for (const std::int64_t end_ns = now_ns + std::llround(seconds * 1e9); now_ns < end_ns;
         now_ns += kTickNs) {
      network.advance_to(now_ns);
      if (host_->poll(now_ns, now_ns + kWallNs)) {
        for (const auto& delta : host_->report().deltas) truth[{delta.stream, host_->frame()}] = delta.hash;
      }
      ASSERT_TRUE(host::drain(host_->outbox(), *server_port));
      for (const auto& client : clients) {
        client->core->poll({now_ns, now_ns + kWallNs});
        if (watched == client.get()) watch(*client);
      }
    }
  }
  // At 500 Hz: how far bodies are shown to move between two samples, beyond what they can.
  void watch(Listening& client) {
    Sample sample;
    if (!client.core->sample(sample, SampleMode::kExtrapolate, {now_ns, now_ns + kWallNs})) return;
    for (std::size_t i = 0; i < shown.positions.size() && i < sample.positions.size(); ++i)
      most_moved = std::max(most_moved, std::abs(sample.positions[i] - shown.positions[i]));
    for (const BodyChange change : sample.changes) jumped += change == BodyChange::kJumped ? 1 : 0;
    shown = std::move(sample);
  }

  std::int64_t now_ns = 1'000'000'000;
  transport::simulated::Network network{{.seed = 5, .link = {.delay_ns = 5'000'000, .jitter_ns = 2'000'000}}};
  std::unique_ptr<transport::ServerPort> server_port;
  std::unique_ptr<Wanderers> simulation;
  std::unique_ptr<host::Host> host_;
  std::vector<std::unique_ptr<Listening>> clients;
  std::map<std::pair<std::uint32_t, Frame>, std::uint64_t> truth;
  const Listening* watched = nullptr;
  Sample shown;
  float most_moved = 0;
  int jumped = 0;
};

TEST_F(TwoStreams, EachPlaysWhatItPrefers) {
  Listening& fine = join("error");
  Listening& coarse = join("bandwidth");
  Listening& named = join("fine");
  run(5);
  EXPECT_EQ(fine.core->status().stream, "fine");
  EXPECT_EQ(coarse.core->status().stream, "coarse");
  EXPECT_EQ(named.core->status().stream_reason, "asked for by name");
  for (const auto& client : clients) {
    EXPECT_EQ(client->core->phase(), ClientPhase::kPlaying);
    EXPECT_GT(client->last, 100U);
    EXPECT_EQ(client->played.size(), 1U);
  }
}

TEST_F(TwoStreams, AChangeLosesNoFrameAndShowsNoJump) {
  Listening& other = join("coarse");
  Listening& client = join("error");
  run(3);
  ASSERT_EQ(client.core->phase(), ClientPhase::kPlaying);
  watched = &client;
  run(1);
  const float usual = most_moved;
  most_moved = 0;
  client.core->prefer("bandwidth");
  run(3);
  EXPECT_EQ(client.core->status().stream, "coarse");
  EXPECT_EQ(client.core->statistics().stream_changes, 1U);
  EXPECT_EQ(client.core->statistics().resyncs, 0U);
  EXPECT_EQ(client.snapshots, 1U) << "the one it joined by; on_applied() saw that no frame was missing";
  EXPECT_EQ(jumped, 0);
  EXPECT_LT(most_moved, 2 * usual + 1e-3F) << "a body falls 0.1 in a frame, 0.007 in a sample";
  client.core->prefer("error");
  run(3);
  EXPECT_EQ(client.core->status().stream, "fine");
  EXPECT_EQ(client.played, (std::vector<std::uint32_t>{0, 1, 0}));
  EXPECT_EQ(other.core->statistics().resyncs, 0U);
}

TEST_F(TwoStreams, InputsAreTakenWhileAClientChanges) {
  Listening& client = join("error");
  run(3);
  client.core->prefer("bandwidth");
  int sent = 0;
  for (int i = 0; i < 60; ++i) {
    sent += client.core->send(transport::InputKind::kGravity, {0.1 * i, -5, 0}, {}, {now_ns, now_ns}) ? 1 : 0;
    run(0.05);
  }
  run(2);
  EXPECT_EQ(client.core->statistics().stream_changes, 1U);
  EXPECT_EQ(sent, 60);
  EXPECT_EQ(client.outcomes.size(), 60U);
  for (const InputOutcome& outcome : client.outcomes) EXPECT_EQ(outcome.kind, InputOutcome::Kind::kActed);
}

TEST_F(TwoStreams, ALossOnTheWayEndsInTheOtherStream) {
  Listening& client = join("error");
  run(3);
  network.set_all_links({.delay_ns = 5'000'000, .loss = 0.3, .repair_ns = 30'000'000, .lost_for_good = 0.2});
  client.core->prefer("bandwidth");
  run(5);
  network.set_all_links({.delay_ns = 5'000'000});
  run(5);
  EXPECT_EQ(client.core->phase(), ClientPhase::kPlaying);
  EXPECT_EQ(client.core->status().stream, "coarse");
  EXPECT_EQ(client.core->statistics().hash_mismatches, 0U);
}

// The listener is told no frame of either stream twice, and none out of order.
TEST_F(TwoStreams, WhoHasManyDeltasWaitingGoesOnFromALaterFrameOfTheOtherStream) {
  ASSERT_TRUE(host_->set_limits(10, 50'000'000));  // nobody waits for the one that is cut off
  Listening& client = join("error");
  Listening& sender = join("fine");
  run(3);
  network.set_all_links({.delay_ns = 20'000'000, .jitter_ns = 100'000'000});
  for (int i = 0; i < 60; ++i) {
    client.core->prefer(i % 2 == 0 ? "bandwidth" : "error");
    run(0.02 * (i + 1));
    network.set_cut_one_way(server_port->self(), client.port->self(), true);
    for (int j = 0; j < 8; ++j) {
      ASSERT_TRUE(sender.core->send(transport::InputKind::kGravity, {0, 0, -0.1 * j}, {},
                                    {now_ns, now_ns + kWallNs}));
      run(0.4);
    }
    network.set_cut_one_way(server_port->self(), client.port->self(), false);
    run(5);
    ASSERT_EQ(client.core->phase(), ClientPhase::kPlaying);
  }
  EXPECT_GT(client.jumps_ahead, 0U);
  EXPECT_EQ(client.core->statistics().hash_mismatches, 0U);
}

TEST_F(TwoStreams, WhoChangesAgainAndAgainHoldsUpNobody) {
  Listening& steady = join("fine");
  Listening& flapping = join("error");
  run(3);
  const Frame before = steady.last;
  for (int i = 0; i < 100; ++i) {
    flapping.core->prefer(i % 2 == 0 ? "bandwidth" : "error");
    run(0.1);
  }
  EXPECT_GE(steady.last - before, 290U);
  EXPECT_EQ(steady.core->statistics().resyncs, 0U);
  run(10);
  EXPECT_EQ(flapping.core->phase(), ClientPhase::kPlaying);
  EXPECT_EQ(flapping.core->status().stream, "fine");
}

}  // namespace
}  // namespace tandem::client
