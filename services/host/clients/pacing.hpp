#pragma once
// Decides when the next frame is due.

#include <cstdint>
#include <string>

namespace tandem::host {

/// Keeps absolute deadlines one period apart, so that errors do not add up. After a suspension the lost time
/// is not caught up. After a slow step it is, if the step cost less than four periods.
class Pacing {
 public:
  /// `free_rate`: a frame is always due. The nominal period still decides when waiting becomes a suspension.
  Pacing(double frame_rate_hz, bool free_rate);

  void start(std::int64_t now_ns);
  [[nodiscard]] bool due(std::int64_t now_ns) const { return now_ns >= deadline_ns_; }
  [[nodiscard]] std::int64_t deadline_ns() const { return deadline_ns_; }
  /// From this time on waiting is a suspension: one nominal period after the last frame.
  [[nodiscard]] std::int64_t suspended_from_ns() const { return suspended_from_ns_; }
  /// A frame starts now; `suspended`: it starts after a suspension.
  void frame_started(std::int64_t now_ns, bool suspended);
  /// The nominal period; at a free rate the measured one.
  [[nodiscard]] std::int64_t period_ns() const { return free_rate_ ? measured_ns_ : nominal_ns_; }

 private:
  bool free_rate_;
  std::int64_t nominal_ns_;
  std::int64_t measured_ns_;
  std::int64_t last_ns_ = 0;
  std::int64_t deadline_ns_ = 0;
  std::int64_t suspended_from_ns_ = 0;
};

/// Tells when frames begin to take longer than their period, checked every second, and when that is over.
class Overrun {
 public:
  static constexpr std::int64_t kTellNs = 10'000'000'000;  ///< minimum time between two such lines

  explicit Overrun(double frame_rate_hz) : rate_hz_(frame_rate_hz) {}
  /// Call after each frame with the duration of the simulation's step and of the whole frame. Returns a line
  /// for a log; usually it is empty.
  [[nodiscard]] std::string frame_took(std::int64_t step_ns, std::int64_t frame_ns, std::int64_t now_ns);

 private:
  double rate_hz_;
  double step_ns_ = 0, frame_ns_ = 0, frames_ = 0;  // sums over the current second
  std::int64_t since_ns_ = INT64_MIN, told_ns_ = INT64_MIN / 2;
  bool told_ = false;  // it was told, but not yet that it is over
};

}  // namespace tandem::host
