#pragma once
// A snapshot on its way to those who join.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sdk/transport/messages.hpp"
#include "services/host/outbox.hpp"

namespace tandem::host {

/// Cuts a snapshot into parts, queues each once, and again what an acknowledgement says is missing. Holds one
/// snapshot at a time: the next one takes its place, also if somebody still lacks parts. Not thread-safe.
class SnapshotParts {
 public:
  /// The writer keeps as many samples for repairs; so no more are sent in kAgainNs.
  static constexpr std::size_t kMostAtOnce = 64;
  static constexpr std::int64_t kAgainNs = 250'000'000;  ///< between two times that one part is sent

  explicit SnapshotParts(Outbox& outbox) : outbox_(&outbox) {}

  /// A new snapshot; all of its parts are due. `bytes` is not empty.
  void start(Epoch epoch, StreamId stream, Frame frame, std::span<const std::byte> bytes);
  /// What a joiner says it lacks is due again. Runs that make no sense count for what they cover.
  void missing(const transport::AckMessage& ack);
  /// Queues what is due, as far as the outbox has room.
  void send(std::int64_t now_ns);
  /// Nobody joins any more.
  void forget();

  /// Bytes queued since the start.
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  struct Part {
    bool due = false;
    std::optional<std::int64_t> sent_ns;
    [[nodiscard]] bool sent_lately(std::int64_t now_ns) const {
      return sent_ns && now_ns - *sent_ns < kAgainNs;
    }
  };

  Outbox* outbox_;
  transport::SnapshotMessage head_;  // what all parts have in common
  std::vector<std::byte> snapshot_;
  std::vector<Part> parts_;
  std::uint64_t bytes_ = 0;
};

}  // namespace tandem::host
