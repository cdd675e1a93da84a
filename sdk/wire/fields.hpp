#pragma once
// The fields of each message in the order of idl/tandem.idl. CDR visits them, and so does what fills the
// structs that idlc generates (sdk/transport/dds/lend.hpp). Tests fill messages through them.
//
// A visitor has primitive(value), text(string), sequence(bytes), sequence(values, each) and a function
// parameters(visitor, StreamParameters).

#include <string>
#include <type_traits>

#include "sdk/wire/messages.hpp"
#include "sdk/wire/standby_messages.hpp"

namespace tandem::transport {

template <class M, class T>
concept Is = std::is_same_v<std::remove_const_t<M>, T>;

template <class Visitor, class... Values>
void primitives(Visitor& visit, Values&... values) {
  (visit.primitive(values), ...);
}

/// Visits numbers as 16 bits.
template <class Visitor, class... Values>
void narrow(Visitor& visit, Values&... values) {
  const auto one = [&visit](auto& value) {
    auto bits = static_cast<std::uint16_t>(value);
    visit.primitive(bits);
    if constexpr (!std::is_const_v<std::remove_reference_t<decltype(value)>>) value = bits;
  };
  (one(values), ...);
}

template <class Visitor, class Values>
void numbers(Visitor& visit, Values& values) {
  visit.sequence(values, [&](auto& value) { visit.primitive(value); });
}

template <class Visitor, Is<BodyType> M>
void fields(Visitor& visit, M& m) {
  primitives(visit, m.radius, m.colour_rgba, m.shape);
  visit.text(m.name);
  numbers(visit, m.shape_values);
}

template <class Visitor, Is<BodyName> M>
void fields(Visitor& visit, M& m) {
  primitives(visit, m.slot, m.reuse);
  visit.text(m.name);
}

template <class Visitor, Is<DataField> M>
void fields(Visitor& visit, M& m) {
  primitives(visit, m.kind);
  visit.text(m.name);
}

template <class Visitor, Is<Parameter> M>
void fields(Visitor& visit, M& m) {
  primitives(visit, m.id, m.value);
}

template <class Visitor, Is<StreamMessage> M>
void fields(Visitor& visit, M& m) {
  primitives(visit, m.id.id, m.id.generation, m.client_cost_ns, m.max_delta_bytes, m.max_snapshot_bytes,
             m.delay_ms, m.carries, m.cap_kbit_s, m.world_slots, m.layout_hash);
  visit.text(m.name);
  visit.text(m.layout.codec);
  visit.text(m.layout.predictor);
  visit.sequence(m.layout.groups, [&](auto& group) { visit.text(group); });
  numbers(visit, m.layout.radii);
  parameters(visit, m.layout.parameters);
  numbers(visit, m.layout.predictor_constants);
  visit.sequence(m.layout.codec_tables);
}

template <class Visitor, Is<SessionMessage> M>
void fields(Visitor& visit, M& m) {
  primitives(visit, m.epoch, m.protocol_version, m.capacity, m.frame_rate_hz, m.dt_s, m.lattice_unit,
             m.gravity[0], m.gravity[1], m.gravity[2], m.up_axis, m.lead, m.window_ceiling, m.server_role,
             m.standby_rank, m.continues_epoch, m.continues_frame, m.topology_hash, m.topology_bytes);
  visit.text(m.session);
  visit.text(m.scene);
  visit.text(m.scene_json);
  visit.sequence(m.types, [&](auto& type) { fields(visit, type); });
  visit.sequence(m.streams, [&](auto& stream) { fields(visit, stream); });
  visit.sequence(m.names, [&](auto& name) { fields(visit, name); });
  visit.sequence(m.features, [&](auto& feature) { visit.text(feature); });
  visit.sequence(m.data, [&](auto& field) { fields(visit, field); });
}

template <class Visitor, Is<DeltaMessage> M>
void fields(Visitor& visit, M& m) {
  primitives(visit, m.epoch, m.frame, m.last_input, m.server_time_ns, m.hash);
  narrow(visit, m.stream.id, m.stream.generation, m.part, m.parts, m.earlier);
  visit.sequence(m.payload);
}

template <class Visitor, Is<ScheduledInputMessage> M>
void fields(Visitor& visit, M& m) {
  primitives(visit, m.epoch, m.number, m.frame, m.source_client, m.source_number, m.kind);
  numbers(visit, m.values);
}

template <class Visitor, Is<SnapshotMessage> M>
void fields(Visitor& visit, M& m) {
  primitives(visit, m.epoch, m.stream.id, m.stream.generation, m.frame, m.part, m.parts, m.total_bytes);
  visit.sequence(m.bytes);
}

template <class Visitor, Is<ReplyEntry> M>
void fields(Visitor& visit, M& m) {
  primitives(visit, m.number, m.frame, m.code);
}

template <class Visitor, Is<ReplyText> M>
void fields(Visitor& visit, M& m) {
  primitives(visit, m.number);
  visit.text(m.text);
}

template <class Visitor, Is<ReplyMessage> M>
void fields(Visitor& visit, M& m) {
  primitives(visit, m.client, m.epoch, m.role, m.phase, m.reason, m.needed_kbit_s, m.highest_input,
             m.client_clock_ns, m.server_time_ns);
  visit.sequence(m.entries, [&](auto& entry) { fields(visit, entry); });
  visit.sequence(m.texts, [&](auto& text) { fields(visit, text); });
}

template <class Visitor, Is<InputMessage> M>
void fields(Visitor& visit, M& m) {
  primitives(visit, m.client, m.epoch, m.number, m.origin, m.client_frame, m.kind);
  numbers(visit, m.values);
  visit.sequence(m.bytes);
}

template <class Visitor, Is<AckMessage> M>
void fields(Visitor& visit, M& m) {
  primitives(visit, m.client, m.epoch, m.protocol_version, m.stream.id, m.stream.generation, m.phase,
             m.applied, m.simulated, m.role_wanted, m.join_attempt, m.clock_ns, m.snapshot_frame,
             m.snapshot_parts, m.max_delay_ms, m.cap_kbit_s, m.wants);
  numbers(visit, m.missing);
}

template <class Visitor, Is<InputDecision> M>
void fields(Visitor& visit, M& m) {
  primitives(visit, m.client, m.number, m.origin, m.frame, m.scheduled, m.code, m.kind);
  visit.sequence(m.participant);
  numbers(visit, m.values);
  visit.sequence(m.bytes);
}

template <class Visitor, Is<JournalMessage> M>
void fields(Visitor& visit, M& m) {
  primitives(visit, m.epoch, m.number, m.frame, m.hash, m.successor, m.state);
  visit.sequence(m.decisions, [&](auto& decision) { fields(visit, decision); });
  visit.sequence(m.news);
}

template <class Visitor, Is<CheckpointMessage> M>
void fields(Visitor& visit, M& m) {
  primitives(visit, m.epoch, m.frame, m.journal, m.part, m.parts, m.total_bytes);
  visit.sequence(m.bytes);
}

template <class Visitor, Is<StandbyMessage> M>
void fields(Visitor& visit, M& m) {
  primitives(visit, m.standby, m.epoch, m.holds_frame, m.journal, m.part_frame, m.part_count,
             m.protocol_version, m.rank);
  numbers(visit, m.missing);
}

template <class Visitor, Is<CommandMessage> M>
void fields(Visitor& visit, M& m) {
  primitives(visit, m.epoch, m.request, m.kind);
  visit.text(m.session);
}

template <class Visitor>
auto figure(Visitor& visit) {
  return [&visit](const char* /*name*/, auto& value) { visit.primitive(value); };
}

template <class Visitor, Is<ServerStatusMessage> M>
void fields(Visitor& visit, M& m) {
  primitives(visit, m.epoch, m.frame, m.behind_frames, m.server_role);
  each_server_figure(figure(visit), m);
  primitives(visit, m.stream);
  visit.text(m.session);
  visit.text(m.codec);
  visit.text(m.predictor);
}

template <class Visitor, Is<ClientStatusMessage> M>
void fields(Visitor& visit, M& m) {
  primitives(visit, m.client, m.epoch, m.applied, m.stream.id, m.stream.generation, m.role, m.phase,
             m.too_slow, m.queue_high_water, m.lag_ms);
  each_reported_figure(figure(visit), m);
  visit.text(m.session);
  visit.text(m.stream_reason);
}

}  // namespace tandem::transport
