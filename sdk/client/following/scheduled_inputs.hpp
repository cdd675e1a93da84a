#pragma once
// Keeps the scheduled inputs of one epoch for as long as a snapshot may still need them.

#include <cstddef>
#include <cstdint>
#include <map>

#include "sdk/core/timeline/timeline.hpp"
#include "sdk/wire/messages.hpp"
#include "tandem/result.hpp"

namespace tandem::client {

/// Reads a scheduled input. Untrusted. Errors: kUnsupported (kind), kMalformed (count or range of the
/// integers).
[[nodiscard]] Result<ScheduledDrive> read_scheduled(const transport::ScheduledInputMessage& message);

/// The inputs received in this epoch, by number. A sample is delivered once, but a rejoin starts from a
/// snapshot that may be older than inputs already received. Therefore they stay here, the highest numbers
/// first. Not thread-safe.
class ScheduledInputs {
 public:
  /// Maximum number of inputs kept; the server's writer keeps as many for a client whose link is lost for a
  /// while.
  static constexpr std::size_t kKept = 4096;

  void add(const ScheduledDrive& input) {
    held_.emplace(input.number, input);
    if (held_.size() > kKept) held_.erase(held_.begin());
  }
  /// Schedules the inputs up to number `last` only. A client that is behind holds more than may wait for any
  /// one frame, and nothing that it simulates needs the others before a delta counts them. Errors: those of
  /// ClientTimeline::schedule().
  [[nodiscard]] Result<void> hand_over(ClientTimeline& timeline, std::uint64_t last) const;

 private:
  std::map<std::uint64_t, ScheduledDrive> held_;
};

}  // namespace tandem::client
