#pragma once
// Shared by the DDS tests: loopback only, a domain and session of their own, waiting for a condition.

#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <memory>
#include <string>

#include "sdk/transport/dds/dds_ports.hpp"

namespace tandem::transport::test {

using namespace std::chrono_literals;

inline constexpr const char* kLoopback =
    "<CycloneDDS><Domain id=\"any\"><General><Interfaces><NetworkInterface name=\"lo\" multicast=\"true\"/>"
    "</Interfaces></General></Domain></CycloneDDS>";

/// A domain for this process. Runs that share one by chance still have different session names.
inline DdsOptions loopback() {
  static int count = 0;
  setenv("CYCLONEDDS_URI", kLoopback, 1);
  DdsOptions options;
  options.domain = 1 + static_cast<std::uint32_t>(getpid()) % 99;  // beyond, ports are ephemeral ones
  options.session = "test-" + std::to_string(getpid()) + "-" + std::to_string(++count);
  return options;
}

/// Looks until `condition` holds; the limit only ends a test that fails.
template <class Condition>
[[nodiscard]] bool eventually(Condition&& condition, std::chrono::milliseconds limit = 10s) {
  const auto end = std::chrono::steady_clock::now() + limit;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    usleep(2000);
  }
  return true;
}

inline SessionMessage a_session(const std::string& name, Epoch epoch) {
  SessionMessage session;
  session.session = name;
  session.epoch = epoch;
  session.capacity = 10000;
  session.lattice_unit = 1.0 / 1024;
  session.lead = 1;
  session.scene = "half_pipe";
  session.scene_json = "{}";
  session.types = {BodyType{"sand", 0.25F, 0xFF8800FF, Shape::kSphere, {}},
                   BodyType{"", 1.5F, 7, Shape::kBox, {1, 2, 3.5F}}};
  StreamMessage stream;
  stream.client_cost_ns = 12;
  stream.max_delta_bytes = 1U << 20U;
  stream.max_snapshot_bytes = 1U << 20U;
  stream.layout.capacity = session.capacity;
  stream.layout.type_count = 2;
  stream.layout.codec = "entropy";
  stream.layout.parameters.codec.threshold = 100;
  stream.layout.parameters.codec.position_step = 7;
  stream.layout.parameters.codec.velocity_step = 9;
  stream.layout.parameters.step.decay = 10;
  stream.layout.predictor = "ballistic";
  stream.layout.predictor_constants = {1, -2, 3};
  stream.layout.codec_tables = Bytes(300, std::byte{5});
  stream.layout_hash = layout_hash(session, stream);
  session.streams.push_back(stream);
  stream.id = {1, 3};
  stream.carries = stream.id.id;
  stream.layout.groups = {"position", "orientation"};
  stream.layout.radii = {500, 700};
  session.streams.push_back(stream);
  return session;
}

inline DeltaMessage a_delta(Epoch epoch, Frame frame, std::size_t size = 100) {
  DeltaMessage delta;
  delta.epoch = epoch;
  delta.frame = frame;
  delta.last_input = frame / 2;
  delta.server_time_ns = -static_cast<std::int64_t>(frame);
  delta.hash = frame * 31;
  delta.payload = Bytes(size, static_cast<std::byte>(frame));
  return delta;
}

inline SnapshotMessage a_snapshot(Epoch epoch, Frame frame, std::size_t size = 1000) {
  SnapshotMessage snapshot;
  snapshot.epoch = epoch;
  snapshot.frame = frame;
  snapshot.total_bytes = static_cast<std::uint32_t>(size);
  snapshot.bytes = Bytes(size, static_cast<std::byte>(frame));
  return snapshot;
}

inline ScheduledInputMessage a_scheduled_input(Epoch epoch, std::uint64_t number) {
  ScheduledInputMessage input;
  input.epoch = epoch;
  input.number = number;
  input.frame = number * 10;
  input.source_client = 99;
  input.source_number = number + 1;
  input.kind = static_cast<std::uint32_t>(ScheduledKind::kDrive);
  input.values = {0, -980, 0, 12};
  return input;
}

inline AckMessage an_ack(ClientId client, Epoch epoch, Frame applied) {
  AckMessage ack;
  ack.client = client;
  ack.epoch = epoch;
  ack.phase = Phase::kPlaying;
  ack.applied = applied;
  ack.simulated = applied + 1;
  ack.role_wanted = Role::kParticipant;
  ack.clock_ns = 123456789;
  ack.join_attempt = 2;
  ack.snapshot_frame = 3;
  ack.snapshot_parts = 20;
  ack.missing = {0, 2, 7, 1};
  return ack;
}

}  // namespace tandem::transport::test
