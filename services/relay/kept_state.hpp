#pragma once
// A file with the states of a relay's streams, from which it goes on when it was restarted.

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "sdk/transport/messages.hpp"
#include "tandem/result.hpp"

namespace tandem::relay {

/// A relay that follows over NATS writes it every kIntervalNs: that, and the time of a restart, has to be
/// less than the 30 s of frames that can be asked for. Not thread-safe. The file is a sequence of messages,
/// each of a size (u32, little-endian) and an envelope (idl/PROTOCOL.md, "WebSocket") of a whole
/// TandemSnapshot.
class KeptState {
 public:
  static constexpr std::int64_t kIntervalNs = 10'000'000'000;
  /// Larger states are not kept, as writing them would delay frames.
  static constexpr std::size_t kMostBytes = 32U << 20U;

  explicit KeptState(std::string path) : path_(std::move(path)) {}

  /// What the file has; nothing if it is not there or breaks a rule. Untrusted: a snapshot's hash is checked
  /// by who loads it.
  [[nodiscard]] std::vector<transport::SnapshotMessage> read() const;
  /// Replaces the file at once and whole. It is not forced onto the disk: it has to survive this process and
  /// not the machine. Errors: kIo, kCapacity (kMostBytes).
  [[nodiscard]] Result<void> write(const std::vector<transport::SnapshotMessage>& snapshots) const;

 private:
  std::string path_;
};

}  // namespace tandem::relay
