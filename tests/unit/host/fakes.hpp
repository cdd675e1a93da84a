#pragma once
// Stand-ins for the host's two neighbours, and a bench that drives a host by a manual clock.

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "sdk/transport/network/wire_bytes.hpp"
#include "sdk/wire/port.hpp"
#include "services/host/host.hpp"
#include "tandem/simulation.hpp"

namespace tandem::host {

/// Bodies that only the test moves. Gravity and pushes are taken as the particle engine takes them.
class FakeSimulation final : public engine::Simulation {
 public:
  explicit FakeSimulation(std::uint32_t capacity) : alive(capacity, 1), type(capacity, 0) {
    for (auto& column : position) column.assign(capacity, 0.0F);
    for (auto& column : velocity) column.assign(capacity, 0.0F);
  }

  [[nodiscard]] std::uint32_t capacity() const override { return static_cast<std::uint32_t>(alive.size()); }
  [[nodiscard]] double dt_s() const override { return 1.0 / 30; }
  [[nodiscard]] engine::Vec3 gravity() const override { return gravity_in_force; }
  [[nodiscard]] double damping_per_s() const override { return 0; }
  [[nodiscard]] engine::Classification classify(const engine::Input& input) const override {
    using Effect = engine::Classification::Effect;
    engine::Classification effect;
    if (input.kind == static_cast<std::uint32_t>(engine::InputKind::kGravity) && input.values.size() == 3) {
      const bool large = std::ranges::any_of(input.values, [](double v) { return !(std::abs(v) <= 1000); });
      effect.effect = large ? Effect::kRefused : Effect::kScheduled;
      if (large) effect.reason = "beyond 1000";
      std::copy_n(input.values.begin(), 3, effect.gravity.begin());
    } else if (input.kind == static_cast<std::uint32_t>(engine::InputKind::kPush) &&
               input.values.size() == 7) {
      effect.effect = Effect::kImmediate;
      effect.cost = std::abs(input.values[4]);
    }
    return effect;
  }
  void apply(const engine::Input& input) override {
    applied.emplace_back(steps + 1, input);
    if (input.kind == static_cast<std::uint32_t>(engine::InputKind::kGravity)) {
      std::copy_n(input.values.begin(), 3, gravity_in_force.begin());
    }
  }
  void begin_step() override { begun = true; }
  [[nodiscard]] bool step_ready() override {
    if (!begun) return true;
    if (!failure_now.empty()) return true;
    if (ready && !ready()) return false;
    begun = false;
    step();
    return true;
  }
  [[nodiscard]] std::string failure() override { return failure_now; }
  void step() override {
    ++steps;
    events_now.clear();
    // By a velocity that the lattice holds exactly, so that nothing is corrected, and no frame is quiet.
    if (!rests && alive.back() != 0) position[0].back() += (velocity[0].back() = 30.0F / 32) / 30;
    if (on_step) on_step(steps);
  }
  [[nodiscard]] engine::Bodies bodies() const override {
    return {.position = {position[0], position[1], position[2]},
            .velocity = {velocity[0], velocity[1], velocity[2]},
            .alive = alive,
            .type = type,
            .orientation = {orientation[0], orientation[1], orientation[2], orientation[3]},
            .angular_velocity = {angular_velocity[0], angular_velocity[1], angular_velocity[2]}};
  }
  [[nodiscard]] std::span<const engine::Event> events() const override { return events_now; }
  [[nodiscard]] std::uint32_t colliding() const override { return 0; }
  void tell(engine::StepNews& news) override {
    if (on_tell) on_tell(steps, news);
  }
  [[nodiscard]] engine::InputBudget input_budget() const override { return budget; }
  [[nodiscard]] engine::Mishaps mishaps() const override { return mishaps_so_far; }
  [[nodiscard]] std::vector<engine::BodyName> names() const override {
    ++asked_for_names;
    return body_names;
  }
  [[nodiscard]] std::uint64_t names_version() const override { return names_version_now; }
  void save(std::vector<std::byte>& out) const override { out.clear(); }
  [[nodiscard]] bool load(std::span<const std::byte> bytes) override { return bytes.empty(); }

  /// From now on its bodies have orientations, all unturned at first.
  void turn() {
    for (auto& column : orientation) column.assign(capacity(), 0.0F);
    orientation[3].assign(capacity(), 1.0F);
    for (auto& column : angular_velocity) column.assign(capacity(), 0.0F);
  }

  bool rests = false;  ///< true: all its bodies; false: the last one drifts
  std::array<std::vector<float>, 3> position, velocity;
  std::array<std::vector<float>, 4> orientation;
  std::array<std::vector<float>, 3> angular_velocity;
  std::vector<std::uint8_t> alive;
  std::vector<std::uint16_t> type;
  std::vector<engine::Event> events_now;
  engine::Vec3 gravity_in_force{};
  engine::Mishaps mishaps_so_far;
  std::vector<engine::BodyName> body_names;
  std::uint64_t names_version_now = 0;
  mutable int asked_for_names = 0;
  engine::InputBudget budget;
  std::function<void(std::uint64_t step)> on_step;
  std::function<void(std::uint64_t step, engine::StepNews& news)> on_tell;
  std::function<bool()> ready;  // says whether the step that was begun is finished; empty: always
  bool begun = false;
  std::string failure_now;
  std::uint64_t steps = 0;
  std::vector<std::pair<std::uint64_t, engine::Input>> applied;  // with the step it acted in
};

/// A port from which the host takes the test's messages, and which keeps the host's own by kind and in order.
class FakePort final : public transport::ServerPort {
 public:
  explicit FakePort(transport::ParticipantId self) : self_(self) {}

  [[nodiscard]] transport::ParticipantId self() const override { return self_; }
  void take_sessions(std::vector<transport::Received<transport::SessionMessage>>& out) override {
    out.insert(out.end(), rivals.begin(), rivals.end());
  }
  Result<void> open_streams(std::uint32_t count) override {
    open_stream_count = std::max(open_stream_count, count);
    return {};
  }
  Result<void> write(const transport::SessionMessage& m) override { return keep(sessions, m, "session"); }
  Result<void> write(const transport::DeltaMessage& m) override { return keep(deltas, m, "delta"); }
  Result<void> write(const transport::ScheduledInputMessage& m) override {
    return keep(scheduled, m, "scheduled");
  }
  Result<void> write(transport::ClientId to, const transport::SnapshotMessage& m) override {
    if (!client_writers.contains(to)) return fail(ErrorCode::kInvalidArgument, "not open");
    snapshots_to.push_back(to);
    return keep(snapshots, m, "snapshot");
  }
  Result<void> write(const transport::ReplyMessage& m) override { return keep(replies, m, "reply"); }
  Result<void> write(const transport::ServerStatusMessage& m) override { return keep(statuses, m, "status"); }
  Result<void> open_client(transport::ClientId client) override {
    client_writers.insert(client);
    return {};
  }
  void close_client(transport::ClientId client) override { client_writers.erase(client); }
  void take(std::vector<transport::Received<transport::InputMessage>>& out) override { move(inputs, out); }
  void take(std::vector<transport::Received<transport::AckMessage>>& out) override { move(acks, out); }
  [[nodiscard]] double observer_bytes_per_s(double messages, double bytes) const override {
    return transport::DdsWire::of_observer(messages, bytes);
  }
  [[nodiscard]] bool joined(const transport::ParticipantId& id, transport::ClientId client,
                            std::uint32_t stream) override {
    return stream < open_stream_count && client_writers.contains(client) && !unmatched.contains(id);
  }
  [[nodiscard]] bool alive(const transport::ParticipantId& id) override { return !dead.contains(id); }
  [[nodiscard]] bool acts(const transport::ParticipantId& id) override { return !mute.contains(id); }
  [[nodiscard]] bool vouches_for_servers() const override { return vouches; }
  [[nodiscard]] bool ended(const transport::ParticipantId& id) override { return gone.contains(id); }
  [[nodiscard]] std::uint64_t dropped() const override { return 0; }
  void wait(std::chrono::nanoseconds /*timeout*/) override {}
  void take(std::vector<transport::Received<transport::StandbyMessage>>& out) override {
    move(standbys, out);
  }
  void take(std::vector<transport::Received<transport::CommandMessage>>& out) override {
    move(commands, out);
  }
  Result<void> open_standby(transport::ClientId standby) override {
    standby_writers.insert(standby);
    return {};
  }
  void close_standby(transport::ClientId standby) override { standby_writers.erase(standby); }
  [[nodiscard]] bool follows(const transport::ParticipantId& id, transport::ClientId standby) override {
    return standby_writers.contains(standby) && !unmatched.contains(id);
  }
  Result<void> write(const transport::JournalMessage& m) override { return keep(journal, m, "journal"); }
  Result<void> write(transport::ClientId /*to*/, const transport::CheckpointMessage& m) override {
    return keep(checkpoints, m, "checkpoint");
  }
  Result<void> follow(transport::ClientId /*standby*/) override { return {}; }
  void unfollow() override {}
  void take(std::vector<transport::Received<transport::JournalMessage>>& /*out*/) override {}
  void take(std::vector<transport::Received<transport::CheckpointMessage>>& /*out*/) override {}
  Result<void> write(const transport::StandbyMessage& /*m*/) override { return {}; }

  std::vector<transport::Received<transport::SessionMessage>> rivals;
  std::vector<transport::Received<transport::InputMessage>> inputs;
  std::vector<transport::Received<transport::AckMessage>> acks;
  std::vector<transport::Received<transport::StandbyMessage>> standbys;
  std::vector<transport::Received<transport::CommandMessage>> commands;
  std::vector<transport::JournalMessage> journal;
  std::vector<transport::CheckpointMessage> checkpoints;
  std::set<transport::ClientId> standby_writers;
  std::set<transport::ParticipantId> unmatched, dead, gone, mute;
  std::vector<transport::SessionMessage> sessions;
  std::vector<transport::DeltaMessage> deltas;
  std::vector<transport::ScheduledInputMessage> scheduled;
  std::vector<transport::SnapshotMessage> snapshots;
  std::vector<transport::ReplyMessage> replies;
  std::vector<transport::ClientId> snapshots_to;  // of each of these
  std::set<transport::ClientId> client_writers;
  std::vector<transport::ServerStatusMessage> statuses;
  std::vector<std::string> order;  // kinds, as written
  std::uint32_t open_stream_count = 1;
  bool vouches = false;
  int failing_writes = 0;  // the next so many deltas are refused
  ErrorCode failure = ErrorCode::kTransport;

 private:
  template <class M>
  Result<void> keep(std::vector<M>& kept, const M& message, const char* kind) {
    if (std::is_same_v<M, transport::DeltaMessage> && failing_writes > 0) {
      --failing_writes;
      return fail(failure, "refused by the test");
    }
    kept.push_back(message);
    order.emplace_back(kind);
    return {};
  }
  template <class M>
  static void move(std::vector<M>& from, std::vector<M>& out) {
    out.insert(out.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
    from.clear();
  }
  transport::ParticipantId self_;
};

[[nodiscard]] inline transport::ParticipantId participant(std::uint8_t tag) {
  transport::ParticipantId id;
  id.bytes.fill(tag);
  return id;
}

/// Thresholds of 1/64 m in a world of 64 m; unit 2^-18 m.
[[nodiscard]] inline HostConfig test_config() {
  HostConfig config;
  config.session = "unit";
  config.epoch = 1'700'000'000'000;
  config.streams.resize(1);
  config.streams[0].layout.capacity = 4;
  config.streams[0].layout.codec = "selective";
  config.streams[0].lattice = *choose_lattice(1.0 / 64, 64, 1.0 / 30);
  config.streams[0].layout.parameters.codec = *codec_parameters(config.streams[0].lattice, 1.0 / 64, 0, 0);
  config.claim_ns = 0;
  return config;
}

/// The same for bodies that turn.
[[nodiscard]] inline HostConfig turning_config() {
  HostConfig config = test_config();
  config.streams[0].layout.codec = "tracker";
  config.streams[0].layout.groups = {kPositionGroup, kOrientationGroup};
  config.streams[0].layout.radii.assign(config.streams[0].layout.type_count, 1000);
  return config;
}

/// A host, its neighbours and a clock. Clients are imitated by ack() and input().
class Bench {
 public:
  static constexpr std::int64_t kPeriod = kSecond / 30 + 1;  // a poll this far on finds the next frame due

  explicit Bench(HostConfig config = test_config(), std::uint32_t capacity = 4)
      : simulation(capacity), port(participant(0xAA)) {
    config.streams[0].layout.capacity = capacity;
    if (groups_of(config.streams[0].layout).orientation) simulation.turn();
    auto made = Host::create(std::move(config), simulation, port);
    if (!made) throw std::runtime_error(made.error().message);
    host = std::move(*made);
  }

  bool poll() {
    const bool produced = host->poll(now, kWallStart + now + wall_set_ns);
    if (draining) drained();
    return produced;
  }
  void drained() {
    while (const auto message = host->outbox().pop(std::chrono::nanoseconds{0})) {
      if (!publish(port, *message)) ++failed_writes;
    }
  }
  /// Polls once a millisecond.
  void run_ms(std::int64_t ms) {
    for (std::int64_t i = 0; i < ms; ++i) {
      now += kMillisecond;
      if (on_ms) on_ms();
      poll();
    }
  }
  /// Announces and produces frames until the last delta is `frame`, one period apart.
  void run_to(Frame frame) {
    for (int i = 0; i < 10'000 && host->frame() < frame; ++i) {
      now += kPeriod;
      poll();
    }
  }

  transport::AckMessage ack(transport::ClientId client, transport::Phase phase, Frame applied,
                            transport::Role role = transport::Role::kParticipant,
                            std::uint32_t attempt = 1) const {
    transport::AckMessage ack;
    ack.client = client;
    ack.epoch = host->session().epoch;
    ack.phase = phase;
    ack.applied = applied;
    ack.simulated = applied;
    ack.role_wanted = role;
    ack.clock_ns = now;
    ack.join_attempt = attempt;
    return ack;
  }
  void send(const transport::AckMessage& message) {
    port.acks.push_back({message, participant(static_cast<std::uint8_t>(message.client))});
  }
  void joining(transport::ClientId client, std::uint32_t attempt = 1,
               transport::Role role = transport::Role::kParticipant) {
    send(ack(client, transport::Phase::kJoining, 0, role, attempt));
  }
  void playing(transport::ClientId client, Frame applied,
               transport::Role role = transport::Role::kParticipant) {
    send(ack(client, transport::Phase::kPlaying, applied, role));
  }
  /// A client that plays and is caught up.
  void enter(transport::ClientId client, transport::Role role = transport::Role::kParticipant) {
    joining(client, 1, role);
    poll();
    playing(client, host->frame(), role);
    poll();
  }

  transport::InputMessage gravity(transport::ClientId client, std::uint64_t number, double z = -5) const {
    transport::InputMessage input;
    input.client = client;
    input.epoch = host->session().epoch;
    input.number = number;
    input.kind = static_cast<std::uint32_t>(transport::InputKind::kGravity);
    input.values = {0, 0, z};
    return input;
  }
  transport::InputMessage push(transport::ClientId client, std::uint64_t number) const {
    auto input = gravity(client, number);
    input.kind = static_cast<std::uint32_t>(transport::InputKind::kPush);
    input.values = {0, 0, 0, 1, 0, 0, 1};
    return input;
  }
  void send(const transport::InputMessage& message) {
    port.inputs.push_back({message, participant(static_cast<std::uint8_t>(message.client))});
  }
  /// The outcome of an input as the last reply to the client tells it.
  [[nodiscard]] std::optional<transport::ReplyEntry> outcome(transport::ClientId client,
                                                             std::uint64_t number) const {
    const auto* reply = last_reply(client);
    if (reply == nullptr) return std::nullopt;
    for (auto entry = reply->entries.rbegin(); entry != reply->entries.rend(); ++entry) {
      if (entry->number == number) return *entry;
    }
    return std::nullopt;
  }
  [[nodiscard]] transport::Reason refusal(transport::ClientId client, std::uint64_t number) const {
    const auto entry = outcome(client, number);
    return entry ? static_cast<transport::Reason>(entry->code) : transport::Reason::kNone;
  }
  [[nodiscard]] const transport::ReplyMessage* last_reply(transport::ClientId client) const {
    for (auto reply = port.replies.rbegin(); reply != port.replies.rend(); ++reply) {
      if (reply->client == client) return &*reply;
    }
    return nullptr;
  }

  static constexpr std::int64_t kWallStart = 1'700'000'000 * kSecond;
  FakeSimulation simulation;
  FakePort port;
  std::unique_ptr<Host> host;
  std::int64_t now = 5 * kSecond;
  std::int64_t wall_set_ns = 0;  ///< by how much somebody has set the wall clock
  bool draining = true;
  int failed_writes = 0;
  std::function<void()> on_ms;
};

}  // namespace tandem::host
