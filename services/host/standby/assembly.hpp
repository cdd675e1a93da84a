#pragma once
// A checkpoint that arrives in parts.

#include <cstdint>
#include <optional>
#include <vector>

#include "sdk/wire/standby_messages.hpp"

namespace tandem::standby {

/// Puts the parts of one checkpoint together. Untrusted; holds at most what the parts that arrived take, and
/// transport::kMaxCheckpointBytes. Not thread-safe.
class Assembly {
 public:
  struct Whole {
    Frame frame = 0;
    std::uint64_t journal = 0;
    transport::Bytes bytes;
  };

  /// Takes a part; a newer frame begins anew. Returns the checkpoint when its last part has arrived.
  std::optional<Whole> add(transport::CheckpointMessage&& part);
  void clear();

  [[nodiscard]] Frame frame() const { return frame_; }  ///< 0: nothing is on its way
  [[nodiscard]] std::uint32_t parts() const { return static_cast<std::uint32_t>(parts_.size()); }
  /// Runs of parts that are missing, as in TandemAck.
  [[nodiscard]] std::vector<std::uint32_t> missing() const;

 private:
  Frame frame_ = 0;
  std::uint64_t journal_ = 0;
  std::uint32_t total_bytes_ = 0;
  std::size_t held_ = 0, held_bytes_ = 0;
  std::vector<transport::Bytes> parts_;  // empty: not here yet
};

}  // namespace tandem::standby
