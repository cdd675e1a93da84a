#pragma once
// Sends snapshots to joining clients.

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "sdk/transport/messages.hpp"
#include "sdk/transport/units.hpp"
#include "services/accounts/transfer_window.hpp"
#include "services/host/clients/roster.hpp"
#include "services/host/outgoing/outbox.hpp"

namespace tandem::host {

/// One snapshot, shared by all its receivers.
struct Snapshot {
  transport::SnapshotMessage head;  ///< the fields that all parts share
  std::vector<std::byte> bytes;

  [[nodiscard]] std::size_t size_of(std::size_t part) const;
  [[nodiscard]] transport::SnapshotMessage cut(std::size_t part) const;
};

/// Sends one snapshot to one receiver, at the pace of that receiver's link. Not thread-safe.
class Passage {
 public:
  Passage(std::shared_ptr<const Snapshot> snapshot, std::int64_t now_ns);

  /// Notes what the receiver holds. Returns false if the receiver cannot use this snapshot any more.
  /// Untrusted: parts that were never sent and runs that make no sense change nothing.
  [[nodiscard]] bool acknowledged(const transport::AckMessage& ack, std::int64_t now_ns);
  /// The part to send now, if one may be sent; it counts as sent.
  [[nodiscard]] std::optional<std::size_t> next(std::int64_t now_ns);
  /// When next() may have a part that it does not have now, if no acknowledgement comes.
  [[nodiscard]] std::int64_t next_ns() const;

  [[nodiscard]] const std::shared_ptr<const Snapshot>& snapshot() const { return snapshot_; }
  [[nodiscard]] std::int64_t began_ns() const { return began_ns_; }
  [[nodiscard]] std::int64_t heard_ns() const {
    return heard_ns_;
  }                                                                        ///< when the receiver last named
                                                                           ///< this snapshot
  [[nodiscard]] std::int64_t progress_ns() const { return progress_ns_; }  ///< when a part last arrived
  /// True if several times the snapshot's size was sent. The receiver's acknowledgements cannot be right
  /// then, and it is served no further.
  [[nodiscard]] bool exhausted() const;

 private:
  struct Flying {
    std::size_t part;
    accounts::TransferWindow::Sent sent;
  };

  [[nodiscard]] std::optional<std::size_t> wanted();
  [[nodiscard]] bool names(const transport::AckMessage& ack) const;
  /// Parts that the receiver held, and lacks by now, are sent again.
  void take_back(const transport::AckMessage& ack);
  void arrived(const std::vector<bool>& held, std::int64_t now_ns);
  std::size_t send(std::size_t part, std::int64_t now_ns);
  [[nodiscard]] std::int64_t probe_ns() const;

  std::shared_ptr<const Snapshot> snapshot_;
  std::vector<bool> holds_;        // by part: the receiver holds it
  std::size_t unsent_ = 0;         // the first part that was never sent
  std::deque<std::size_t> again_;  // parts that DDS lost, to be sent again
  std::deque<Flying> flying_;      // in the order of sending
  accounts::TransferWindow window_;
  std::int64_t began_ns_, heard_ns_, progress_ns_;
  std::int64_t probed_ns_;
  int probes_ = 0;  // probes since a part last arrived
  std::size_t sent_bytes_ = 0;
};

/// Sends the snapshots of one stream, to each receiver at its own pace. Parts go out through a writer that
/// each client has of its own, so a slow or silent receiver costs the others nothing. Not thread-safe.
class SnapshotTransfer {
 public:
  static constexpr std::size_t kPartBytes = 1'300;
  /// Maximum size of all snapshots held together; there is always room for two of any size.
  static constexpr std::size_t kMostHeldBytes = std::size_t{128} << 20U;

  explicit SnapshotTransfer(Outbox& outbox) : outbox_(&outbox) {}

  /// Starts sending a new snapshot to `receivers`; it replaces the one that a receiver was sent before.
  /// `bytes` is not empty.
  void start(Epoch epoch, StreamId stream, Frame frame, std::span<const std::byte> bytes,
             std::span<const transport::ClientId> receivers, std::int64_t now_ns);
  /// The stream ends: its snapshots are useless now.
  void end() {
    passages_.clear();
    latest_.reset();
  }
  /// Notes what a joining client holds. Untrusted.
  void acknowledged(const transport::AckMessage& ack, std::int64_t now_ns);
  /// Forgets receivers that no longer join the stream. Queues the parts that their windows and the outbox
  /// have room for.
  void send(const std::map<transport::ClientId, Account>& accounts, std::int64_t now_ns);

  /// True if the client is being sent a snapshot and has lately acknowledged it: it needs no other.
  [[nodiscard]] bool serves(transport::ClientId client, std::int64_t now_ns) const;
  /// True if there is no memory for another snapshot.
  [[nodiscard]] bool full(std::int64_t now_ns) const;
  /// When send() may have something to do that it does not have now.
  [[nodiscard]] std::int64_t next_ns() const { return next_ns_; }
  [[nodiscard]] bool idle() const { return passages_.empty(); }
  /// Bytes queued since the start, repetitions too.
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  /// True if the passage may be dropped when another needs its memory: nothing arrived, or it has taken too
  /// long.
  [[nodiscard]] static bool stalled(const Passage& passage, std::int64_t now_ns);
  /// Count and bytes of the snapshots held; `all`: also of those whose receivers are stalled.
  [[nodiscard]] std::pair<std::size_t, std::size_t> held_count_and_bytes(bool all, std::int64_t now_ns) const;
  /// True if the client's turn is over; false if the outbox is full.
  [[nodiscard]] bool serve(transport::ClientId client, Passage& passage, std::int64_t now_ns);

  Outbox* outbox_;
  std::map<transport::ClientId, Passage> passages_;
  std::shared_ptr<const Snapshot> latest_;  // kept for clients that ask again while its frame is still the
                                            // current one
  transport::ClientId last_served_ = 0;
  std::size_t largest_ = 0;  // bytes of the largest snapshot so far
  std::int64_t next_ns_ = INT64_MAX;
  std::uint64_t bytes_ = 0;
};

}  // namespace tandem::host
