#pragma once
// A file with the states of the streams that a relay or a gateway follows, from which it goes on when it was
// restarted.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sdk/wire/messages.hpp"
#include "services/follow/following/world.hpp"
#include "tandem/result.hpp"

namespace tandem::following {

/// Who follows over NATS writes it every kIntervalNs: that, and the time of a restart, has to be
/// less than the 30 s of frames that can be asked for. Not thread-safe. The file is a sequence of messages,
/// each of a size (u32, little-endian) and an envelope (idl/PROTOCOL.md, "WebSocket") of a whole
/// TandemSnapshot.
class KeptState {
 public:
  static constexpr std::int64_t kIntervalNs = 10'000'000'000;
  /// From the start to the first time, so that it is not the old state that was read at the start.
  static constexpr std::int64_t kFirstNs = 2'000'000'000;
  /// Larger states are not kept, as writing them would delay frames.
  static constexpr std::size_t kMaxBytes = 32U << 20U;
  using States = std::vector<transport::SnapshotMessage>;

  explicit KeptState(std::string path) : path_(std::move(path)) {}

  /// What the file has; nothing if it is not there or breaks a rule. Untrusted: a snapshot's hash is checked
  /// by who loads it.
  [[nodiscard]] States read() const;
  /// Replaces the file at once and whole. It is not forced onto the disk: it has to survive this process and
  /// not the machine. Errors: kIo, kCapacity (kMaxBytes).
  [[nodiscard]] Result<void> write(const States& states) const;

  /// The state that was cut, as it is kept.
  [[nodiscard]] static transport::SnapshotMessage state(FollowedWorld::Cut&& cut, Epoch epoch);
  /// That of a stream; empty if there is none.
  [[nodiscard]] static std::optional<transport::SnapshotMessage> find(const States& states, Epoch epoch,
                                                                      const StreamId& stream);

 private:
  std::string path_;
};

}  // namespace tandem::following
