#pragma once
// Sizes and shapes that a received sample must have. Every transport applies them before it hands a sample
// on.

#include <cstddef>
#include <cstdint>

#include "sdk/transport/messages.hpp"
#include "tandem/result.hpp"

namespace tandem::transport {

/// No sample is larger, whatever a session declares; transports refuse it on the wire where they can.
inline constexpr std::uint32_t kMaxSampleBytes = 64U << 20U;
inline constexpr std::uint32_t kMaxWindowCeiling = 1024;
inline constexpr std::uint32_t kMaxParts = 4096;           ///< of one delta
inline constexpr std::uint32_t kMaxSnapshotParts = 65536;  ///< of one snapshot
inline constexpr std::size_t kMaxNameBytes = 64;  ///< session, codec, predictor, scene and type names
inline constexpr std::size_t kMaxTypes = 65535;   ///< body types of a session
inline constexpr std::size_t kMaxHullValues = 768;
inline constexpr std::size_t kMaxStreams = 8, kMaxGroups = 8;
inline constexpr std::size_t kMaxPredictorConstants = 1U << 20U;
inline constexpr std::size_t kMaxDescriptionBytes = 1U << 20U;
inline constexpr std::size_t kMaxTableBytes = 4U << 20U;  ///< codec tables
inline constexpr std::size_t kMaxScheduledValues = 64;
inline constexpr std::size_t kMaxInputValues = 16;
inline constexpr std::size_t kMaxInputBytes = 1024;
inline constexpr std::size_t kMaxMissingRuns = 32;  ///< in an acknowledgement

/// What the stream declares; until one is known, the fixed maximum.
struct Limits {
  std::uint32_t max_delta_bytes = kMaxSampleBytes;
  std::uint32_t max_snapshot_bytes = kMaxSampleBytes;
};

/// True when lengths, counts and enumerations are in range. Says nothing about epochs, numbers or values:
/// those are answered, not dropped.
[[nodiscard]] bool within_limits(const SessionMessage& message, const Limits& limits);
[[nodiscard]] bool within_limits(const DeltaMessage& message, const Limits& limits);
[[nodiscard]] bool within_limits(const ScheduledInputMessage& message, const Limits& limits);
[[nodiscard]] bool within_limits(const SnapshotMessage& message, const Limits& limits);
[[nodiscard]] bool within_limits(const ReplyMessage& message, const Limits& limits);
[[nodiscard]] bool within_limits(const InputMessage& message, const Limits& limits);
[[nodiscard]] bool within_limits(const AckMessage& message, const Limits& limits);
[[nodiscard]] bool within_limits(const ServerStatusMessage& message, const Limits& limits);
[[nodiscard]] bool within_limits(const ClientStatusMessage& message, const Limits& limits);

/// The same of an announcement, saying what breaks which limit: whoever announces it asks first, as those who
/// receive it only count. Errors: kInvalidArgument.
[[nodiscard]] Result<void> check_announcement(const SessionMessage& message);

/// A participant acknowledges at least as often as the smaller of these: frames, and time.
[[nodiscard]] constexpr std::uint32_t ack_spacing(std::uint32_t window_ceiling) {
  return window_ceiling < 8 ? 1 : window_ceiling / 4;
}
inline constexpr std::int64_t kAckSpacingNs = 200'000'000;

/// Payloads and snapshots are cut into parts of at most so many bytes; a reader takes parts of any size.
inline constexpr std::size_t kPartBytes = 60'000;
/// So long a link may be lost without a snapshot being needed. The lease of participants outlasts it.
inline constexpr double kHistorySeconds = 30;

/// Samples of TandemDelta that writer and reader keep: kHistorySeconds of frames, at least two windows and
/// 64, each of as many parts as the largest, but no more than `memory_bytes` of them (never below one window,
/// or a suspended server could overwrite what a participant still needs).
[[nodiscard]] std::uint32_t delta_depth(double frame_rate_hz, std::uint32_t window_ceiling,
                                        std::size_t largest_delta_bytes,
                                        std::uint64_t memory_bytes = 256ULL << 20U);

}  // namespace tandem::transport
