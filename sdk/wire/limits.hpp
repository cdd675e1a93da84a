#pragma once
// The sizes and shapes that a received sample must have. Every transport checks them before it passes a
// sample on.

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "sdk/wire/messages.hpp"
#include "sdk/wire/standby_messages.hpp"
#include "tandem/result.hpp"

namespace tandem::transport {

/// Maximum size of a DDS sample, whatever a session declares; transports refuse larger ones on the wire where
/// they can. A larger delta or snapshot travels in parts.
inline constexpr std::uint32_t kMaxSampleBytes = 64U << 20U;
inline constexpr std::uint32_t kMaxDeltaBytes = 1U << 27U;     ///< maximum that a stream may declare
inline constexpr std::uint32_t kMaxSnapshotBytes = 1U << 28U;  ///< maximum that a stream may declare
inline constexpr std::uint32_t kMaxWindowCeiling = 1024;
inline constexpr std::uint32_t kMaxParts = 4096;    ///< maximum parts of one delta
inline constexpr std::uint32_t kMaxEarlier = 1024;  ///< maximum frames that a delta tells beside its own
inline constexpr std::uint32_t kMaxDelayMs = 1000;  ///< maximum time for which a server collects frames
inline constexpr std::uint32_t kDelayStepMs = 50;   ///< a gateway rounds down to a multiple of this
inline constexpr std::uint32_t kLeastCapKbitS = 16, kMaxCapKbitS = 10'000'000;
inline constexpr std::uint32_t kMaxSnapshotParts = 1U << 18U;  ///< maximum parts of one snapshot
inline constexpr std::size_t kMaxNameBytes = 64;  ///< session, codec, predictor, scene and type names
inline constexpr std::size_t kMaxTypes = 65535;   ///< body types of a session
inline constexpr std::size_t kMaxBodyNames = 65535;
inline constexpr std::size_t kMaxStreamNameBytes = 32;
inline constexpr std::size_t kMaxReasonBytes = 64;  ///< why a client plays its stream
inline constexpr std::size_t kMaxReplyTexts = 8, kMaxReplyTextBytes = 200;
inline constexpr std::size_t kMaxHullValues = 768;
inline constexpr std::size_t kMaxStreams = 8, kMaxGroups = 8;
inline constexpr std::uint32_t kMaxStreamNumber = 65535;  ///< of a stream's id, and of its generation
inline constexpr std::size_t kMaxFeatures = 16;
inline constexpr std::size_t kMaxPredictorConstants = 1U << 20U;
inline constexpr std::size_t kMaxSceneJsonBytes = 1U << 20U;
inline constexpr std::size_t kMaxTableBytes = 4U << 20U;  ///< codec tables
inline constexpr std::size_t kMaxScheduledValues = 64;
inline constexpr std::size_t kMaxInputValues = 16;
inline constexpr std::size_t kMaxInputBytes = 1024;
inline constexpr std::size_t kMaxMissingRuns = 32;  ///< in an acknowledgement

inline constexpr std::uint32_t kMaxCheckpointBytes = 1U << 30U;
inline constexpr std::uint32_t kMaxCheckpointParts = 1U << 18U;
inline constexpr std::size_t kMaxCheckpointPartBytes = 64U << 10U;
inline constexpr std::size_t kMaxDecisions = 256;  ///< in a journal entry
/// Maximum size of one decision in its byte form.
inline constexpr std::size_t kMaxDecisionBytes = 128 + 8 * kMaxInputValues + kMaxInputBytes;

/// The limits that the stream declares; until a stream is known, the fixed maximum.
struct Limits {
  std::uint32_t max_delta_bytes = kMaxDeltaBytes;
  std::uint32_t max_snapshot_bytes = kMaxSnapshotBytes;
};

/// True for a cap that a stream or a client may have; kbit/s. 0 is none, and so no cap.
[[nodiscard]] constexpr bool is_cap(std::uint64_t kbit_s) {
  return kbit_s >= kLeastCapKbitS && kbit_s <= kMaxCapKbitS;
}

/// True for a name that a stream may have: 1 to 32 characters of [a-z0-9_-].
[[nodiscard]] bool is_stream_name(std::string_view name);

/// True if lengths, counts and enumerations are in range. Does not check epochs, numbers or values: a message
/// with wrong ones is answered, not dropped.
[[nodiscard]] bool within_limits(const SessionMessage& message, const Limits& limits);
[[nodiscard]] bool within_limits(const DeltaMessage& message, const Limits& limits);
[[nodiscard]] bool within_limits(const ScheduledInputMessage& message, const Limits& limits);
[[nodiscard]] bool within_limits(const SnapshotMessage& message, const Limits& limits);
[[nodiscard]] bool within_limits(const ReplyMessage& message, const Limits& limits);
[[nodiscard]] bool within_limits(const InputMessage& message, const Limits& limits);
[[nodiscard]] bool within_limits(const AckMessage& message, const Limits& limits);
[[nodiscard]] bool within_limits(const ServerStatusMessage& message, const Limits& limits);
[[nodiscard]] bool within_limits(const ClientStatusMessage& message, const Limits& limits);
[[nodiscard]] bool within_limits(const JournalMessage& message, const Limits& limits);
[[nodiscard]] bool within_limits(const CheckpointMessage& message, const Limits& limits);
[[nodiscard]] bool within_limits(const StandbyMessage& message, const Limits& limits);
[[nodiscard]] bool within_limits(const CommandMessage& message, const Limits& limits);

/// Does the same check for an announcement and says what breaks which limit. A server calls it before it
/// announces, because receivers only count refused messages. Errors: kInvalidArgument.
[[nodiscard]] Result<void> check_announcement(const SessionMessage& message);

/// Maximum frames that a delta of a stream tells beside its own: a client steps them all at once.
[[nodiscard]] constexpr std::uint32_t max_earlier(std::uint32_t capacity) {
  constexpr std::uint32_t kBodySteps = 1U << 22U;
  return std::clamp<std::uint32_t>(kBodySteps / std::max(capacity, 1U), 1, kMaxEarlier);
}

/// A participant acknowledges after this number of frames or after kAckSpacingNs, whichever comes first.
[[nodiscard]] constexpr std::uint32_t ack_spacing(std::uint32_t window_ceiling) {
  return window_ceiling < 8 ? 1 : window_ceiling / 4;
}
inline constexpr std::int64_t kAckSpacingNs = 200'000'000;

/// Maximum size of the parts into which payloads and snapshots are cut; a reader takes parts of any size.
inline constexpr std::size_t kPartBytes = 60'000;
/// Time for which a link may be lost without a snapshot being needed. The lease of participants is longer.
inline constexpr double kHistorySeconds = 30;

/// Number of TandemDelta samples that writer and reader keep: kHistorySeconds of frames, at least two windows
/// and 64, each counted with the number of parts of the largest delta. The samples take at most
/// `memory_bytes`, but there are always enough for one window; otherwise a suspended server could overwrite
/// what a participant still needs.
[[nodiscard]] std::uint32_t delta_depth(double frame_rate_hz, std::uint32_t window_ceiling,
                                        std::size_t largest_delta_bytes,
                                        std::uint64_t memory_bytes = 256ULL << 20U);

}  // namespace tandem::transport
