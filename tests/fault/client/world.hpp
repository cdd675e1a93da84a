#pragma once
// A server and several clients over the simulated network, and everything that can happen to them.

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "sdk/client/client_core.hpp"
#include "sdk/transport/simulated/network.hpp"
#include "services/host/host.hpp"
#include "wanderers.hpp"

namespace tandem::client {

/// splitmix64 (Steele, Lea, Flood 2014).
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next() {
    std::uint64_t z = (state_ += 0x9E3779B97F4A7C15ULL);
    z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9ULL;
    z = (z ^ (z >> 27U)) * 0x94D049BB133111EBULL;
    return z ^ (z >> 31U);
  }
  std::uint64_t below(std::uint64_t n) { return next() % n; }
  bool chance(double p) { return static_cast<double>(next() >> 11U) * 0x1.0p-53 < p; }
  double uniform(double low, double high) {
    return low + static_cast<double>(next() >> 11U) * 0x1.0p-53 * (high - low);
  }

 private:
  std::uint64_t state_;
};

struct WorldOptions {
  std::uint64_t seed = 1;
  std::uint32_t clients = 3;
  std::uint32_t lead = 1;
  std::string codec = "entropy";
  transport::simulated::LinkModel link;
};

/// The server's own hashes, and the frames on which its inputs acted.
struct Truth {
  std::map<std::pair<Epoch, Frame>, std::uint64_t> hashes;
  /// By the value that makes each input unique: frame it acted on.
  std::map<std::pair<Epoch, double>, Frame> acted;
};

/// A client with its own checks; the first broken rule is kept in `fault`.
class WatchedClient final : public CoreListener {
 public:
  WatchedClient(transport::simulated::Network& network, const Truth& truth, transport::ClientId id,
                transport::Role role, std::uint32_t lead);

  void poll(Now now);
  void send_gravity(double unique, Now now);
  [[nodiscard]] ClientCore& core() { return *core_; }
  [[nodiscard]] transport::ParticipantId self() const { return port_->self(); }

  bool frozen = false;
  std::string fault;
  std::uint64_t acted = 0;

 private:
  void on_snapshot(const transport::SnapshotMessage& snapshot) override;
  void on_applied(Epoch epoch, const CompleteDelta& delta) override;
  void on_outcome(const InputOutcome& outcome) override;
  void blame(const std::string& what);

  const Truth& truth_;
  std::unique_ptr<transport::ClientPort> port_;
  std::unique_ptr<ClientCore> core_;
  Frame next_ = 0;
  Epoch epoch_ = 0;
  std::map<std::uint64_t, double> sent_;  ///< unique value by number, of this epoch
};

class World {
 public:
  explicit World(const WorldOptions& options);
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;
  World(World&&) = delete;
  World& operator=(World&&) = delete;

  /// Lets `seconds` pass.
  void run(double seconds);
  /// One random thing happens: an input, a freeze, a cut, a kill, a late join. `restart`: also server
  /// restarts.
  void incident(bool restart);
  /// Ends all freezes and cuts.
  void heal();
  /// Empty if every client plays the server's present state, otherwise the clients that do not, and the
  /// reasons.
  [[nodiscard]] std::string not_playing();
  /// First broken rule of any client.
  [[nodiscard]] std::string fault() const;

  void add_client();
  void start_server();
  void kill_server();
  [[nodiscard]] std::uint64_t inputs_acted() const;
  [[nodiscard]] std::uint64_t resyncs() const;
  [[nodiscard]] Frame frame() const { return host_ ? host_->frame() : 0; }
  [[nodiscard]] std::vector<std::unique_ptr<WatchedClient>>& clients() { return clients_; }
  [[nodiscard]] const transport::simulated::NetworkCounts& counts() const { return network_.counts(); }
  transport::simulated::Network& network() { return network_; }
  [[nodiscard]] transport::ParticipantId server_id() const { return server_port_->self(); }

 private:
  void poll_server();
  [[nodiscard]] std::int64_t wall_ns() const { return now_ns_ + 1'700'000'000'000'000'000; }

  WorldOptions options_;
  Dice dice_;
  transport::simulated::Network network_;
  Truth truth_;
  std::int64_t now_ns_ = 1'000'000'000;
  std::int64_t poll_server_ns_ = 0;
  std::vector<std::int64_t> poll_client_ns_;
  std::unique_ptr<transport::ServerPort> server_port_;
  std::unique_ptr<Wanderers> simulation_;
  std::unique_ptr<host::Host> host_;
  std::size_t acted_seen_ = 0;
  Epoch epoch_ = 0;
  Frame start_frame_ = 0;
  bool server_frozen_ = false;
  std::vector<std::unique_ptr<WatchedClient>> clients_;
  std::uint64_t last_id_ = 0;
  std::uint64_t killed_acted_ = 0, killed_resyncs_ = 0;
  std::string killed_fault_;
};

}  // namespace tandem::client
