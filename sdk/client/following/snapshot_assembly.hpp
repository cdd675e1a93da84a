#pragma once
// A snapshot from its parts.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "sdk/transport/messages.hpp"

namespace tandem::client {

/// Joins the parts of the newest snapshot, in whatever order and however often they come. Holds one snapshot
/// and no more bytes than it says it has. Not thread-safe.
class SnapshotAssembly {
 public:
  enum class Outcome : std::uint8_t {
    kStored,
    kIgnored,  ///< of an older snapshot, held already, or at odds with the parts held
    kRefused,  ///< breaks a rule of the format; all is dropped
  };

  /// `most_bytes`: the largest snapshot that the stream declares.
  explicit SnapshotAssembly(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  /// Takes one sample of the session's epoch and stream. A newer frame takes the place of an older one;
  /// the one rejected last is ignored. Untrusted.
  Outcome add(transport::SnapshotMessage&& part);
  /// The whole, as part 0 of 1, once all parts are there; afterwards they still count as held.
  [[nodiscard]] std::optional<transport::SnapshotMessage> take();
  void clear();
  /// The snapshot held cannot be used: drops it, and no part of it counts any more.
  void reject();

  /// What an acknowledgement tells: of the snapshot that is coming in.
  [[nodiscard]] Frame frame() const { return head_.frame; }
  [[nodiscard]] std::uint32_t parts() const { return static_cast<std::uint32_t>(held_.size()); }
  /// Runs of first part and count, ascending; the first kMaxMissingRuns of them.
  [[nodiscard]] std::vector<std::uint32_t> missing() const;

 private:
  std::size_t most_bytes_;
  transport::SnapshotMessage head_;  // what all parts have in common
  std::vector<transport::Bytes> bytes_;
  std::vector<bool> held_;  // empty: no part has come yet
  std::size_t held_bytes_ = 0;
  std::size_t held_parts_ = 0;
  bool taken_ = false;
  std::optional<Frame> rejected_;
};

}  // namespace tandem::client
