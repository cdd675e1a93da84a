#pragma once
// The limits on what one client may ask of its server, and how long the server waits for it. The server is a
// host (over DDS) or a gateway (over a WebSocket). idl/STATES.md says what happens to clients that exceed
// them.

#include <cstdint>

#include "sdk/transport/units.hpp"
#include "services/accounts/token_bucket.hpp"

namespace tandem::accounts {

/// Inputs of one client, on average a second and at once: one with every picture that its user sees, and a
/// second's worth together after a pause of the link.
inline constexpr TokenBucket kInputs{60, 60};

/// Snapshots beyond the first: a client that always asks again would have one cut and sent without end; one
/// that meets with several mishaps in a row is not to wait.
inline constexpr TokenBucket kSnapshotsAgain{0.5, 4};

/// Between two snapshots at least, however many come: those who come meanwhile share the next.
inline constexpr std::int64_t kSnapshotSpacingNs = 250 * kMillisecond;

/// The limits of snapshots on their way. The two differ, because what they serve differs.
struct TransferLimits {
  std::int64_t collect_ns;  ///< joiners of one snapshot, from the first on
  std::int64_t stalled_ns;  ///< after this time without an arrival the transfer is given up
  std::int64_t longest_ns;  ///< and so is one that takes longer, whatever its receiver says
};

/// Every joiner waits for as long as is collected: 0.11 s to join on loopback, 0.22 s with 100 ms here
/// (RESEARCH.md). A transfer that does not get on holds memory that the next joiner lacks, and its receiver
/// may ask again: it is given up soon.
inline constexpr TransferLimits kHostTransfers{
    .collect_ns = 10 * kMillisecond, .stalled_ns = 3 * kSecond, .longest_ns = 60 * kSecond};

/// All viewers of a cut share its bytes, so that it is worth waiting for some more of them, and a slow one
/// costs little: what moves at all over a bad link, which TCP repairs, is served for half an hour.
inline constexpr TransferLimits kGatewayTransfers{
    .collect_ns = 100 * kMillisecond, .stalled_ns = 30 * kSecond, .longest_ns = 1800 * kSecond};

}  // namespace tandem::accounts
