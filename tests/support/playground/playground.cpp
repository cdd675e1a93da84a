#include "tests/support/playground/playground.hpp"

#include <stdexcept>
#include <utility>

#include "sdk/core/codec/paper/code_tables.hpp"
#include "services/host/host.hpp"
#include "services/host/outgoing/outbox.hpp"

namespace tandem::api {
namespace {

constexpr std::int64_t kTickNs = 4'000'000;
std::int64_t now_ns = 0;

template <class T>
T must(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message);
  return std::move(*result);
}

}  // namespace

/// Waiting lets the playground's time pass.
class Playground::Port final : public transport::ClientPort {
 public:
  Port(Playground& playground, std::unique_ptr<transport::ClientPort> port)
      : playground_(playground), port_(std::move(port)) {}

  [[nodiscard]] transport::ParticipantId self() const override { return port_->self(); }
  void take_sessions(std::vector<transport::Received<transport::SessionMessage>>& out) override {
    port_->take_sessions(out);
  }
  void pass_over_session(transport::PassOver until) override { port_->pass_over_session(until); }
  [[nodiscard]] bool server_alive() override { return port_->server_alive(); }
  Result<void> open_stream(const transport::SessionMessage& session, const transport::StreamMessage& stream,
                           transport::ClientId client) override {
    return port_->open_stream(session, stream, client);
  }
  void close_stream(std::uint32_t stream) override { port_->close_stream(stream); }
  void close_streams() override { port_->close_streams(); }
  Result<void> open_snapshots(std::uint32_t stream) override { return port_->open_snapshots(stream); }
  void close_snapshots(std::uint32_t stream) override { port_->close_snapshots(stream); }
  void take(std::vector<transport::Received<transport::DeltaMessage>>& out) override { port_->take(out); }
  void take(std::vector<transport::Received<transport::ScheduledInputMessage>>& out) override {
    port_->take(out);
  }
  void take(std::vector<transport::Received<transport::SnapshotMessage>>& out) override { port_->take(out); }
  void take(std::vector<transport::Received<transport::ReplyMessage>>& out) override { port_->take(out); }
  void take(std::vector<transport::Received<transport::ServerStatusMessage>>& out) override {
    port_->take(out);
  }
  Result<void> write(const transport::AckMessage& message) override { return written(message); }
  Result<void> write(const transport::InputMessage& message) override { return written(message); }
  Result<void> write(const transport::ClientStatusMessage& message) override { return written(message); }
  [[nodiscard]] std::uint64_t dropped() const override { return port_->dropped(); }
  void wait(std::chrono::nanoseconds timeout) override {
    for (const std::int64_t end_ns = now_ns + timeout.count(); now_ns < end_ns;) playground_.tick();
  }

 private:
  template <class M>
  Result<void> written(const M& message) {
    if (playground_.on_write) playground_.on_write();
    return port_->write(message);
  }
  Playground& playground_;
  std::unique_ptr<transport::ClientPort> port_;
};

Playground::Playground(std::uint64_t seed) : network_({.seed = seed, .link = {}}), seed_(seed) {
  now_ns = 1'000'000'000'000;
  network_.advance_to(now_ns);
  start_server();
}

Playground::~Playground() = default;

client::Now Playground::now() { return {now_ns, now_ns + 1'700'000'000'000'000'000}; }

tandem_result Playground::join(const tandem_options* options, tandem_client* client) {
  tandem_options alone = TANDEM_OPTIONS_INIT;
  alone.background = 0;
  return join_over(std::make_unique<Port>(*this, must(network_.make_client("default"))), &now,
                   options != nullptr ? options : &alone, client);
}

tandem_client Playground::join() {
  tandem_client client = 0;
  join(nullptr, &client);
  return client;
}

void Playground::start_server() {
  server_port_ = must(network_.make_server("default"));
  simulation_ = std::make_unique<client::Wanderers>(kBodies, seed_ + epoch_);
  host::HostConfig config;
  config.streams.resize(1);
  config.epoch = ++epoch_;
  config.scene = "playground";
  config.up_axis = transport::UpAxis::kZ;
  config.continues_epoch = 900;
  config.continues_frame = 77;
  config.scene_json =
      R"({"gravity":{"y":-5},"bounds":{"low":{"x":-2,"y":-2,"z":-2},"high":{"x":2,"y":2,"z":2}},)"
      R"("planes":[{"normal":{"y":2}}],"spheres":[{"centre":{"x":1},"radiusM":0.5}]})";
  config.streams[0].layout.world = {.keys = true, .events = true};
  config.streams[0].layout.lead = 1;
  config.streams[0].layout.capacity = kBodies;
  config.streams[0].layout.codec = "entropy";
  config.streams[0].layout.codec_tables = default_code_tables();
  config.streams[0].lattice = must(host::choose_lattice(0.01, 3, simulation_->dt_s()));
  config.streams[0].layout.parameters.codec =
      must(host::codec_parameters(config.streams[0].lattice, 0.01, 0.1, 2));
  config.types = {{"plank", 0.1F, 0xFFU, transport::Shape::kBox, {1, 2, 0.5F}}};
  host_ = must(host::Host::create(config, *simulation_, *server_port_));
}

void Playground::name(std::vector<engine::BodyName> names) {
  simulation_->body_names = std::move(names);
  ++simulation_->names_version_now;
}

void Playground::stop_server() {
  host_.reset();
  server_port_.reset();
}

void Playground::tick() {
  now_ns += kTickNs;
  network_.advance_to(now_ns);
  if (host_ == nullptr) return;
  if (now_ns >= host_->next_wake_ns()) host_->poll(now_ns, now().wall_ns);
  static_cast<void>(host::drain(host_->outbox(), *server_port_));
}

void Playground::pass(double seconds) {
  for (const std::int64_t end_ns = now_ns + static_cast<std::int64_t>(seconds * 1e9); now_ns < end_ns;)
    tick();
}

}  // namespace tandem::api
