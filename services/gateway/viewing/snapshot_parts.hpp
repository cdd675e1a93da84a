#pragma once
// A snapshot cut into parts, and one viewer's way through it.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "sdk/wire/messages.hpp"
#include "services/follow/following/world.hpp"
#include "services/gateway/viewing/outgoing.hpp"
#include "services/host/accounts/transfer_window.hpp"

namespace tandem::gateway {

/// A snapshot in parts, which all viewers that join together share.
struct SnapshotParts {
  /// Minimum size of a part; parts are larger if there would be more than kMaxParts.
  static constexpr std::size_t kLeastPartBytes = 1'300;
  static constexpr std::size_t kMaxParts = 1'024;

  /// `inputs`: scheduled inputs that came before the cut and are not in it.
  SnapshotParts(const following::FollowedWorld::Cut& cut, Epoch epoch, std::vector<OutgoingPtr> inputs);

  Frame frame = 0;
  std::size_t bytes = 0;  ///< of the whole
  std::size_t part_bytes = 0;
  std::vector<OutgoingPtr> inputs;  ///< go first
  std::vector<OutgoingPtr> parts;
};

/// Paces the parts for one viewer: no more is on its way than the window that follows the rate of its link.
/// A WebSocket keeps order and loses nothing, so what arrived is a number of parts. Not thread-safe.
class SnapshotPassage {
 public:
  /// A passage with nothing to send.
  SnapshotPassage() = default;
  SnapshotPassage(std::shared_ptr<const SnapshotParts> snapshot, std::int64_t now_ns)
      : snapshot_(std::move(snapshot)), began_ns_(now_ns), progress_ns_(now_ns) {}

  /// True if parts remain to be handed out.
  [[nodiscard]] bool unfinished() const { return snapshot_ != nullptr; }
  [[nodiscard]] std::int64_t began_ns() const { return began_ns_; }
  /// When a part arrived last, or it began.
  [[nodiscard]] std::int64_t progress_ns() const { return progress_ns_; }
  [[nodiscard]] bool has_next(std::int64_t now_ns) const;
  /// When has_next() may be true although nothing arrives; INT64_MAX: not before.
  [[nodiscard]] std::int64_t next_ns() const;
  /// Bytes of parts a second, under a viewer's cap whose deltas take so much; see
  /// accounts::limit_under_cap().
  void limit(std::uint32_t cap_kbit_s, double deltas_bytes_per_s);
  /// The next message, if has_next().
  [[nodiscard]] OutgoingPtr next(std::int64_t now_ns);
  /// Notes what a joining viewer says it holds. Untrusted.
  void acknowledged(const transport::AckMessage& ack, std::int64_t now_ns);

 private:
  std::shared_ptr<const SnapshotParts> snapshot_;  // null once all is handed out
  std::int64_t began_ns_ = 0;
  std::int64_t progress_ns_ = 0;
  std::size_t inputs_sent_ = 0;
  std::size_t arrived_ = 0;                           // parts
  std::vector<accounts::TransferWindow::Sent> sent_;  // by part
  accounts::TransferWindow window_;
};

}  // namespace tandem::gateway
