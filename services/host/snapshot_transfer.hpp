#pragma once
// A snapshot on its way to those who join.

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "sdk/transport/messages.hpp"
#include "services/accounts/transfer_window.hpp"
#include "services/host/outbox.hpp"
#include "services/host/roster.hpp"

namespace tandem::host {

/// Cuts a snapshot into parts and queues them at the pace of the slowest of its receivers, each until all of
/// them have it. What receivers lack they say in their acknowledgements. Holds one snapshot at a time. Not
/// thread-safe.
class SnapshotTransfer {
 public:
  /// Of a part, unless there would be more than kMostParts.
  static constexpr std::size_t kLeastPartBytes = 1'300;
  static constexpr std::size_t kMostParts = 1'024;
  /// The writer keeps 64 samples for repairs.
  static constexpr std::size_t kMostInFlight = 48;
  /// Others that want a snapshot do not wait for a receiver that got nothing for so long.
  static constexpr std::int64_t kStalledNs = 3 * kSecond;
  /// Nor for anybody when one snapshot has taken so long.
  static constexpr std::int64_t kLongestNs = 60 * kSecond;

  explicit SnapshotTransfer(Outbox& outbox) : outbox_(&outbox) {}

  /// A new snapshot for `receivers`, in the place of the one before. `bytes` is not empty.
  void start(Epoch epoch, StreamId stream, Frame frame, std::span<const std::byte> bytes,
             std::span<const transport::ClientId> receivers, std::int64_t now_ns);
  /// The snapshot is of no use any more.
  void end();
  /// What a client that joins holds by now. Untrusted; runs that make no sense count for what they cover.
  void acknowledged(const transport::AckMessage& ack, std::int64_t now_ns);
  /// Forgets receivers that do not join its stream any more, and queues what the window and the outbox have
  /// room for.
  void send(const std::map<transport::ClientId, Account>& accounts, std::int64_t now_ns);

  /// This client is being sent the snapshot and, lately, said so: it needs no other.
  [[nodiscard]] bool serves(transport::ClientId client, std::int64_t now_ns) const;
  /// Somebody is, and the parts arrive: another snapshot has to wait.
  [[nodiscard]] bool busy(std::int64_t now_ns) const;
  /// Bytes queued since the start, repetitions too.
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  struct Receiver {
    std::vector<bool> holds;       // by part
    std::int64_t heard_ns = 0;     // it named this snapshot
    std::int64_t progress_ns = 0;  // something arrived
  };
  struct Part {
    std::uint32_t lacking = 0;  // receivers
    std::optional<std::int64_t> sent_ns;
    bool again = false;  // sent more than once: its delay tells nothing
  };

  [[nodiscard]] std::size_t size_of(std::size_t part) const;
  void admit(transport::ClientId client, std::int64_t now_ns);
  void dismiss(transport::ClientId client);
  void received(std::size_t part, std::int64_t now_ns);
  // Sent, and neither late nor overtaken; whether it has arrived is another question.
  [[nodiscard]] bool on_its_way(const Part& part, std::int64_t now_ns) const;
  [[nodiscard]] std::size_t in_flight(std::int64_t now_ns, std::size_t& parts) const;
  [[nodiscard]] bool queue(std::size_t part, std::int64_t now_ns);

  Outbox* outbox_;
  transport::SnapshotMessage head_;  // what all parts have in common
  std::vector<std::byte> snapshot_;
  std::size_t part_bytes_ = kLeastPartBytes;
  std::vector<Part> parts_;
  std::map<transport::ClientId, Receiver> receivers_;
  accounts::TransferWindow window_;
  std::int64_t started_ns_ = 0;
  std::int64_t overtaken_ns_ = INT64_MIN;  // what was sent before this and has not arrived is lost
  std::uint64_t bytes_ = 0;
};

}  // namespace tandem::host
