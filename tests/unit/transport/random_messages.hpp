#pragma once
// Messages with random content: all fields, all lengths, texts without NUL, any bits in floats but NaN.

#include <random>
#include <string>
#include <type_traits>
#include <vector>

#include "sdk/transport/messages.hpp"

namespace tandem::transport {

class RandomMessages {
 public:
  explicit RandomMessages(std::uint64_t seed) : random_(seed) {}

  template <class M>
  M make();

 private:
  template <class T>
  T number() {
    if constexpr (std::is_enum_v<T>) {
      return static_cast<T>(random_() % 7);
    } else if constexpr (std::is_floating_point_v<T>) {
      return static_cast<T>(static_cast<double>(static_cast<std::int64_t>(random_())) * 1e-6);
    } else {
      return static_cast<T>(random_() >> (random_() % 64));
    }
  }
  template <class... Values>
  void fill(Values&... values) {
    ((values = number<Values>()), ...);
  }
  std::size_t count() { return random_() % 4 == 0 ? 0 : random_() % 20; }
  std::string text() {
    std::string out(count(), ' ');
    for (char& c : out) c = static_cast<char>(1 + random_() % 255);
    return out;
  }
  template <class T>
  std::vector<T> numbers() {
    std::vector<T> out(count());
    for (T& value : out) value = number<T>();
    return out;
  }
  Bytes bytes() {
    Bytes out(random_() % 2000);
    for (std::byte& byte : out) byte = static_cast<std::byte>(random_());
    return out;
  }
  StreamParameters parameters() {
    StreamParameters out;
    out.codec.threshold = 1 + static_cast<std::int32_t>(random_() % 1000000);
    out.codec.position_step = 1 + static_cast<std::int32_t>(random_() % 1000);
    out.codec.velocity_step = 1 + static_cast<std::int32_t>(random_() % 1000);
    fill(out.codec.velocity_gain, out.codec.acceleration_gain, out.step.decay);
    return out;
  }

  std::mt19937_64 random_;
};

template <>
inline BodyType RandomMessages::make() {
  BodyType m;
  fill(m.radius, m.colour_rgba, m.shape);
  m.name = text();
  m.shape_values = numbers<float>();
  return m;
}

template <>
inline StreamMessage RandomMessages::make() {
  StreamMessage m;
  fill(m.id.id, m.id.generation, m.client_cost_ns, m.max_delta_bytes, m.max_snapshot_bytes, m.layout_hash,
       m.layout.region_blocks);
  m.layout.codec = text();
  m.layout.predictor = text();
  m.layout.groups.clear();
  for (std::size_t i = count(); i > 0; --i) m.layout.groups.push_back(text());
  m.layout.radii = numbers<std::int32_t>();
  m.layout.parameters = parameters();
  m.layout.predictor_constants = numbers<std::int32_t>();
  m.layout.codec_tables = bytes();
  return m;
}

template <>
inline SessionMessage RandomMessages::make() {
  SessionMessage m;
  fill(m.epoch, m.protocol_version, m.capacity, m.frame_rate_hz, m.lattice_unit, m.lead, m.window_ceiling);
  m.session = text();
  m.scene = text();
  m.scene_description = text();
  for (std::size_t i = count(); i > 0; --i) m.types.push_back(make<BodyType>());
  for (std::size_t i = count(); i > 0; --i) m.streams.push_back(make<StreamMessage>());
  complete_layouts(m);
  return m;
}

template <>
inline DeltaMessage RandomMessages::make() {
  DeltaMessage m;
  fill(m.epoch, m.stream.id, m.stream.generation, m.frame, m.part, m.parts, m.last_input, m.server_time_ns,
       m.hash);
  m.payload = bytes();
  return m;
}

template <>
inline ScheduledInputMessage RandomMessages::make() {
  ScheduledInputMessage m;
  fill(m.epoch, m.number, m.frame, m.source_client, m.source_number, m.kind);
  m.values = numbers<std::int32_t>();
  return m;
}

template <>
inline SnapshotMessage RandomMessages::make() {
  SnapshotMessage m;
  fill(m.epoch, m.stream.id, m.stream.generation, m.frame, m.part, m.parts, m.total_bytes);
  m.bytes = bytes();
  return m;
}

template <>
inline ReplyMessage RandomMessages::make() {
  ReplyMessage m;
  fill(m.client, m.epoch, m.role, m.phase, m.reason, m.highest_input, m.client_clock_ns, m.server_time_ns);
  for (std::size_t i = count(); i > 0; --i) {
    auto& entry = m.entries.emplace_back();
    fill(entry.number, entry.frame, entry.code);
  }
  return m;
}

template <>
inline InputMessage RandomMessages::make() {
  InputMessage m;
  fill(m.client, m.epoch, m.number, m.client_frame, m.kind);
  m.values = numbers<double>();
  m.bytes = bytes();
  return m;
}

template <>
inline AckMessage RandomMessages::make() {
  AckMessage m;
  fill(m.client, m.epoch, m.protocol_version, m.stream.id, m.stream.generation, m.phase, m.applied,
       m.simulated, m.role_wanted, m.join_attempt, m.clock_ns, m.snapshot_frame, m.snapshot_parts);
  m.missing = numbers<std::uint32_t>();
  return m;
}

template <>
inline ServerStatusMessage RandomMessages::make() {
  ServerStatusMessage m;
  fill(m.stream, m.epoch, m.frame);
  each_server_figure([this](const char*, auto& value) { fill(value); }, m);
  m.session = text();
  m.codec = text();
  m.predictor = text();
  return m;
}

template <>
inline ClientStatusMessage RandomMessages::make() {
  ClientStatusMessage m;
  fill(m.client, m.epoch, m.applied, m.stream.id, m.stream.generation, m.role, m.phase, m.too_slow,
       m.queue_high_water, m.lag_ms);
  each_reported_figure([this](const char*, auto& value) { fill(value); }, m);
  m.session = text();
  return m;
}

}  // namespace tandem::transport
