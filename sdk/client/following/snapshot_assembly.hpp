#pragma once
// Assembles a snapshot from its parts.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "sdk/wire/messages.hpp"

namespace tandem::client {

/// Joins the parts of the newest snapshot. Parts may come in any order and repeatedly. Holds one snapshot,
/// and no more bytes than the snapshot declares. Not thread-safe.
class SnapshotAssembly {
 public:
  enum class Outcome : std::uint8_t {
    kStored,
    kIgnored,  ///< the part is of an older snapshot, is held already, or conflicts with the parts held
    kRefused,  ///< the part breaks a rule of the format; everything is dropped
  };

  /// `most_bytes`: maximum size of a snapshot that the stream declares.
  explicit SnapshotAssembly(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  /// Takes one sample of the session's epoch and stream. A newer frame replaces an older one; the frame
  /// rejected last is ignored. Untrusted.
  Outcome add(transport::SnapshotMessage&& part);
  /// Returns the whole snapshot, as part 0 of 1, when all parts are there. Afterwards the parts still count
  /// as held.
  [[nodiscard]] std::optional<transport::SnapshotMessage> take();
  void clear();
  /// Drops the snapshot, which cannot be used; later parts of its frame are ignored.
  void reject();

  /// The progress of the snapshot that is coming in, for the acknowledgement.
  [[nodiscard]] Frame frame() const { return head_.frame; }
  [[nodiscard]] std::uint32_t parts() const { return static_cast<std::uint32_t>(held_.size()); }
  /// Pairs of first part and count, ascending; at most kMaxMissingRuns of them.
  [[nodiscard]] std::vector<std::uint32_t> missing() const;

 private:
  std::size_t most_bytes_;
  transport::SnapshotMessage head_;  // the fields that all parts share
  std::vector<transport::Bytes> bytes_;
  std::vector<bool> held_;  // empty: no part has come
  std::size_t held_bytes_ = 0;
  std::size_t held_parts_ = 0;
  bool taken_ = false;
  std::optional<Frame> rejected_;
};

}  // namespace tandem::client
