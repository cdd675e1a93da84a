#include "world.hpp"

#include <algorithm>
#include <stdexcept>

#include "sdk/core/codec/paper/code_tables.hpp"
#include "services/host/host.hpp"
#include "services/host/outgoing/outbox.hpp"

namespace tandem::client {
namespace {

constexpr std::int64_t kTickNs = 2'000'000;
constexpr std::uint32_t kBodies = 24;

template <class T>
T must(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message);
  return std::move(*result);
}

}  // namespace

WatchedClient::WatchedClient(transport::simulated::Network& network, const Truth& truth,
                             transport::ClientId id, transport::Role role, std::uint32_t lead)
    : truth_(truth), port_(must(network.make_client("default"))) {
  CoreOptions options;
  options.session = "default";
  options.id = id;
  options.role = role;
  options.lead = lead;
  core_ = std::make_unique<ClientCore>(std::move(options), *port_, this);
}

void WatchedClient::blame(const std::string& what) {
  if (fault.empty()) fault = what;
}

void WatchedClient::poll(Now now) {
  core_->poll(now);
  const ClientTimeline* timeline = core_->timeline();
  if (timeline == nullptr) return;
  const Frame most = timeline->applied() + core_->status().lead;
  if (timeline->now() > most) blame("simulated beyond its lead, at frame " + std::to_string(timeline->now()));
  if (core_->statistics().hash_mismatches != 0) blame("hash mismatch");
  if (core_->statistics().refused_messages != 0) blame("refused bytes that nobody had touched");
}

void WatchedClient::send_gravity(double unique, Now now) {
  const auto number = core_->send(transport::InputKind::kGravity, {unique, -5, 0}, {}, now);
  if (number) sent_[*number] = unique;
}

void WatchedClient::on_snapshot(const transport::SnapshotMessage& snapshot) {
  if (epoch_ != snapshot.epoch) sent_.clear();
  epoch_ = snapshot.epoch;
  next_ = snapshot.frame + 1;
  const auto truth = truth_.hashes.find({epoch_, snapshot.frame});
  if (truth == truth_.hashes.end())
    blame("snapshot of frame " + std::to_string(snapshot.frame) + " that never was");
}

void WatchedClient::on_applied(Epoch epoch, const CompleteDelta& delta) {
  const std::string at = " at frame " + std::to_string(delta.frame);
  if (epoch != epoch_ || delta.frame != next_) blame("frames out of order" + at);
  next_ = delta.frame + 1;
  const auto truth = truth_.hashes.find({epoch, delta.frame});
  if (truth == truth_.hashes.end() || truth->second != delta.hash)
    blame("another hash than the server's" + at);
  if (core_->timeline() == nullptr || core_->timeline()->hash() != delta.hash)
    blame("holds another state" + at);
}

void WatchedClient::on_outcome(const InputOutcome& outcome) {
  if (outcome.kind != InputOutcome::Kind::kActed) return;
  ++acted;
  const auto truth = truth_.acted.find({epoch_, sent_[outcome.number]});
  if (truth == truth_.acted.end()) {
    blame("input " + std::to_string(outcome.number) + " never acted");
  } else if (truth->second != outcome.frame) {
    blame("input acted on frame " + std::to_string(truth->second) + ", the reply said " +
          std::to_string(outcome.frame));
  }
}

World::World(const WorldOptions& options)
    : options_(options),
      dice_(options.seed),
      network_({.seed = options.seed * 31 + 7, .link = options.link}) {
  network_.advance_to(now_ns_);
  start_server();
  for (std::uint32_t i = 0; i < options.clients; ++i) add_client();
}

World::~World() = default;

void World::add_client() {
  const auto role = dice_.chance(0.75) ? transport::Role::kParticipant : transport::Role::kObserver;
  const auto lead = static_cast<std::uint32_t>(dice_.below(3));  // 2 is more than any session allows
  clients_.push_back(std::make_unique<WatchedClient>(network_, truth_, ++last_id_, role, lead));
  poll_client_ns_.push_back(now_ns_);
}

void World::start_server() {
  epoch_ = epoch_ + 1 + dice_.below(1000);
  server_port_ = must(network_.make_server("default"));
  simulation_ = std::make_unique<Wanderers>(kBodies, options_.seed + epoch_);
  host::HostConfig config;
  config.streams.resize(1);
  config.epoch = epoch_;
  config.start_frame = start_frame_;
  config.streams[0].layout.lead = options_.lead;
  if (dice_.chance(0.3)) config.window = 2;
  config.streams[0].layout.capacity = kBodies;
  config.streams[0].layout.codec = options_.codec;
  if (config.streams[0].layout.codec == "limited") config.streams[0].budget = 600;
  if (config.streams[0].layout.codec == "entropy" || config.streams[0].layout.codec == "limited")
    config.streams[0].layout.codec_tables = default_code_tables();
  config.streams[0].lattice = must(host::choose_lattice(0.01, 3, simulation_->dt_s()));
  config.streams[0].layout.parameters.codec =
      must(host::codec_parameters(config.streams[0].lattice, 0.01, 0.1, 2));
  if (config.streams[0].layout.codec == "tracker") {
    host::set_first_gains(**find_predictor(config.streams[0].layout.predictor),
                          config.streams[0].layout.parameters);
    config.streams[0].gains = host::GainGoal{};
  }
  config.types = {{"ball", 0.1F, 0xFFFFFFFF}};
  host_ = must(host::Host::create(config, *simulation_, *server_port_));
  acted_seen_ = 0;
  server_frozen_ = false;
  poll_server_ns_ = now_ns_;
  truth_.hashes[{epoch_, start_frame_}] = host_->hash();
}

void World::kill_server() {
  network_.kill(server_port_->self());
  start_frame_ = dice_.chance(0.5) ? host_->frame() : 0;  // from a checkpoint, or from the beginning
  host_.reset();
  server_port_.reset();
}

void World::poll_server() {
  if (!host_ || server_frozen_ || now_ns_ < poll_server_ns_) return;
  // A publisher that lags now and then: what is queued leaves later.
  if (host_->poll(now_ns_, wall_ns()))
    truth_.hashes[{epoch_, host_->report().frame}] = host_->report().deltas.at(0).hash;
  for (; acted_seen_ < simulation_->acted.size(); ++acted_seen_) {
    const auto& [values, step] = simulation_->acted[acted_seen_];
    truth_.acted[{epoch_, values[0]}] = start_frame_ + step;
  }
  if (!dice_.chance(0.05)) static_cast<void>(host::drain(host_->outbox(), *server_port_));
  poll_server_ns_ = std::min(host_->next_wake_ns(), now_ns_ + 2 * kTickNs);
}

void World::run(double seconds) {
  const std::int64_t end_ns = now_ns_ + static_cast<std::int64_t>(seconds * 1e9);
  while (now_ns_ < end_ns) {
    now_ns_ += kTickNs;
    network_.advance_to(now_ns_);
    poll_server();
    for (std::size_t i = 0; i < clients_.size(); ++i) {
      if (clients_[i]->frozen || now_ns_ < poll_client_ns_[i]) continue;
      clients_[i]->poll({now_ns_, wall_ns()});
      poll_client_ns_[i] = now_ns_ + static_cast<std::int64_t>(dice_.below(8)) * 1'000'000;
    }
  }
}

void World::incident(bool restart) {
  const std::size_t at = clients_.empty() ? 0 : static_cast<std::size_t>(dice_.below(clients_.size()));
  const auto what = dice_.below(restart ? 12 : 10);
  if (what >= 10 || clients_.empty()) {
    if (dice_.chance(0.6)) {
      kill_server();
      run(dice_.uniform(0.05, 2));
    } else {  // a clean end
      start_frame_ = host_->frame();
      host_.reset();
      server_port_.reset();
    }
    start_server();
  } else if (what == 0) {
    clients_[at]->frozen = !clients_[at]->frozen;
    network_.set_frozen(clients_[at]->self(), clients_[at]->frozen);
  } else if (what == 1) {
    network_.set_cut(clients_[at]->self(), server_port_->self(), dice_.chance(0.6));
  } else if (what == 2 && clients_.size() < 6) {
    add_client();
  } else if (what == 3 && clients_.size() > 1) {
    if (dice_.chance(0.5)) network_.kill(clients_[at]->self());
    killed_acted_ += clients_[at]->acted;
    killed_resyncs_ += clients_[at]->core().statistics().resyncs;
    if (killed_fault_.empty()) killed_fault_ = clients_[at]->fault;
    clients_.erase(clients_.begin() + static_cast<std::ptrdiff_t>(at));
    poll_client_ns_.erase(poll_client_ns_.begin() + static_cast<std::ptrdiff_t>(at));
  } else if (what == 4) {
    server_frozen_ = true;
    network_.set_frozen(server_port_->self(), true);
    run(dice_.uniform(0.01, 1.5));
    network_.set_frozen(server_port_->self(), false);
    server_frozen_ = false;
  } else if (what == 5) {  // quality is changed at run time
    StreamParameters parameters = host_->parameters();
    CodecParameters& codec = parameters.codec;
    codec.threshold = std::max(1, static_cast<int>(codec.threshold * dice_.uniform(0.5, 2)));
    codec.position_step = std::max(1, static_cast<int>(codec.position_step * dice_.uniform(0.5, 2)));
    codec.velocity_step = std::max(1, static_cast<int>(codec.velocity_step * dice_.uniform(0.5, 2)));
    if (!host_->set_parameters(parameters)) throw std::logic_error("parameters refused");
  } else if (!clients_[at]->frozen) {
    for (std::uint64_t burst = 1 + dice_.below(4); burst > 0; --burst) {
      clients_[at]->send_gravity(dice_.uniform(-5, 5), {now_ns_, wall_ns()});
    }
  }
}

void World::heal() {
  network_.set_all_links({.delay_ns = 2'000'000});
  for (auto& client : clients_) {
    if (client->frozen) network_.set_frozen(client->self(), false);
    client->frozen = false;
    network_.set_cut(client->self(), server_port_->self(), false);
  }
}

std::string World::not_playing() {
  for (std::size_t i = 0; i < clients_.size(); ++i) {
    ClientCore& core = clients_[i]->core();
    const ClientStatus status = core.status();
    const std::string who = "client " + std::to_string(i) + " (phase " +
                            std::to_string(static_cast<int>(status.phase)) + ", frame " +
                            std::to_string(status.frame) + ", epoch " + std::to_string(status.epoch) + ")";
    if (status.phase != ClientPhase::kPlaying) return who + " is not playing";
    if (status.epoch != epoch_) return who + " plays an old epoch";
    if (status.frame + 5 < host_->frame()) return who + " is behind frame " + std::to_string(host_->frame());
  }
  return "";
}

std::string World::fault() const {
  if (!killed_fault_.empty()) return killed_fault_;
  for (const auto& client : clients_) {
    if (!client->fault.empty()) return client->fault;
  }
  return "";
}

std::uint64_t World::inputs_acted() const {
  std::uint64_t sum = killed_acted_;
  for (const auto& client : clients_) sum += client->acted;
  return sum;
}

std::uint64_t World::resyncs() const {
  std::uint64_t sum = killed_resyncs_;
  for (const auto& client : clients_) sum += client->core().statistics().resyncs;
  return sum;
}

}  // namespace tandem::client
