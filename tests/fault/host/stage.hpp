#pragma once
// Hosts and clients on one simulated network, moved by one clock in steps of a millisecond.

#include <cstdint>
#include <cstdlib>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "sdk/client/client_core.hpp"
#include "sdk/transport/simulated/network.hpp"
#include "services/host/host.hpp"
#include "tests/fault/client/wanderers.hpp"
#include "tests/support/dice/dice.hpp"

namespace tandem::host {

template <class T>
T must(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message);
  return std::move(*result);
}

/// Calls `live` for every seed of this run, stopping at the first failure.
inline void for_seeds(std::uint64_t count, const std::function<void(std::uint64_t seed)>& live) {
  const char* replay = std::getenv("TANDEM_FAULT_SEED");
  const std::uint64_t first = replay != nullptr ? std::strtoull(replay, nullptr, 10) : 1;
  for (std::uint64_t seed = first; seed < first + (replay != nullptr ? 1 : count); ++seed) {
    SCOPED_TRACE("replay with TANDEM_FAULT_SEED=" + std::to_string(seed));
    live(seed);
    if (::testing::Test::HasFailure()) return;
  }
}

struct Server {
  std::unique_ptr<transport::ServerPort> port;
  client::Wanderers simulation;
  std::unique_ptr<Host> host;
  bool publishes = true;
  bool frozen = false;
};

struct Client {
  std::unique_ptr<transport::ClientPort> port;
  std::unique_ptr<client::ClientCore> core;
  bool frozen = false;
};

class Stage {
 public:
  explicit Stage(std::uint64_t seed, const transport::simulated::LinkModel& link = {})
      : network({.seed = seed, .link = link}), seed_(seed) {
    network.advance_to(now_ns);
  }

  Server& add_server(Epoch epoch) {
    HostConfig config;
    return add_server(epoch, std::move(config));
  }
  Server& add_server(Epoch epoch, HostConfig config) {
    auto server = std::make_unique<Server>(
        Server{must(network.make_server("default")), client::Wanderers(16, seed_), nullptr});
    config.epoch = epoch;
    config.streams.resize(1);
    config.streams[0].layout.capacity = 16;
    config.streams[0].layout.codec = "selective";
    config.streams[0].lattice = must(choose_lattice(0.01, 3, server->simulation.dt_s()));
    config.streams[0].layout.parameters.codec = must(codec_parameters(config.streams[0].lattice, 0.01, 0, 0));
    server->host = must(Host::create(std::move(config), server->simulation, *server->port));
    servers.push_back(std::move(server));
    return *servers.back();
  }
  Client& add_client(transport::Role role = transport::Role::kParticipant) {
    auto client = std::make_unique<Client>();
    client->port = must(network.make_client("default"));
    client::CoreOptions options;
    options.session = "default";
    options.id = 100 + clients.size();
    options.role = role;
    client->core = std::make_unique<client::ClientCore>(std::move(options), *client->port);
    clients.push_back(std::move(client));
    return *clients.back();
  }

  void run_ms(std::int64_t ms) {
    for (std::int64_t i = 0; i < ms; ++i) {
      now_ns += kMillisecond;
      network.advance_to(now_ns);
      if (on_ms) on_ms();
      for (auto& server : servers) {
        if (server->host == nullptr || server->frozen) continue;
        server->host->poll(now_ns, wall_ns());
        if (server->publishes) must_drain(*server);
      }
      for (auto& client : clients) {
        if (!client->frozen) client->core->poll({now_ns, wall_ns()});
      }
    }
  }
  template <class Member>
  void set_frozen(Member& member, bool frozen) {
    member.frozen = frozen;
    network.set_frozen(member.port->self(), frozen);
  }
  [[nodiscard]] static bool plays(const Client& client, const Host& host) {
    return client.core->phase() == ClientPhase::kPlaying &&
           client.core->session()->epoch == host.session().epoch;
  }
  [[nodiscard]] std::int64_t wall_ns() const { return now_ns + 1'700'000'000 * kSecond; }

  transport::simulated::Network network;
  std::int64_t now_ns = kSecond;
  std::vector<std::unique_ptr<Server>> servers;
  std::vector<std::unique_ptr<Client>> clients;
  std::function<void()> on_ms;

 private:
  static void must_drain(Server& server) {
    const auto drained = drain(server.host->outbox(), *server.port);
    if (!drained) throw std::runtime_error(drained.error().message);
  }
  std::uint64_t seed_;
};

}  // namespace tandem::host
