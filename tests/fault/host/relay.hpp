#pragma once
// A live server, servers that stand by for it, and clients, on a simulated network.

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "services/host/checkpoint/format.hpp"
#include "services/host/frames/going_on.hpp"
#include "services/host/frames/roll_forward.hpp"
#include "services/host/standby/standby.hpp"
#include "tests/fault/host/fountain.hpp"
#include "tests/fault/host/stage.hpp"

namespace tandem::host::relay {

/// An engine that is not deterministic: after it was loaded it goes another way.
class Wayward final : public engine::Simulation {
 public:
  explicit Wayward(Logged& inner) : inner_(&inner) {}
  [[nodiscard]] std::uint32_t capacity() const override { return inner_->capacity(); }
  [[nodiscard]] double dt_s() const override { return inner_->dt_s(); }
  [[nodiscard]] engine::Vec3 gravity() const override { return inner_->gravity(); }
  [[nodiscard]] engine::Classification classify(const engine::Input& input) const override {
    return inner_->classify(input);
  }
  void apply(const engine::Input& input) override { inner_->apply(input); }
  void step() override {
    inner_->step();
    if (loaded_) inner_->step();
  }
  [[nodiscard]] engine::Bodies bodies() const override { return inner_->bodies(); }
  void save(std::vector<std::byte>& out) const override { inner_->save(out); }
  [[nodiscard]] bool load(std::span<const std::byte> bytes) override {
    loaded_ = true;
    return inner_->load(bytes);
  }

 private:
  Logged* inner_;
  bool loaded_ = false;
};

/// A process that is a live server, or stands by and becomes one.
struct Server {
  std::unique_ptr<transport::ServerPort> port;
  std::unique_ptr<Logged> simulation;
  std::unique_ptr<Wayward> wayward;
  HostConfig config;
  std::unique_ptr<standby::Standby> standby;
  std::unique_ptr<Host> host;
  bool frozen = false;
  std::string why_not;
  std::int64_t took_over_ns = 0;
  Frame captured = 0;

  [[nodiscard]] engine::Simulation& engine() {
    if (wayward) return *wayward;
    return *simulation;
  }
};

struct Member {
  std::unique_ptr<transport::ClientPort> port;
  Watcher watcher;
  std::unique_ptr<client::ClientCore> core;
  std::map<std::uint64_t, double> sent;
  bool waits = false;  ///< it is not polled, and DDS goes on
};

class Cast {
 public:
  explicit Cast(std::uint64_t seed,
                const transport::simulated::LinkModel& link = {.delay_ns = 2'000'000, .jitter_ns = 2'000'000})
      : network({.seed = seed, .link = link}) {
    network.advance_to(now_ns);
  }

  Server& add_live(HostConfig config = {}) {
    Server& server = add(std::move(config));
    server.host = must(Host::create(server.config, server.engine(), *server.port));
    return server;
  }
  Server& add_standby(std::uint32_t rank = 1, bool wayward = false) {
    Server& server = add();
    if (wayward) server.wayward = std::make_unique<Wayward>(*server.simulation);
    server.standby = must(standby::Standby::create(
        {.session = "default", .id = 500 + servers.size(), .rank = rank, .epoch = server.config.epoch},
        *server.port,
        [&server](const checkpoint::Checkpoint& checkpoint, const transport::SessionMessage&) {
          return load_world(checkpoint, checkpoint_world(server.config), server.engine());
        },
        [&server](const checkpoint::Checkpoint& from, std::span<const transport::JournalMessage> journal) {
          return server.engine().load(from.engine_state) &&
                 roll_forward(server.config, server.engine(), from, journal);
        }));
    return server;
  }
  Member& add_client() {
    auto client = std::make_unique<Member>();
    client->port = must(network.make_client("default"));
    client::CoreOptions options;
    options.session = "default";
    options.id = 100 + clients.size();
    client->core = std::make_unique<client::ClientCore>(std::move(options), *client->port, &client->watcher);
    clients.push_back(std::move(client));
    return *clients.back();
  }
  void run_ms(std::int64_t ms) {
    for (std::int64_t i = 0; i < ms; ++i) {
      now_ns += kMillisecond;
      network.advance_to(now_ns);
      for (auto& server : servers)
        if (server->port && !server->frozen) poll(*server);
      for (auto& client : clients)
        if (!client->waits) client->core->poll({now_ns, wall_ns()});
    }
  }
  void kill(Server& server) {
    network.kill(server.port->self());
    server.host.reset();
    server.standby.reset();
    server.port.reset();
  }
  void freeze(Server& server, bool frozen) {
    server.frozen = frozen;
    network.set_frozen(server.port->self(), frozen);
  }
  /// Its loop stands still, and DDS goes on.
  static void hang(Server& server, bool hangs) { server.frozen = hangs; }
  void send(Member& client) {
    const double unique = 0.001 * static_cast<double>(++sent_);
    const auto number =
        client.core->send(transport::InputKind::kGravity, {unique, -3, 0}, {}, {now_ns, wall_ns()});
    if (number) client.sent[*number] = unique;
  }
  void hand_over(Server& live) {
    if (!tool_) {
      tool_ = must(network.make_commander("default"));
      run_ms(100);  // they find each other
    }
    transport::CommandMessage command;
    command.epoch = live.host->session().epoch;
    command.session = "default";
    command.request = ++requests_;
    must_do(tool_->write(command));
  }
  [[nodiscard]] bool all_play(const Server& server) const {
    return std::ranges::all_of(clients, [&](const auto& client) {
      return client->core->phase() == ClientPhase::kPlaying &&
             client->core->session()->epoch == server.host->session().epoch;
    });
  }
  [[nodiscard]] std::uint64_t mismatches() const {
    std::uint64_t sum = 0;
    for (const auto& client : clients) sum += client->core->statistics().hash_mismatches;
    return sum;
  }
  [[nodiscard]] std::int64_t wall_ns() const { return now_ns + 1'700'000'000 * kSecond; }

  template <class R>
  static void must_do(const R& result) {
    if (!result) throw std::runtime_error(result.error().message);
  }

  transport::simulated::Network network;
  std::int64_t now_ns = kSecond;
  std::vector<std::unique_ptr<Server>> servers;
  std::vector<std::unique_ptr<Member>> clients;

 private:
  Server& add(HostConfig wanted = {}) {
    auto server = std::make_unique<Server>();
    server->port = must(network.make_server("default"));
    server->simulation = std::make_unique<Logged>();
    HostConfig& config = server->config;
    config = std::move(wanted);
    config.epoch = static_cast<Epoch>(wall_ns() / kMillisecond) + servers.size();
    config.engine = "particles";
    config.streams.resize(1);
    StreamConfig& stream = config.streams[0];
    stream.layout.capacity = kSlots;
    stream.layout.codec = "tracker";
    stream.lattice = must(choose_lattice(0.01, 20, server->simulation->dt_s()));
    stream.layout.parameters.codec = must(codec_parameters(stream.lattice, 0.01, 0, 0));
    must_do(choose_gains(stream));
    servers.push_back(std::move(server));
    return *servers.back();
  }
  void poll(Server& server) {
    if (server.standby && server.standby->poll(now_ns)) take_over(server);
    if (!server.host) return;
    const bool produced = server.host->poll(now_ns, wall_ns());
    const bool due = server.host->wants_checkpoint_now() ||
                     (server.host->wants_checkpoints() && server.host->frame() >= server.captured + 30);
    if (produced && due) {
      server.captured = server.host->frame();
      checkpoint::Checkpoint copy;
      server.host->capture(copy);
      auto encoded = std::make_shared<checkpoint::Encoded>();
      encoded->moment = {copy.epoch, copy.frame};
      encoded->journal = copy.journal;
      must_do(checkpoint::encode(copy, encoded->bytes));
      server.host->offer_checkpoint(encoded);
    }
    must_do(drain(server.host->outbox(), *server.port));
    const Host::State state = server.host->state();
    if (state == Host::State::kHandedOver || state == Host::State::kRefused) {
      server.host.reset();
      server.port.reset();
    }
  }
  void take_over(Server& server) {
    const standby::Takeover takeover = server.standby->take_over();
    server.standby.reset();
    server.simulation->frame = takeover.checkpoint->frame;
    auto continued =
        must(continue_world(server.config, server.engine(), *takeover.checkpoint, takeover.journal));
    server.why_not = continued.why_not;
    server.simulation->frame = continued.world.frame;
    server.config.epoch = static_cast<Epoch>(wall_ns() / kMillisecond);
    checkpoint::Start start;
    start.goes_on_from = std::make_shared<const checkpoint::Checkpoint>(std::move(continued.world));
    begin_takeover(start, takeover.from, server.config);
    server.host = must(Host::create(server.config, server.engine(), *server.port));
    server.captured = server.host->frame();
    server.took_over_ns = now_ns;
  }

  std::uint64_t sent_ = 0, requests_ = 0;
  std::unique_ptr<transport::simulated::CommandPort> tool_;
};

}  // namespace tandem::host::relay
