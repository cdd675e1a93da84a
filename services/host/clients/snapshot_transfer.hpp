#pragma once
// Sends snapshots to joining clients.

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "sdk/wire/messages.hpp"
#include "services/host/accounts/passage.hpp"
#include "services/host/clients/roster.hpp"
#include "services/host/outgoing/outbox.hpp"

namespace tandem::host {

/// One snapshot, shared by all its receivers.
struct Snapshot {
  transport::SnapshotMessage head;  ///< epoch, stream and frame
  std::vector<std::byte> bytes;

  [[nodiscard]] transport::SnapshotMessage cut(std::size_t part) const;
};

/// Sends the snapshots of one stream, to each receiver at its own pace. Parts go out through a writer that
/// each client has of its own, so a slow or silent receiver costs the others nothing. Not thread-safe.
class SnapshotTransfer {
 public:
  static constexpr std::size_t kPartBytes = 1'300;
  /// Maximum size of all snapshots held together; there is always room for two of any size.
  static constexpr std::size_t kMaxHeldBytes = std::size_t{128} << 20U;

  explicit SnapshotTransfer(Outbox& outbox) : outbox_(&outbox) {}

  /// Starts sending a new snapshot to `receivers`; it replaces the one that a receiver was sent before.
  /// `bytes` is not empty.
  void start(Epoch epoch, StreamId stream, Frame frame, std::span<const std::byte> bytes,
             std::span<const transport::ClientId> receivers, std::int64_t now_ns);
  /// The stream ends: its snapshots are useless now.
  void end() {
    receivers_.clear();
    latest_.reset();
  }
  /// Notes what a joining client holds. Untrusted.
  void acknowledged(const transport::AckMessage& ack, std::int64_t now_ns);
  /// Forgets receivers that no longer join the stream. Queues the parts that their windows and the outbox
  /// have room for. `deltas_bytes_per_s`: what one client of the stream takes for deltas on the network, for
  /// receivers with a cap.
  void send(const std::map<transport::ClientId, Account>& accounts, double deltas_bytes_per_s,
            std::int64_t now_ns);

  /// True if the client is being sent a snapshot and has lately acknowledged it: it needs no other.
  [[nodiscard]] bool serves(transport::ClientId client, std::int64_t now_ns) const;
  /// True if there is no memory for another snapshot.
  [[nodiscard]] bool full(std::int64_t now_ns) const;
  /// When send() may have something to do that it does not have now.
  [[nodiscard]] std::int64_t next_ns() const { return next_ns_; }
  [[nodiscard]] bool idle() const { return receivers_.empty(); }
  /// Bytes queued since the start, repetitions too.
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  struct Receiver {
    std::shared_ptr<const Snapshot> snapshot;
    accounts::Passage passage;
  };
  [[nodiscard]] static bool names(const Receiver& receiver, const transport::AckMessage& ack);
  /// True if the passage may be dropped when another needs its memory: nothing arrived, or it has taken too
  /// long.
  [[nodiscard]] static bool stalled(const accounts::Passage& passage, std::int64_t now_ns);
  /// Count and bytes of the snapshots held; `all`: also of those whose receivers are stalled.
  [[nodiscard]] std::pair<std::size_t, std::size_t> held_count_and_bytes(bool all, std::int64_t now_ns) const;
  /// True if the client's turn is over; false if the outbox is full.
  [[nodiscard]] bool serve(transport::ClientId client, Receiver& receiver, std::int64_t now_ns);

  Outbox* outbox_;
  std::map<transport::ClientId, Receiver> receivers_;
  std::shared_ptr<const Snapshot> latest_;  // kept for clients that ask again while its frame is still the
                                            // current one
  transport::ClientId last_served_ = 0;
  std::size_t largest_ = 0;  // bytes of the largest snapshot so far
  std::int64_t next_ns_ = INT64_MAX;
  std::uint64_t bytes_ = 0;
};

}  // namespace tandem::host
