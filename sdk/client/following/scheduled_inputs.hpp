#pragma once
// Scheduled inputs of one epoch, kept for as long as a snapshot may still need them.

#include <cstddef>
#include <cstdint>
#include <map>

#include "sdk/core/timeline/timeline.hpp"
#include "sdk/transport/messages.hpp"
#include "tandem/result.hpp"

namespace tandem::client {

/// Reads a scheduled input. Untrusted. Errors: kUnsupported (kind), kMalformed (count or range of the
/// integers).
[[nodiscard]] Result<ScheduledDrive> read_scheduled(const transport::ScheduledInputMessage& message);

/// The inputs received in this epoch, by number. A sample is delivered once, but a rejoin starts from a
/// snapshot that may be older than inputs already received; so they stay here, the highest numbers first. Not
/// thread-safe.
class ScheduledInputs {
 public:
  /// As many as the server's writer keeps for a client whose link is lost for a while.
  static constexpr std::size_t kKept = 4096;

  void add(const ScheduledDrive& input) {
    held_.emplace(input.number, input);
    if (held_.size() > kKept) held_.erase(held_.begin());
  }
  /// Schedules those up to number `last`, and no others: a client that is behind holds more than may wait to
  /// act at any one frame, and nothing that it simulates needs them before a delta counts them. Errors: those
  /// of ClientTimeline::schedule().
  [[nodiscard]] Result<void> hand_over(ClientTimeline& timeline, std::uint64_t last) const;

 private:
  std::map<std::uint64_t, ScheduledDrive> held_;
};

}  // namespace tandem::client
