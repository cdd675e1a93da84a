#pragma once
// Which frames share a message towards viewers that let them wait.

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>

#include "sdk/wire/limits.hpp"
#include "sdk/wire/units.hpp"
#include "services/gateway/viewing/live_log.hpp"

namespace tandem::gateway {

/// Delays are multiples of kDelayStepMs, and all viewers of a delay are sent the same messages: what leaves
/// when is decided, and encoded, once for each delay. Nothing is held for a viewer, as its frames wait in the
/// log. Not thread-safe.
class Grouping {
 public:
  /// A delay in steps of kDelayStepMs.
  using Steps = std::uint32_t;
  static constexpr Steps kMaxSteps = transport::kMaxDelayMs / transport::kDelayStepMs;
  /// A message of several frames has no larger payload, so that it travels in one packet.
  static constexpr std::size_t kMaxBytes = 1300;
  /// Neither scheduled inputs nor events end the waiting more often.
  static constexpr std::int64_t kInputSpacingNs = 100 * kMillisecond;

  [[nodiscard]] static constexpr std::int64_t delay_ns(Steps steps) {
    return std::int64_t{steps} * transport::kDelayStepMs * kMillisecond;
  }

  /// Begins anew at the end of `log`, for a stream of `capacity` slots.
  void start(const LiveLog& log, std::uint32_t capacity, double frame_rate_hz);
  /// Takes what was just added to `log`.
  void added(const LiveLog& log, std::int64_t now_ns);
  /// Lets go what has waited for long enough, if no frame came.
  void release(const LiveLog& log, std::int64_t now_ns);

  /// What is in front of this place may leave. `steps` is from 1 to kMaxSteps.
  [[nodiscard]] LiveLog::Place released(Steps steps) const { return of(steps).released; }
  /// When release() has something to do; INT64_MAX: when something is added.
  [[nodiscard]] std::int64_t due_ns(Steps steps) const {
    const auto& since_ns = of(steps).since_ns;
    return since_ns ? *since_ns + delay_ns(steps) : std::numeric_limits<std::int64_t>::max();
  }
  /// The message at `place`, with as many of those behind it, up to `until`, as share one. Moves `place`
  /// behind them.
  [[nodiscard]] OutgoingPtr take(const LiveLog& log, LiveLog::Place& place, LiveLog::Place until,
                                 Steps steps);

 private:
  struct Collected {
    LiveLog::Place released = 0;
    std::optional<std::int64_t> since_ns;  // since when the first one waits
    std::size_t bytes = 0;                 // that a delta of all that waits takes at most
    // The last message that was made.
    LiveLog::Place begin = 0, end = 0;
    OutgoingPtr message;
  };
  [[nodiscard]] const Collected& of(Steps steps) const {
    TANDEM_ASSERT(steps >= 1 && steps <= kMaxSteps);
    return collected_[steps - 1];
  }
  static void let_go(Collected& collected, const LiveLog& log);

  std::array<Collected, kMaxSteps> collected_;
  std::uint32_t max_frames_ = 1;
  std::int64_t period_ns_ = 0;
  std::uint64_t last_input_ = 0;
  std::optional<std::int64_t> input_ns_;  // when one last ended the waiting
};

}  // namespace tandem::gateway
