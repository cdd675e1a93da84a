#pragma once
// A small world on a server's timeline, and a client joined to it by hand.

#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "sdk/client/client_core.hpp"
#include "tests/support/client/fake_port.hpp"

namespace tandem::client {

inline constexpr std::int64_t kMs = 1'000'000;
inline constexpr std::int64_t kFrameNs = 33'333'333;
inline constexpr transport::ParticipantId kServerId{{1, 2, 3}};
inline constexpr transport::ClientId kClient = 77;

/// A few bodies that fall, turn if there are orientations, and are pushed about by a seeded generator.
class FakeServer {
 public:
  explicit FakeServer(Epoch epoch = 1000, std::uint32_t capacity = 40, std::uint32_t lead = 1,
                      const Groups& groups = {}, const WorldFeatures& world = {});

  /// The next frame. Its delta is what a writer would publish.
  transport::DeltaMessage advance(std::int64_t server_time_ns = 0);
  /// A drive that acts on frame() + 1 + lead, as a host would schedule it.
  transport::ScheduledInputMessage schedule(std::int32_t gravity_y, std::int32_t gravity_x = 0);
  transport::SnapshotMessage snapshot();
  void teleport(Slot slot) { teleport_ = slot; }

  std::vector<std::byte> news;  ///< that the next frame tells: sections
  bool undisturbed = false;     ///< bodies go where they are predicted

  transport::SessionMessage session;
  std::map<Frame, std::uint64_t> hashes;
  [[nodiscard]] Frame frame() const { return timeline_.frame(); }
  [[nodiscard]] const ServerTimeline& timeline() const { return timeline_; }

 private:
  static ServerTimeline make(const transport::SessionMessage& session);
  static transport::SessionMessage make_session(Epoch epoch, std::uint32_t capacity, std::uint32_t lead,
                                                const Groups& groups, const WorldFeatures& world);

  ServerTimeline timeline_;
  State target_;
  std::uint64_t random_ = 88172645463325252ULL;
  std::uint64_t last_number_ = 0;
  std::int64_t teleport_ = -1;
};

template <class M>
transport::Received<M> from_server(M message) {
  return {std::move(message), kServerId};
}

/// Several samples of one delta, or of one snapshot.
[[nodiscard]] std::vector<transport::DeltaMessage> split(const transport::DeltaMessage& whole,
                                                         std::size_t parts);

[[nodiscard]] std::vector<transport::SnapshotMessage> split(const transport::SnapshotMessage& whole,
                                                            std::size_t parts);

class Recorder final : public CoreListener {
 public:
  void on_applied(Epoch epoch, const CompleteDelta& delta) override {
    applied.push_back({epoch, delta.frame});
    hashes[delta.frame] = delta.hash;
    if (in_apply) in_apply();
  }
  void on_snapshot(const transport::SnapshotMessage& snapshot) override { loaded.push_back(snapshot.frame); }
  void on_outcome(const InputOutcome& outcome) override { outcomes.push_back(outcome); }
  void on_resync(ResyncReason reason) override { resyncs.push_back(reason); }

  std::vector<std::pair<Epoch, Frame>> applied;
  std::vector<Frame> loaded;
  std::map<Frame, std::uint64_t> hashes;
  std::vector<InputOutcome> outcomes;
  std::vector<ResyncReason> resyncs;
  std::function<void()> in_apply;  ///< runs within poll(), after each frame
};

/// A client, its port and a server, with time that stands still until a test moves it.
class ClientTest : public ::testing::Test {
 protected:
  explicit ClientTest(std::uint32_t lead = 1) : server(1000, 40, lead) {}

  void start(std::uint32_t lead = 1, transport::Role role = transport::Role::kParticipant);
  void poll(std::int64_t later_ns = kMs);
  /// Advances the server by one frame, delivers the delta and polls once, a frame later.
  void frame(std::int64_t later_ns = kFrameNs);
  void deliver(transport::DeltaMessage delta) { port.deltas.push_back(from_server(std::move(delta))); }
  /// Announces, waits until the client asks, answers, and ends playing.
  void join();
  [[nodiscard]] std::int64_t wall_ns() const { return now_ns + 500 * kMs; }
  [[nodiscard]] const Statistics& figures() const { return core->statistics(); }
  void expect_agreed() const;

  FakeServer server;
  FakePort port;
  Recorder recorder;
  std::vector<std::string> log;
  std::int64_t now_ns = 1'000'000'000'000;
  std::int64_t (*measure_ns)() = nullptr;  ///< of the next start()
  bool echo = false;                       ///< likewise
  std::uint32_t max_delay_ms = 0;          ///< likewise
  std::uint32_t cap_kbit_s = 0;            ///< likewise
  bool gateway_caps = false;               ///< likewise
  std::unique_ptr<ClientCore> core;
};

}  // namespace tandem::client
