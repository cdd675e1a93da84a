#pragma once
// Decides how many frames the server may run ahead of its slowest participant.

#include <cstdint>

namespace tandem::host {

/// Estimates one client's time from queueing a delta to the first acknowledgement that covers it: a
/// smoothed mean and its deviation, as TCP does (Jacobson 1988).
class RoundTrip {
 public:
  void measured(std::int64_t duration_ns);
  /// The value to use before the first measurement.
  void expect(std::int64_t duration_ns);
  /// Smoothed + 4 deviations; 0 before the first measurement.
  [[nodiscard]] std::int64_t high_ns() const { return known_ ? smoothed_ + 4 * deviation_ : 0; }

 private:
  bool known_ = false;
  std::int64_t smoothed_ = 0;
  std::int64_t deviation_ = 0;
};

inline constexpr std::uint32_t kSmallestWindow = 2;  ///< the thesis's window; automatic windows start here

/// The number of frames that covers a round trip at one frame per `period_ns`, plus one; between
/// kSmallestWindow and `ceiling`.
[[nodiscard]] std::uint32_t window_for(std::int64_t round_trip_ns, std::int64_t period_ns,
                                       std::uint32_t ceiling);

}  // namespace tandem::host
