#include "sdk/transport/dds/convert.hpp"

#include <string>
#include <type_traits>
#include <vector>

namespace tandem::transport::dds {
namespace {

// The generated structs have no const, although dds_write only reads.
template <class Sequence, class Element>
void lend(Sequence& sequence, const std::vector<Element>& elements) {
  using Target = std::remove_pointer_t<decltype(sequence._buffer)>;
  static_assert(sizeof(Target) == sizeof(Element));
  sequence._maximum = sequence._length = static_cast<std::uint32_t>(elements.size());
  sequence._buffer = reinterpret_cast<Target*>(const_cast<Element*>(elements.data()));
  sequence._release = false;
}

char* lend(const std::string& text) { return const_cast<char*>(text.c_str()); }

std::vector<char*> lend_each(const std::vector<std::string>& texts) {
  std::vector<char*> lent;
  lent.reserve(texts.size());
  for (const std::string& text : texts) lent.push_back(lend(text));
  return lent;
}

// Holds the memory that a stream's struct points to.
struct LentStream {
  explicit LentStream(const StreamMessage& stream) : groups(lend_each(stream.layout.groups)) {
    for (const auto& [id, value] : list_parameters(stream.layout.parameters)) {
      parameters.push_back(tandem_Parameter{id, value});
    }
  }
  std::vector<char*> groups;
  std::vector<tandem_Parameter> parameters;
};

tandem_SessionStream to_wire(const StreamMessage& stream, const LentStream& lent) {
  const Layout& layout = stream.layout;
  tandem_SessionStream wire{};
  wire.id = stream.id.id;
  wire.generation = stream.id.generation;
  wire.region_blocks = layout.region_blocks;
  wire.client_cost_ns = stream.client_cost_ns;
  wire.max_delta_bytes = stream.max_delta_bytes;
  wire.max_snapshot_bytes = stream.max_snapshot_bytes;
  wire.layout_hash = stream.layout_hash;
  wire.name = lend(stream.name);
  wire.codec = lend(layout.codec);
  wire.predictor = lend(layout.predictor);
  lend(wire.groups, lent.groups);
  lend(wire.radii, layout.radii);
  lend(wire.parameters, lent.parameters);
  lend(wire.predictor_constants, layout.predictor_constants);
  lend(wire.codec_tables, layout.codec_tables);
  return wire;
}

// The list of figures and the IDL agree: in names and types here, in their order by tests
// (sdk/package/figures.py).
struct CopyFigure {
  template <class To, class From>
  void operator()(const char* /*name*/, To& to, const From& from) const {
    static_assert(std::is_same_v<To, From>, "idl/tandem.idl has a figure in another type than its list");
    to = from;
  }
};

}  // namespace

dds_return_t write_sample(dds_entity_t writer, const SessionMessage& message) {
  std::vector<tandem_BodyType> types;
  types.reserve(message.types.size());
  for (const BodyType& type : message.types) {
    tandem_BodyType wire_type{};
    wire_type.radius = type.radius;
    wire_type.colour_rgba = type.colour_rgba;
    wire_type.shape = static_cast<std::uint32_t>(type.shape);
    wire_type.name = lend(type.name);
    lend(wire_type.shape_values, type.shape_values);
    types.push_back(wire_type);
  }
  const std::vector<LentStream> lent(message.streams.begin(), message.streams.end());
  std::vector<tandem_SessionStream> streams;
  for (std::size_t i = 0; i < lent.size(); ++i) streams.push_back(to_wire(message.streams[i], lent[i]));
  std::vector<tandem_BodyName> names;
  names.reserve(message.names.size());
  for (const BodyName& body : message.names) {
    names.push_back(tandem_BodyName{.slot = body.slot, .reuse = body.reuse, .name = lend(body.name)});
  }
  tandem_TandemSession wire{};
  wire.epoch = message.epoch;
  wire.protocol_version = message.protocol_version;
  wire.capacity = message.capacity;
  wire.frame_rate_hz = message.frame_rate_hz;
  wire.dt_s = message.dt_s;
  wire.lattice_unit = message.lattice_unit;
  wire.gravity_x = message.gravity[0];
  wire.gravity_y = message.gravity[1];
  wire.gravity_z = message.gravity[2];
  wire.up_axis = static_cast<std::uint32_t>(message.up_axis);
  wire.lead = message.lead;
  wire.window_ceiling = message.window_ceiling;
  wire.server_role = static_cast<std::uint32_t>(message.server_role);
  wire.standby_rank = message.standby_rank;
  wire.continues_epoch = message.continues_epoch;
  wire.continues_frame = message.continues_frame;
  wire.session = lend(message.session);
  wire.scene = lend(message.scene);
  wire.scene_description = lend(message.scene_description);
  lend(wire.types, types);
  lend(wire.streams, streams);
  lend(wire.names, names);
  return dds_write(writer, &wire);
}

dds_return_t write_sample(dds_entity_t writer, const DeltaMessage& message) {
  tandem_TandemDelta wire{};
  wire.epoch = message.epoch;
  wire.stream = message.stream.id;
  wire.generation = message.stream.generation;
  wire.frame = message.frame;
  wire.part = message.part;
  wire.parts = message.parts;
  wire.last_input = message.last_input;
  wire.server_time_ns = message.server_time_ns;
  wire.hash = message.hash;
  lend(wire.payload, message.payload);
  return dds_write(writer, &wire);
}

dds_return_t write_sample(dds_entity_t writer, const ScheduledInputMessage& message) {
  tandem_TandemScheduledInput wire{};
  wire.epoch = message.epoch;
  wire.number = message.number;
  wire.frame = message.frame;
  wire.source_client = message.source_client;
  wire.source_number = message.source_number;
  wire.kind = message.kind;
  lend(wire.values, message.values);
  return dds_write(writer, &wire);
}

dds_return_t write_sample(dds_entity_t writer, const SnapshotMessage& message) {
  tandem_TandemSnapshot wire{};
  wire.epoch = message.epoch;
  wire.stream = message.stream.id;
  wire.generation = message.stream.generation;
  wire.frame = message.frame;
  wire.part = message.part;
  wire.parts = message.parts;
  wire.total_bytes = message.total_bytes;
  lend(wire.bytes, message.bytes);
  return dds_write(writer, &wire);
}

dds_return_t write_sample(dds_entity_t writer, const ReplyMessage& message) {
  std::vector<tandem_ReplyEntry> entries;
  entries.reserve(message.entries.size());
  for (const ReplyEntry& entry : message.entries) {
    entries.push_back(tandem_ReplyEntry{entry.number, entry.frame, entry.code});
  }
  std::vector<tandem_ReplyText> texts;
  texts.reserve(message.texts.size());
  for (const ReplyText& of : message.texts) {
    texts.push_back(tandem_ReplyText{.number = of.number, .text = lend(of.text)});
  }
  tandem_TandemReply wire{};
  wire.client = message.client;
  wire.epoch = message.epoch;
  wire.role = static_cast<std::uint32_t>(message.role);
  wire.phase = static_cast<std::uint32_t>(message.phase);
  wire.reason = message.reason;
  wire.highest_input = message.highest_input;
  wire.client_clock_ns = message.client_clock_ns;
  wire.server_time_ns = message.server_time_ns;
  lend(wire.entries, entries);
  lend(wire.texts, texts);
  return dds_write(writer, &wire);
}

dds_return_t write_sample(dds_entity_t writer, const InputMessage& message) {
  tandem_TandemInput wire{};
  wire.client = message.client;
  wire.epoch = message.epoch;
  wire.number = message.number;
  wire.client_frame = message.client_frame;
  wire.kind = message.kind;
  lend(wire.values, message.values);
  lend(wire.bytes, message.bytes);
  return dds_write(writer, &wire);
}

dds_return_t write_sample(dds_entity_t writer, const AckMessage& message) {
  tandem_TandemAck wire{};
  wire.client = message.client;
  wire.epoch = message.epoch;
  wire.protocol_version = message.protocol_version;
  wire.stream = message.stream.id;
  wire.generation = message.stream.generation;
  wire.phase = static_cast<std::uint32_t>(message.phase);
  wire.applied = message.applied;
  wire.simulated = message.simulated;
  wire.role_wanted = static_cast<std::uint32_t>(message.role_wanted);
  wire.join_attempt = message.join_attempt;
  wire.clock_ns = message.clock_ns;
  wire.snapshot_frame = message.snapshot_frame;
  wire.snapshot_parts = message.snapshot_parts;
  lend(wire.missing, message.missing);
  return dds_write(writer, &wire);
}

dds_return_t write_sample(dds_entity_t writer, const ServerStatusMessage& message) {
  tandem_TandemServerStatus wire{};
  wire.epoch = message.epoch;
  wire.frame = message.frame;
  wire.behind_frames = message.behind_frames;
  wire.server_role = static_cast<std::uint32_t>(message.server_role);
  each_server_figure(CopyFigure{}, wire, message);
  wire.stream = message.stream;
  wire.session = lend(message.session);
  wire.codec = lend(message.codec);
  wire.predictor = lend(message.predictor);
  return dds_write(writer, &wire);
}

dds_return_t write_sample(dds_entity_t writer, const ClientStatusMessage& message) {
  tandem_TandemClientStatus wire{};
  wire.client = message.client;
  wire.epoch = message.epoch;
  wire.applied = message.applied;
  wire.stream = message.stream.id;
  wire.generation = message.stream.generation;
  wire.role = message.role;
  wire.phase = message.phase;
  wire.too_slow = message.too_slow;
  wire.queue_high_water = message.queue_high_water;
  wire.lag_ms = message.lag_ms;
  each_reported_figure(CopyFigure{}, wire, message);
  wire.session = lend(message.session);
  wire.stream_reason = lend(message.stream_reason);
  return dds_write(writer, &wire);
}

dds_return_t write_sample(dds_entity_t writer, const JournalMessage& message) {
  std::vector<tandem_InputDecision> decisions;
  decisions.reserve(message.decisions.size());
  for (const InputDecision& decision : message.decisions) {
    tandem_InputDecision wire{};
    wire.client = decision.client;
    wire.number = decision.number;
    wire.frame = decision.frame;
    wire.scheduled = decision.scheduled;
    wire.code = decision.code;
    wire.kind = decision.kind;
    lend(wire.participant, decision.participant);
    lend(wire.values, decision.values);
    lend(wire.bytes, decision.bytes);
    decisions.push_back(wire);
  }
  tandem_TandemJournal wire{};
  wire.epoch = message.epoch;
  wire.number = message.number;
  wire.frame = message.frame;
  wire.hash = message.hash;
  wire.successor = message.successor;
  wire.state = static_cast<std::uint32_t>(message.state);
  lend(wire.decisions, decisions);
  return dds_write(writer, &wire);
}

dds_return_t write_sample(dds_entity_t writer, const CheckpointMessage& message) {
  tandem_TandemCheckpoint wire{};
  wire.epoch = message.epoch;
  wire.frame = message.frame;
  wire.journal = message.journal;
  wire.part = message.part;
  wire.parts = message.parts;
  wire.total_bytes = message.total_bytes;
  lend(wire.bytes, message.bytes);
  return dds_write(writer, &wire);
}

dds_return_t write_sample(dds_entity_t writer, const StandbyMessage& message) {
  tandem_TandemStandby wire{};
  wire.standby = message.standby;
  wire.epoch = message.epoch;
  wire.holds_frame = message.holds_frame;
  wire.journal = message.journal;
  wire.part_frame = message.part_frame;
  wire.part_count = message.part_count;
  wire.protocol_version = message.protocol_version;
  wire.rank = message.rank;
  lend(wire.missing, message.missing);
  return dds_write(writer, &wire);
}

dds_return_t write_sample(dds_entity_t writer, const CommandMessage& message) {
  tandem_TandemCommand wire{};
  wire.epoch = message.epoch;
  wire.request = message.request;
  wire.kind = static_cast<std::uint32_t>(message.kind);
  wire.session = lend(message.session);
  return dds_write(writer, &wire);
}

}  // namespace tandem::transport::dds
