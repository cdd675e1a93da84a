#pragma once
// Assembles a snapshot from its parts.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "sdk/wire/parcels.hpp"

namespace tandem::client {

/// Joins the parts of the newest snapshot. Parts may come in any order and repeatedly. Holds one snapshot,
/// and no more bytes than the snapshot declares. Not thread-safe.
class SnapshotAssembly {
 public:
  using Outcome = transport::ParcelOutcome;  ///< kRefused: everything is dropped

  /// `most_bytes`: maximum size of a snapshot that the stream declares.
  explicit SnapshotAssembly(std::size_t most_bytes) {
    limits_.max_snapshot_bytes = static_cast<std::uint32_t>(std::min<std::size_t>(most_bytes, UINT32_MAX));
  }

  /// Takes one sample of the session's epoch and stream. A newer frame replaces an older one; the frame
  /// rejected last is ignored. Untrusted.
  Outcome add(transport::SnapshotMessage&& part);
  /// Returns the whole snapshot, as part 0 of 1, when all parts are there. Afterwards the parts still count
  /// as held.
  [[nodiscard]] std::optional<transport::SnapshotMessage> take() { return parcels_.take(); }
  void clear();
  /// Drops the snapshot, which cannot be used; later parts of its frame are ignored.
  void reject();

  /// The progress of the snapshot that is coming in, for the acknowledgement.
  [[nodiscard]] Frame frame() const { return parcels_.frame(); }
  [[nodiscard]] std::uint32_t parts() const { return parcels_.parts(); }
  [[nodiscard]] std::vector<std::uint32_t> missing() const { return parcels_.missing(); }

 private:
  transport::Limits limits_;
  transport::Parcels<transport::SnapshotMessage> parcels_;
  std::optional<Frame> rejected_;
};

}  // namespace tandem::client
