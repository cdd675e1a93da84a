#pragma once
// The limits on what one client may ask of its server, and how long the server waits for it. The server is a
// host (over DDS) or a gateway (over a WebSocket). idl/STATES.md says what happens to clients that exceed
// them.

#include <cstdint>

#include "sdk/wire/units.hpp"
#include "services/program/token_bucket.hpp"

namespace tandem::accounts {

/// A client's inputs per second on average, and its maximum burst: one with every picture that its user sees,
/// and those of a second together after a pause of the link.
inline constexpr TokenBucket kInputs{60, 60};

/// A client's snapshots beyond the first. A client that always asks again must not cause snapshots without
/// end, but one with several mishaps in a row need not wait.
inline constexpr TokenBucket kSnapshotsAgain{0.5, 4};

/// Minimum time between two snapshots; clients that come meanwhile share the next one.
inline constexpr std::int64_t kSnapshotSpacingNs = 250 * kMillisecond;

/// The limits of snapshots on their way, which differ for hosts and gateways.
struct TransferLimits {
  std::int64_t collect_ns;  ///< time to collect joiners of a snapshot after the first one
  std::int64_t stalled_ns;  ///< after this time without an arrival the transfer is given up
  std::int64_t longest_ns;  ///< a transfer that takes longer is given up in any case
};

/// Every joiner waits while joiners are collected: joining takes 0.11 s on loopback, 0.22 s if this is 100 ms
/// (RESEARCH.md). A stalled transfer is given up soon, because it holds memory that the next joiner lacks,
/// and its receiver may ask again.
inline constexpr TransferLimits kHostTransfers{
    .collect_ns = 10 * kMillisecond, .stalled_ns = 3 * kSecond, .longest_ns = 60 * kSecond};

/// All viewers of a snapshot share its bytes, so it is worth waiting for more of them, and a slow one costs
/// little. TCP repairs a bad link, so a transfer that moves at all is served for half an hour.
inline constexpr TransferLimits kGatewayTransfers{
    .collect_ns = 100 * kMillisecond, .stalled_ns = 30 * kSecond, .longest_ns = 1800 * kSecond};

}  // namespace tandem::accounts
