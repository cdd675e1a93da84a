#include "sdk/wire/limits.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/news/news.hpp"
#include "sdk/wire/plain_text.hpp"
#include "sdk/wire/port.hpp"

namespace tandem::transport {
namespace {

bool is_name(const std::string& text) { return text.size() <= kMaxNameBytes; }
bool is_positive(double value) { return std::isfinite(value) && value > 0; }
bool is_role(Role role) { return role == Role::kObserver || role == Role::kParticipant; }
bool is_role(ServerRole role) { return role == ServerRole::kLive || role == ServerRole::kStandby; }
bool is_phase(Phase phase) { return phase == Phase::kJoining || phase == Phase::kPlaying; }

bool is_finite(const std::vector<float>& values) {
  return std::all_of(values.begin(), values.end(), [](float value) { return std::isfinite(value); });
}

/// What is wrong with the number of a type's shape values; empty if nothing is.
std::string wrong_with_shape(const BodyType& type) {
  constexpr const char* kRules[] = {"no shape has no", "a sphere has no",  "a box has 3",
                                    "a capsule has 2", "a cylinder has 2", "a hull has 12, 15 ... 768"};
  constexpr std::size_t kCounts[] = {0, 0, 3, 2, 2};
  const auto shape = static_cast<std::size_t>(type.shape);
  const std::size_t count = type.shape_values.size();
  if (shape >= std::size(kRules)) return "an unknown shape";
  const bool fits = type.shape == Shape::kHull ? count >= 12 && count <= kMaxHullValues && count % 3 == 0
                                               : count == kCounts[shape];
  return fits ? std::string() : kRules[shape] + (" shape values, not " + std::to_string(count));
}

Result<void> check(const BodyType& type) {
  const auto refuse = [&type](const std::string& what) {
    return fail(ErrorCode::kInvalidArgument,
                "body type '" + type.name.substr(0, kMaxNameBytes) + "': " + what);
  };
  if (!is_name(type.name)) return refuse("a name has at most 64 bytes");
  if (!std::isfinite(type.radius) || type.radius < 0) return refuse("a radius is finite and not negative");
  if (const std::string wrong = wrong_with_shape(type); !wrong.empty()) return refuse(wrong);
  if (!is_finite(type.shape_values)) return refuse("a shape value is not finite");
  return {};
}

Result<void> check(const StreamMessage& stream) {
  const Layout& layout = stream.layout;
  const auto refuse = [&stream](const char* what) {
    return fail(ErrorCode::kInvalidArgument, "stream " + std::to_string(stream.id.id) + ": " + what);
  };
  if (stream.id.id > kMaxStreamNumber || stream.id.generation > kMaxStreamNumber)
    return refuse("ids and generations are at most 65,535");
  if (stream.max_delta_bytes > kMaxDeltaBytes) return refuse("deltas above 128 MiB");
  if (stream.max_snapshot_bytes > kMaxSnapshotBytes) return refuse("snapshots above 256 MiB");
  if (stream.cap_kbit_s != 0 && !is_cap(stream.cap_kbit_s)) return refuse("a cap is 16 to 10,000,000 kbit/s");
  if (stream.delay_ms > kMaxDelayMs) return refuse("frames are collected for at most a second");
  if (!stream.name.empty() && !is_stream_name(stream.name))
    return refuse("a stream's name has 1 to 32 characters of a-z, 0-9, '_' and '-'");
  if (!is_name(layout.codec) || !is_name(layout.predictor)) return refuse("a name has at most 64 bytes");
  if (layout.groups.empty() || layout.groups.size() > kMaxGroups ||
      !std::all_of(layout.groups.begin(), layout.groups.end(), is_name))
    return refuse("1 to 8 groups, with names of at most 64 bytes");
  if (layout.radii.size() > kMaxTypes) return refuse("more radii than types");
  if (layout.predictor_constants.size() > kMaxPredictorConstants) return refuse("more than 2^20 constants");
  if (layout.codec_tables.size() > kMaxTableBytes) return refuse("codec tables above 4 MiB");
  return {};
}

bool is_name_of_body(const BodyName& body, std::uint32_t capacity) {
  return body.slot < capacity && body.reuse <= 255 && !body.name.empty() && is_name(body.name) &&
         is_plain_text(body.name);
}

Result<void> check(const std::vector<BodyName>& names, std::uint32_t capacity) {
  std::uint32_t least = 0;  // the slots ascend
  for (const BodyName& body : names) {
    if (names.size() > kMaxBodyNames || body.slot < least || !is_name_of_body(body, capacity))
      return fail(ErrorCode::kInvalidArgument, "a name of a body breaks a rule");
    least = body.slot + 1;
  }
  return {};
}

}  // namespace

bool is_stream_name(std::string_view name) {
  const auto allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  };
  return !name.empty() && name.size() <= kMaxStreamNameBytes &&
         std::all_of(name.begin(), name.end(), allowed);
}

Result<void> check_announcement(const SessionMessage& message) {
  const auto refuse = [](const char* what) { return fail(ErrorCode::kInvalidArgument, what); };
  if (auto named = check_session_name(message.session); !named) return named;
  if (message.capacity < 1 || message.capacity > kMaxCapacity) return refuse("capacity is 1 to 2^22 slots");
  if (!is_positive(message.frame_rate_hz)) return refuse("a frame rate is positive");
  if (!is_positive(message.dt_s)) return refuse("the time of a frame is positive");
  if (!is_positive(message.lattice_unit)) return refuse("a lattice unit is positive");
  if (!std::all_of(message.gravity.begin(), message.gravity.end(), [](double g) { return std::isfinite(g); }))
    return refuse("gravity is finite");
  if (message.up_axis > UpAxis::kZ) return refuse("the axis that is up is 0, 1 or 2");
  if (!is_role(message.server_role)) return refuse("an unknown role");
  if (message.server_role == ServerRole::kStandby && message.standby_rank == 0)
    return refuse("a server that stands by has a rank");
  if (message.window_ceiling < 1 || message.window_ceiling > kMaxWindowCeiling)
    return refuse("a window ceiling is 1 to 1024 frames");
  if (!is_name(message.scene)) return refuse("a scene's name has at most 64 bytes");
  if (message.scene_json.size() > kMaxSceneJsonBytes) return refuse("a scene's JSON has at most 1 MiB");
  if (message.types.empty() || message.types.size() > kMaxTypes) return refuse("1 to 65,535 body types");
  if (message.streams.empty() || message.streams.size() > kMaxStreams) return refuse("1 to 8 streams");
  for (const BodyType& type : message.types) {
    if (auto good = check(type); !good) return good;
  }
  for (const StreamMessage& stream : message.streams) {
    if (auto good = check(stream); !good) return good;
  }
  if (message.features.size() > kMaxFeatures || message.data.size() > kMaxDataFields)
    return refuse("at most 16 features and 16 fields of data");
  const auto is_word = [](const auto& word) { return is_stream_name(word); };
  if (!std::all_of(message.features.begin(), message.features.end(), is_word) ||
      !std::all_of(message.data.begin(), message.data.end(),
                   [&](const DataField& field) { return is_word(field.name); }))
    return refuse("a feature or a field of data has 1 to 32 characters of a-z, 0-9, '_' and '-'");
  return check(message.names, message.capacity);
}

bool within_limits(const SessionMessage& message, const Limits& /*limits*/) {
  return check_announcement(message).has_value();
}

bool within_limits(const DeltaMessage& message, const Limits& limits) {
  return message.parts >= 1 && message.parts <= kMaxParts && message.part < message.parts &&
         message.payload.size() <= limits.max_delta_bytes && message.earlier <= kMaxEarlier &&
         (message.earlier == 0 || (message.earlier < message.frame && message.parts == 1));
}

bool within_limits(const ScheduledInputMessage& message, const Limits& /*limits*/) {
  return message.number >= 1 && message.values.size() <= kMaxScheduledValues;
}

bool within_limits(const SnapshotMessage& message, const Limits& limits) {
  return message.parts >= 1 && message.parts <= kMaxSnapshotParts && message.parts <= message.total_bytes &&
         message.part < message.parts && message.total_bytes <= limits.max_snapshot_bytes &&
         !message.bytes.empty() && message.bytes.size() <= message.total_bytes;
}

bool within_limits(const ReplyMessage& message, const Limits& /*limits*/) {
  return message.client != 0 && is_role(message.role) && is_phase(message.phase) &&
         message.entries.size() <= kReplyRing && message.texts.size() <= kMaxReplyTexts &&
         std::all_of(message.texts.begin(), message.texts.end(), [](const ReplyText& of) {
           return of.text.size() <= kMaxReplyTextBytes && is_plain_text(of.text);
         });
}

bool within_limits(const InputMessage& message, const Limits& /*limits*/) {
  return message.client != 0 && message.values.size() <= kMaxInputValues &&
         message.bytes.size() <= kMaxInputBytes;
}

bool within_limits(const AckMessage& message, const Limits& /*limits*/) {
  return message.client != 0 && is_role(message.role_wanted) && is_phase(message.phase) &&
         message.max_delay_ms <= kMaxDelayMs && message.missing.size() % 2 == 0 &&
         message.missing.size() <= 2 * kMaxMissingRuns;
}

bool within_limits(const ServerStatusMessage& message, const Limits& /*limits*/) {
  return check_session_name(message.session).has_value() && is_name(message.codec) &&
         is_name(message.predictor) && is_role(message.server_role);
}

bool within_limits(const ClientStatusMessage& message, const Limits& /*limits*/) {
  return message.client != 0 && check_session_name(message.session).has_value() &&
         message.stream_reason.size() <= kMaxReasonBytes && is_plain_text(message.stream_reason);
}

bool within_limits(const JournalMessage& message, const Limits& /*limits*/) {
  return message.number >= 1 && message.state <= JournalState::kLast &&
         message.news.size() <= kMaxNewsBytes && message.decisions.size() <= kMaxDecisions &&
         std::all_of(message.decisions.begin(), message.decisions.end(), [](const InputDecision& decision) {
           return decision.participant.size() == sizeof(ParticipantId::bytes) &&
                  decision.values.size() <= kMaxInputValues && decision.bytes.size() <= kMaxInputBytes;
         });
}

bool within_limits(const CheckpointMessage& message, const Limits& /*limits*/) {
  return message.parts >= 1 && message.parts <= kMaxCheckpointParts && message.parts <= message.total_bytes &&
         message.part < message.parts && message.total_bytes <= kMaxCheckpointBytes &&
         !message.bytes.empty() && message.bytes.size() <= kMaxCheckpointPartBytes;
}

bool within_limits(const StandbyMessage& message, const Limits& /*limits*/) {
  return message.standby != 0 && message.rank >= 1 && message.missing.size() <= 2 * kMaxMissingRuns;
}

bool within_limits(const CommandMessage& message, const Limits& /*limits*/) {
  return message.kind == CommandKind::kHandOver && is_name(message.session);
}

std::uint32_t delta_depth(double frame_rate_hz, std::uint32_t window_ceiling, std::size_t largest_delta_bytes,
                          std::uint64_t memory_bytes) {
  constexpr double kMaxFrames = 1U << 20U;
  const std::uint64_t window = std::clamp<std::uint64_t>(window_ceiling, 1, kMaxWindowCeiling);
  const std::uint64_t parts =
      std::clamp<std::uint64_t>((largest_delta_bytes + kPartBytes - 1) / kPartBytes, 1, kMaxParts);
  const auto frames =
      static_cast<std::uint64_t>(std::clamp(frame_rate_hz * kHistorySeconds, 1.0, kMaxFrames));
  const std::uint64_t wanted = std::max<std::uint64_t>(64, std::max(frames, 2 * window) * parts);
  TANDEM_ASSERT(largest_delta_bytes <= kMaxDeltaBytes);
  const std::uint64_t affordable = memory_bytes / std::clamp<std::size_t>(largest_delta_bytes, 1, kPartBytes);
  return static_cast<std::uint32_t>(
      std::clamp(wanted, (window + 1) * parts, std::max(affordable, (window + 1) * parts)));
}

}  // namespace tandem::transport
