#pragma once
// The messages of the topics as plain structs. The DDS types are generated from idl/tandem.idl and stay in
// dds/. Meanings, ranges and QoS of the fields: idl/PROTOCOL.md.

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "sdk/core/lattice/state.hpp"
#include "sdk/core/layout/layout.hpp"
#include "tandem/body_shape.hpp"
#include "tandem/client_figures.hpp"
#include "tandem/server_figures.hpp"

namespace tandem::transport {

/// Why a server answered as it did. Used in Reply.reason and, for inputs, in a ReplyEntry's code.
enum class Reason : std::uint32_t {
  kNone = 0,      ///< no error, or the input was applied
  kObserver = 1,  ///< observers may not send input
  kDemoted = 2,   ///< the client caused more suspension than stall_timeout within 10 s
  kInvalid = 3,   ///< the input is not finite, out of range, or of an unknown kind
  kRateLimited = 4,
  kStaleEpoch = 5,
  kDuplicate = 6,      ///< the number, or a higher one, was handled before
  kNotPlaying = 7,     ///< the client has not finished joining
  kForeignClient = 8,  ///< the client id belongs to another DDS participant
  kProtocolVersion = 9,
  kFull = 10,       ///< the server's client limit is reached
  kNoStream = 11,   ///< the named stream or generation is not played here
  kRecording = 12,  ///< the session is a recording: inputs cannot act on it
  kCap = 13,        ///< the stream's cap is above the client's, or the client's is out of range
};
inline constexpr std::size_t kReasons = 14;

// Declared after Reason; otherwise g++ 12 warns that its enumerator shadows this.
inline constexpr std::uint32_t kProtocolVersion = 4;
using ClientId = std::uint64_t;  ///< random, never 0
using Bytes = std::vector<std::byte>;

/// Where a sample came from, as the transport knows it: the DDS participant's GUID prefix and entity.
struct ParticipantId {
  std::array<std::uint8_t, 16> bytes{};
  bool operator==(const ParticipantId&) const = default;
  // No operator<=>: clang 14's library has none for arrays.
  bool operator<(const ParticipantId& other) const { return bytes < other.bytes; }
};

using Shape = BodyShape;

struct BodyType {
  std::string name;
  float radius = 0;               ///< scene units
  std::uint32_t colour_rgba = 0;  ///< 0xRRGGBBAA
  Shape shape = Shape::kNone;
  std::vector<float> shape_values = {};  ///< scene units, in the body's frame; for drawing only
  bool operator==(const BodyType&) const = default;
};

/// The name of a body, for people. It is the name of the body that the slot holds while the slot has this
/// count of reuse.
struct BodyName {
  Slot slot = 0;
  std::uint32_t reuse = 0;
  std::string name;  ///< 1..64 bytes of UTF-8 without control characters
  bool operator==(const BodyName&) const = default;
};

using tandem::DataField;

/// The axis of the scene that points up.
enum class UpAxis : std::uint32_t { kX = 0, kY = 1, kZ = 2 };

/// The role of a server in its session.
enum class ServerRole : std::uint32_t {
  kLive = 0,
  kStandby = 1,  ///< it follows the live server and can take over; clients do not join it
};

/// One stream of the session's world. All streams share epoch, rate, lead, lattice, slots and inputs.
struct StreamMessage {
  StreamId id;
  std::string name;                      ///< 1..32 characters of [a-z0-9_-]; empty: none
  std::uint32_t client_cost_ns = 0;      ///< cost of a client's predicted step and hash, per body and frame
  std::uint32_t max_delta_bytes = 0;     ///< maximum size of a whole payload
  std::uint32_t max_snapshot_bytes = 0;  ///< maximum size of a whole snapshot
  std::uint32_t delay_ms = 0;            ///< maximum time for which the server collects frames for a delta
  std::uint32_t carries = 0;             ///< id of the stream whose frames these are; its own: it has its own
  std::uint32_t cap_kbit_s = 0;          ///< maximum on the wire, for one client; 0: none
  std::uint32_t world_slots = 0;         ///< 0: it is no view
  std::uint64_t layout_hash = 0;         ///< see layout_hash() in port.hpp
  /// Includes the session's capacity, lead and number of types. Received parameters that are incomplete or
  /// out of range read as CodecParameters{}, which no layout may have.
  Layout layout;
  bool operator==(const StreamMessage&) const = default;
};

struct SessionMessage {
  static constexpr const char* kTopic = "TandemSession";
  std::string session;  ///< key; no wildcard characters, 1..64 bytes of [A-Za-z0-9._-]
  Epoch epoch = 0;      ///< ms of wall clock at the server's start
  std::uint32_t protocol_version = kProtocolVersion;
  std::uint32_t capacity = 0;  ///< slots
  double frame_rate_hz = 30;
  double dt_s = 1.0 / 30;           ///< seconds that one frame simulates
  double lattice_unit = 0;          ///< scene units per lattice unit
  std::array<double, 3> gravity{};  ///< scene units / s^2, in force at the epoch's first frame
  UpAxis up_axis = UpAxis::kY;
  std::uint32_t lead = 1;  ///< frames that a client may simulate beyond its last delta, 0 or 1
  std::uint32_t window_ceiling = 24;
  ServerRole server_role = ServerRole::kLive;
  std::uint32_t standby_rank = 0;  ///< order in which standbys take over, from 1; 0: a live server
  Epoch continues_epoch = 0;       ///< the epoch that this one continues; 0: none
  Frame continues_frame = 0;       ///< the frame of that epoch from which this one continues
  std::uint64_t topology_hash = 0;
  std::uint32_t topology_bytes = 0;
  std::string scene;       ///< name
  std::string scene_json;  ///< idl/scene.proto's Scene in protobuf's JSON mapping, for drawing; or empty
  std::vector<BodyType> types;
  std::vector<StreamMessage> streams;  ///< at least one; a client chooses among those that it can play
  std::vector<BodyName> names;         ///< ascending by slot, each slot once
  std::vector<std::string> features;   ///< what a client has to know beside this version, ascending
  std::vector<DataField> data;
  bool operator==(const SessionMessage&) const = default;
};

struct DeltaMessage {
  static constexpr const char* kTopic = "TandemDelta";
  Epoch epoch = 0;
  StreamId stream;
  Frame frame = 0;
  std::uint32_t part = 0, parts = 1;
  std::uint32_t earlier = 0;        ///< frames in front of this one that it tells, too: see read_frames()
  std::uint64_t last_input = 0;     ///< number of the last scheduled input issued before this delta
  std::int64_t server_time_ns = 0;  ///< wall clock at publication
  std::uint64_t hash = 0;
  Bytes payload;
  bool operator==(const DeltaMessage&) const = default;
};

enum class ScheduledKind : std::uint32_t {
  kDrive = 1,  ///< integers: gravity x, y, z (1/64 lattice unit per frame^2), damping D
};

struct ScheduledInputMessage {
  static constexpr const char* kTopic = "TandemScheduledInput";
  Epoch epoch = 0;
  std::uint64_t number = 0;
  Frame frame = 0;
  ClientId source_client = 0;
  std::uint64_t source_number = 0;
  std::uint32_t kind = 0;
  std::vector<std::int32_t> values;
  bool operator==(const ScheduledInputMessage&) const = default;
};

struct SnapshotMessage {
  static constexpr const char* kTopic = "TandemSnapshot";
  Epoch epoch = 0;
  StreamId stream;
  Frame frame = 0;
  std::uint32_t part = 0, parts = 1;
  std::uint32_t total_bytes = 0;  ///< size of all parts together
  Bytes bytes;
  bool operator==(const SnapshotMessage&) const = default;
};

enum class Role : std::uint32_t { kObserver = 0, kParticipant = 1 };
enum class Phase : std::uint32_t { kJoining = 0, kPlaying = 1 };

struct ReplyEntry {
  std::uint64_t number = 0;  ///< the client's input number
  Frame frame = 0;           ///< the frame that the input acted on, if code is kNone
  std::uint32_t code = 0;    ///< Reason
  bool operator==(const ReplyEntry&) const = default;
};
inline constexpr std::size_t kReplyRing = 32;

/// The words in which the simulation refused an input.
struct ReplyText {
  std::uint64_t number = 0;  ///< the client's input number
  std::string text;          ///< at most 200 bytes of UTF-8 without control characters
  bool operator==(const ReplyText&) const = default;
};

struct ReplyMessage {
  static constexpr const char* kTopic = "TandemReply";
  ClientId client = 0;  ///< key
  Epoch epoch = 0;
  Role role = Role::kObserver;
  Phase phase = Phase::kJoining;
  std::uint32_t reason = 0;          ///< Reason
  std::uint32_t needed_kbit_s = 0;   ///< with kCap: the smallest cap that would be taken
  std::uint64_t highest_input = 0;   ///< highest input number that was handled
  std::int64_t client_clock_ns = 0;  ///< echo of the client's clock from its last acknowledgement
  std::int64_t server_time_ns = 0;
  std::vector<ReplyEntry> entries;  ///< at most the last 32, oldest first
  std::vector<ReplyText> texts;     ///< at most 8, oldest first: of entries that the simulation refused
  bool operator==(const ReplyMessage&) const = default;
};

enum class InputKind : std::uint32_t {
  kGravity = 1,       ///< values: x, y, z in scene units / s^2 (scheduled)
  kPush = 2,          ///< values: centre x, y, z; radius; velocity change x, y, z (immediate)
  kSeek = 3,          ///< values: the time to seek to, seconds into the replayed recording
  kApplication = 16,  ///< bytes for the engine (immediate)
};

struct InputMessage {
  static constexpr const char* kTopic = "TandemInput";
  ClientId client = 0;  ///< key
  Epoch epoch = 0;
  std::uint64_t number = 0;  ///< counts up for as long as the client lives; gaps are legal
  ClientId origin = 0;       ///< on whose behalf; 0: the client's own
  Frame client_frame = 0;
  std::uint32_t kind = 0;      ///< InputKind
  std::vector<double> values;  ///< at most 16
  Bytes bytes;                 ///< at most 1024
  bool operator==(const InputMessage&) const = default;
};

struct AckMessage {
  static constexpr const char* kTopic = "TandemAck";
  ClientId client = 0;  ///< key
  Epoch epoch = 0;      ///< 0: the client looks for the session
  std::uint32_t protocol_version = kProtocolVersion;
  StreamId stream;  ///< played or joined
  Phase phase = Phase::kJoining;
  Frame applied = 0;
  Frame simulated = 0;
  Role role_wanted = Role::kObserver;
  std::uint32_t join_attempt = 0;    ///< counts this client's requests for a snapshot; a new value is a new
                                     ///< request
  std::int64_t clock_ns = 0;         ///< the client's steady clock
  Frame snapshot_frame = 0;          ///< while joining: frame of the snapshot that is coming in
  std::uint32_t snapshot_parts = 0;  ///< number of its parts; 0: no part has come
  std::uint32_t max_delay_ms = 0;    ///< how long frames may be collected for this client
  std::uint32_t cap_kbit_s = 0;      ///< maximum on the wire; 0: none
  std::uint32_t wants = 0;
  std::vector<std::uint32_t> missing;  ///< parts not received: pairs of first part and count, ascending
  bool operator==(const AckMessage&) const = default;
};

struct ServerStatusMessage : ServerFigures {
  static constexpr const char* kTopic = "TandemServerStatus";
  std::string session;       ///< key
  std::uint32_t stream = 0;  ///< key
  Epoch epoch = 0;
  Frame frame = 0;
  std::uint64_t behind_frames = 0;  ///< frames that a standby is behind the live server
  ServerRole server_role = ServerRole::kLive;
  std::string codec, predictor;
  bool operator==(const ServerStatusMessage&) const = default;
};

/// `client_ms_p50` and `mbit_per_s` are those of the last second.
struct ClientStatusMessage : ReportedFigures {
  static constexpr const char* kTopic = "TandemClientStatus";
  ClientId client = 0;  ///< key
  std::string session;
  Epoch epoch = 0;
  Frame applied = 0;
  StreamId stream;
  std::uint32_t role = 0, phase = 0;
  std::uint32_t too_slow = 0;  ///< 1: the median frame takes more than half a period
  std::uint32_t queue_high_water = 0;
  double lag_ms = 0;
  std::string stream_reason;  ///< why the client plays this stream, at most 64 bytes
  bool operator==(const ClientStatusMessage&) const = default;
};

/// Words of SessionMessage::features: see WorldFeatures.
inline constexpr std::string_view kKeysFeature = "keys", kEventsFeature = "events";

/// What SessionMessage::features says of these.
[[nodiscard]] std::vector<std::string> features_of(const WorldFeatures& world);

/// Copies into every stream's layout what the session holds for all of them.
void complete_layouts(SessionMessage& session);

}  // namespace tandem::transport
