#pragma once
// A server on one simulated DDS domain, relays over a NATS server in memory, and clients on all sides.

#include <gtest/gtest.h>

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "sdk/transport/nats/nats_client_port.hpp"
#include "sdk/transport/nats/nats_server_port.hpp"
#include "sdk/transport/simulated/network.hpp"
#include "services/host/host.hpp"
#include "services/relay/relay.hpp"
#include "tests/fault/client/wanderers.hpp"
#include "tests/unit/relay/fake_nats.hpp"

namespace tandem::relay {

template <class T>
T must(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message);
  return std::move(*result);
}

/// A client that notes the hash of each frame that it applied.
class Watcher final : private client::CoreListener {
 public:
  Watcher(transport::ClientId id, std::unique_ptr<transport::ClientPort> with, std::string prefer,
          transport::Role role = transport::Role::kParticipant)
      : port(std::move(with)) {
    client::CoreOptions options;
    options.session = "default";
    options.id = id;
    options.prefer = std::move(prefer);
    options.role = role;
    client::CoreListener* const listener = this;
    core = std::make_unique<client::ClientCore>(std::move(options), *port, listener);
  }
  [[nodiscard]] bool plays() const { return core->phase() == ClientPhase::kPlaying; }
  [[nodiscard]] std::uint64_t resyncs() const { return core->statistics().resyncs; }
  [[nodiscard]] Frame frame() const { return hashes.empty() ? 0 : hashes.rbegin()->first.second; }

  std::unique_ptr<transport::ClientPort> port;
  std::unique_ptr<client::ClientCore> core;
  std::map<std::pair<Epoch, Frame>, std::uint64_t> hashes;
  std::vector<client::InputOutcome> outcomes;
  std::vector<std::uint64_t> events;  ///< numbers of those that it was told
  std::uint64_t lost = 0;

 private:
  void on_applied(Epoch epoch, const client::CompleteDelta& delta) override {
    hashes[{epoch, delta.frame}] = delta.hash;
  }
  void on_outcome(const client::InputOutcome& outcome) override { outcomes.push_back(outcome); }
  void on_happened(const client::Happened& event) override { events.push_back(event.number); }
  void on_events_lost(Epoch /*epoch*/, Frame /*frame*/, std::uint64_t count) override { lost += count; }
};

/// A relay with both its sides, whose outbox is emptied at once.
class Passing final : private Relay::Publishing {
 public:
  Passing(Upstream::MakePort follow, Relay::MakePort publish, transport::ClientId first_id,
          bool keeps_state = true, std::vector<std::uint32_t> streams = {})
      : next_id_(first_id) {
    upstream = must(Upstream::create({.session = "default",
                                      .log = {},
                                      .measure_ns = nullptr,
                                      .new_id = [this] { return next_id_++; },
                                      .keeps_state = keeps_state,
                                      .streams = std::move(streams)},
                                     std::move(follow)));
    relay.emplace(
        Relay::Options{.claim_ns = kSecond / 10,
                       .log = [this](LogLevel, std::string_view line) { lines.emplace_back(line); }},
        *upstream, std::move(publish), static_cast<Relay::Publishing&>(*this));
  }
  ~Passing() override { relay.reset(); }
  Passing(const Passing&) = delete;
  Passing& operator=(const Passing&) = delete;
  Passing(Passing&&) = delete;
  Passing& operator=(Passing&&) = delete;
  void poll(client::Now now) {
    relay->poll(now);
    if (host_ != nullptr) static_cast<void>(host::drain(host_->outbox(), *port_));
  }

  std::vector<std::string> lines;
  std::unique_ptr<Upstream> upstream;
  std::optional<Relay> relay;

 private:
  void opened(host::Host& host, transport::ServerPort& port) override {
    host_ = &host;
    port_ = &port;
  }
  void closing() override { host_ = nullptr; }
  transport::ClientId next_id_;
  host::Host* host_ = nullptr;
  transport::ServerPort* port_ = nullptr;
};

class Stage {
 public:
  explicit Stage(std::uint64_t seed = 1)
      : near_({.seed = seed, .link = {}}), far_({.seed = seed + 1, .link = {}}), nats(seed), seed_(seed) {
    step();
  }

  /// `in_two_delays`: each stream is offered at once, and once more within 0.2 s.
  void start_server(Epoch epoch = 1000, std::uint32_t streams = 1, bool in_two_delays = false) {
    host::HostConfig config;
    server_port_ = must(near_.make_server("default"));
    simulation = std::make_unique<client::Wanderers>(bodies, seed_);
    config.epoch = epoch;
    config.streams.resize(streams);
    for (std::uint32_t id = 0; id < streams; ++id) {
      host::StreamConfig& stream = config.streams[id];
      if (streams > 1) stream.name = id == 0 ? "thin" : "rich";
      stream.layout.capacity = bodies;
      stream.layout.world = features;
      stream.layout.codec = "selective";
      stream.lattice = must(host::choose_lattice(0.01, 3, simulation->dt_s()));
      stream.layout.parameters.codec = must(host::codec_parameters(stream.lattice, 0.01, 0, 0));
    }
    for (std::uint32_t id = 0; id < streams && in_two_delays; ++id) {
      config.streams.push_back(config.streams[id]);
      config.streams.back().delay_ms = 200;
    }
    server = must(host::Host::create(std::move(config), *simulation, *server_port_));
  }
  void stop_server() {
    server.reset();
    server_port_.reset();
  }

  [[nodiscard]] transport::NatsPortOptions nats_options(const std::string& site, transport::ClientId id) {
    return {.session = "default", .site = site, .client = id, .sender = ++senders_, .clock = [this] {
              return now_ns;
            }};
  }
  /// A relay from the server's domain to NATS.
  Passing& start_near(std::size_t log_bytes = 64U << 20U) {
    near = std::make_unique<Passing>(
        [this](transport::ClientId) -> Result<std::unique_ptr<transport::ClientPort>> {
          return std::unique_ptr<transport::ClientPort>{must(near_.make_client("default", 4096))};
        },
        [this,
         log_bytes](const transport::SessionMessage&) -> Result<std::unique_ptr<transport::ServerPort>> {
          auto options = nats_options("hub", 0);
          options.log_bytes = log_bytes;
          options.most_clients = Relay::Options{}.client_limit;
          auto bus = nats.connect();
          if (first_bus == nullptr) first_bus = bus.get();
          auto port = std::make_unique<transport::NatsServerPort>(options, std::move(bus));
          published = port.get();
          return port;
        },
        first_ids_ += 100, false);
    return *near;
  }
  /// A relay from NATS to the DDS domain of another site. `kept`: what it goes on from.
  Passing& start_far(std::vector<transport::SnapshotMessage> kept = {}) {
    std::vector<std::uint32_t> streams;
    for (const transport::SnapshotMessage& snapshot : kept) streams.push_back(snapshot.stream.id);
    const std::uint32_t sender = ++senders_;  // of the process
    far = std::make_unique<Passing>(
        [this, sender,
         kept = std::move(kept)](transport::ClientId id) -> Result<std::unique_ptr<transport::ClientPort>> {
          auto bus = nats.connect();
          far_bus = bus.get();
          transport::NatsPortOptions options = nats_options("far", id);
          options.sender = sender;
          options.kept = [&kept](Epoch epoch, const StreamId& stream) {
            const auto found = std::ranges::find_if(
                kept, [&](const auto& each) { return each.epoch == epoch && each.stream == stream; });
            return found == kept.end() ? std::nullopt : std::optional(*found);
          };
          return std::make_unique<transport::NatsClientPort>(std::move(options), std::move(bus));
        },
        [this](const transport::SessionMessage&) -> Result<std::unique_ptr<transport::ServerPort>> {
          return must(far_.make_server("default", 4096));
        },
        first_ids_ += 100, true, std::move(streams));
    return *far;
  }
  /// It says nothing more to its site, and is silent towards NATS.
  void kill_far() {
    if (far_bus != nullptr) far_bus->cut = true;
    far_.kill(far->relay->port()->self());
    far.reset();
    far_bus = nullptr;
  }
  [[nodiscard]] std::unique_ptr<transport::ClientPort> near_port() {
    return must(near_.make_client("default", 4096));
  }
  Watcher& add_near(const std::string& prefer = "0") { return add(near_port(), prefer); }
  Watcher& add_far(const std::string& prefer = "0", transport::Role role = transport::Role::kParticipant) {
    return add(must(far_.make_client("default", 4096)), prefer, role);
  }
  /// A participant of the other site's domain that says it is the server.
  [[nodiscard]] std::unique_ptr<transport::ServerPort> imitate_far(const transport::SessionMessage& session) {
    auto port = must(far_.make_server("default"));
    if (!port->write(session)) throw std::runtime_error("not announced");
    return port;
  }
  /// Straight from NATS, as a gateway does.
  Watcher& add_edge(const std::string& site = "edge", const std::string& prefer = "0") {
    return add_edge(site, prefer, nats.connect());
  }
  /// The same behind the site's leaf node.
  Watcher& add_leaf(const std::string& site) {
    auto bus = nats.connect(only(site));
    bus->leaf = true;
    return add_edge(site, "0", std::move(bus));
  }
  /// What the NATS server permits a site to publish (deploy/nats/users.conf).
  static std::function<bool(const std::string&)> only(const std::string& site) {
    return [site](const std::string& subject) {
      return subject == "tandem.default.hello" || subject.starts_with("tandem.default.from." + site + '.');
    };
  }
  Watcher& add_edge(const std::string& site, const std::string& prefer,
                    std::unique_ptr<transport::FakeNats::Bus> bus) {
    const transport::ClientId id = 3000 + watchers.size();
    edge_bus = bus.get();
    auto port = std::make_unique<transport::NatsClientPort>(nats_options(site, id), std::move(bus));
    edge_port = port.get();
    watchers.push_back(std::make_unique<Watcher>(id, std::move(port), prefer));
    return *watchers.back();
  }

  void run_ms(std::int64_t ms) {
    for (std::int64_t i = 0; i < ms; ++i) step();
  }
  /// Every frame that `a` and `b` both applied has the same hash, and there are at least `least` of them.
  static void expect_same(const Watcher& a, const Watcher& b, std::size_t least) {
    std::size_t same = 0;
    for (const auto& [frame, hash] : a.hashes) {
      const auto found = b.hashes.find(frame);
      if (found == b.hashes.end()) continue;
      ASSERT_EQ(hash, found->second) << "frame " << frame.second;
      ++same;
    }
    EXPECT_GE(same, least);
  }

  /// The time on all clocks but that of the far site's relay.
  client::Now clocks() const { return {now_ns, now_ns + 1'700'000'000 * kSecond}; }

 private:
  Watcher& add(std::unique_ptr<transport::ClientPort> port, const std::string& prefer,
               transport::Role role = transport::Role::kParticipant) {
    watchers.push_back(std::make_unique<Watcher>(3000 + watchers.size(), std::move(port), prefer, role));
    return *watchers.back();
  }
  void step() {
    now_ns += kMillisecond;
    near_.advance_to(now_ns);
    far_.advance_to(now_ns);
    nats.now_ns = now_ns;
    const client::Now now = clocks();
    if (server) {
      server->poll(now.steady_ns, now.wall_ns);
      static_cast<void>(host::drain(server->outbox(), *server_port_));
    }
    if (near) near->poll(now);
    if (second) second->poll(now);
    if (far) far->poll({now.steady_ns, now.wall_ns + far_wall_skew_ns});
    for (auto& watcher : watchers) watcher->core->poll(now);
  }

  transport::simulated::Network near_, far_;

 public:
  std::int64_t now_ns = kSecond;
  std::uint32_t bodies = 16;  ///< before start_server()
  transport::FakeNats nats;
  WorldFeatures features;  ///< of the next server
  std::unique_ptr<client::Wanderers> simulation;

 private:
  std::unique_ptr<transport::ServerPort> server_port_;
  std::uint64_t seed_;
  std::uint32_t senders_ = 0;
  transport::ClientId first_ids_ = 1000;

 public:
  std::unique_ptr<host::Host> server;
  transport::NatsServerPort* published = nullptr;
  transport::NatsClientPort* edge_port = nullptr;
  transport::FakeNats::Bus *edge_bus = nullptr, *far_bus = nullptr, *first_bus = nullptr;
  std::unique_ptr<Passing> near, far, second;  ///< second: another relay beside the server
  std::int64_t far_wall_skew_ns = 0;           ///< of the clock of the far site's relay
  std::vector<std::unique_ptr<Watcher>> watchers;
};

}  // namespace tandem::relay
