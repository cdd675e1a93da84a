#include "tests/fault/world/actors/forger.hpp"

#include <algorithm>
#include <bit>
#include <limits>
#include <utility>

namespace tandem::world {

Forger::Forger(Stage& stage, std::uint64_t salt)
    : stage_(stage),
      dice_(salt),
      client_(std::move(*stage.network.make_client("default"))),
      server_(std::move(*stage.network.make_server("default"))) {}

transport::ClientId Forger::some_client() {
  switch (dice_.below(3)) {
    case 0:
      return known_client();
    case 1:
      return dice_.below(3);
    default:
      return 5'000'000 + dice_.below(400);
  }
}

transport::ClientId Forger::known_client() {
  std::vector<transport::ClientId> known;
  for (const auto& [id, epoch] : stage_.known_ids)
    if (epoch == stage_.live_epoch) known.push_back(id);
  return known.empty() ? 3 : known[dice_.below(known.size())];
}

Epoch Forger::some_epoch() { return dice_.one_in(6) ? dice_.next() : stage_.live_epoch; }

Frame Forger::some_frame() {
  const Lineage* live = stage_.truth.lineage(stage_.live_epoch);
  const Frame last = live == nullptr ? 0 : live->last;
  return dice_.one_in(4) ? dice_.next() : last - std::min<Frame>(last, dice_.below(5));
}

double Forger::some_value() {
  switch (dice_.below(6)) {
    case 0:
      return std::numeric_limits<double>::quiet_NaN();
    case 1:
      return -std::numeric_limits<double>::infinity();
    case 2:
      return std::bit_cast<double>(dice_.next());
    default:
      return static_cast<double>(dice_.below(2000)) / 10 - 100;
  }
}

transport::Bytes Forger::some_bytes(std::uint64_t most) {
  transport::Bytes bytes(dice_.below(most));
  for (std::byte& byte : bytes) byte = static_cast<std::byte>(dice_.next());
  return bytes;
}

void Forger::speak() { dice_.chance(0.6) ? speak_as_client() : speak_as_server(); }

void Forger::squat() {
  if (squats_in_ != stage_.live_epoch) squats_since_ns_ = stage_.now_ns;
  squats_in_ = stage_.live_epoch;
  const bool hurries = stage_.now_ns - squats_since_ns_ < 200 * kMs;
  if (!hurries && stage_.now_ns - squatted_ns_ < kSecond) return;
  squatted_ns_ = stage_.now_ns;
  for (const auto& [id, epoch] : stage_.known_ids) {
    if (epoch != stage_.live_epoch) continue;
    transport::AckMessage ack;
    ack.client = id;
    ack.epoch = epoch;
    ack.phase = transport::Phase::kJoining;
    ack.role_wanted = transport::Role::kObserver;
    ack.join_attempt = 1;
    static_cast<void>(client_->write(ack));
  }
}

void Forger::speak_as_client() {
  if (dice_.one_in(2)) {
    transport::AckMessage ack;
    ack.client = some_client();
    ack.epoch = some_epoch();
    if (dice_.one_in(10)) ack.protocol_version = static_cast<std::uint32_t>(dice_.next());
    ack.stream.id = static_cast<std::uint32_t>(dice_.below(4));
    ack.phase = static_cast<transport::Phase>(dice_.below(dice_.one_in(10) ? 5 : 2));
    ack.applied = some_frame();
    ack.simulated = some_frame();
    // Delays by participants are those of the faults of clients.
    ack.role_wanted = transport::Role::kObserver;
    ack.clock_ns = static_cast<std::int64_t>(dice_.next());
    ack.join_attempt = static_cast<std::uint32_t>(dice_.below(4));
    ack.snapshot_frame = some_frame();
    ack.snapshot_parts = static_cast<std::uint32_t>(dice_.below(5));
    for (std::uint64_t i = dice_.below(4); i > 0; --i)
      ack.missing.push_back(static_cast<std::uint32_t>(dice_.one_in(3) ? dice_.next() : dice_.below(6)));
    static_cast<void>(client_->write(ack));
    return;
  }
  transport::InputMessage input;
  input.client = some_client();
  input.epoch = some_epoch();
  input.number = dice_.one_in(4) ? dice_.next() : dice_.below(50);
  input.client_frame = some_frame();
  input.kind = dice_.one_in(4) ? static_cast<std::uint32_t>(dice_.next())
                               : 1 + static_cast<std::uint32_t>(dice_.below(2));
  input.values.resize(dice_.one_in(4) ? dice_.below(16) : (input.kind == 1 ? 3 : 7));
  for (double& value : input.values) value = some_value();
  if (dice_.one_in(4)) input.bytes = some_bytes(1024);
  static_cast<void>(client_->write(input));
}

void Forger::speak_as_server() {
  const std::uint64_t what = dice_.below(5);
  if (what == 0) {
    transport::DeltaMessage delta;
    delta.epoch = some_epoch();
    delta.frame = some_frame() + dice_.below(3);
    delta.parts = 1 + static_cast<std::uint32_t>(dice_.below(2));
    delta.last_input = dice_.below(50);
    delta.hash = dice_.next();
    delta.payload = some_bytes(200);
    static_cast<void>(server_->write(delta));
  } else if (what == 1) {
    transport::ScheduledInputMessage input;
    input.epoch = some_epoch();
    input.number = dice_.below(100);
    input.frame = some_frame() + dice_.below(3);
    input.kind = static_cast<std::uint32_t>(dice_.below(3));
    input.values.resize(dice_.one_in(4) ? dice_.below(8) : 4);
    for (std::int32_t& value : input.values) value = static_cast<std::int32_t>(dice_.below(20000)) - 10000;
    static_cast<void>(server_->write(input));
  } else if (what == 2) {
    transport::SnapshotMessage snapshot;
    snapshot.epoch = some_epoch();
    snapshot.frame = some_frame();
    snapshot.parts = 1 + static_cast<std::uint32_t>(dice_.below(3));
    snapshot.bytes = some_bytes(1300);
    snapshot.total_bytes = static_cast<std::uint32_t>(snapshot.bytes.size());
    const transport::ClientId to = some_client();
    if (server_->open_client(to)) static_cast<void>(server_->write(to, snapshot));
  } else if (what == 3) {
    transport::ReplyMessage reply;
    reply.client = some_client();
    reply.epoch = some_epoch();
    reply.reason = static_cast<std::uint32_t>(dice_.below(14));
    reply.highest_input = dice_.below(100);
    for (std::uint64_t number = dice_.below(5); number > 0; --number)
      reply.entries.push_back({number, some_frame(), static_cast<std::uint32_t>(dice_.below(3))});
    static_cast<void>(server_->write(reply));
  } else {
    transport::ServerStatusMessage status;
    status.session = "default";
    status.epoch = some_epoch();
    status.frame = some_frame();
    static_cast<void>(server_->write(status));
  }
}

}  // namespace tandem::world
