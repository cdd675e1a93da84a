#pragma once
// The clocks of a simulated machine.

#include <cstdint>

namespace tandem::world {

inline constexpr std::int64_t kMs = 1'000'000, kSecond = 1'000'000'000;

/// A steady clock that runs too fast or too slow, and a wall clock that somebody may set. `now_ns` is always
/// the time of the world.
class Clock {
 public:
  [[nodiscard]] std::int64_t steady_ns(std::int64_t now_ns) const {
    const std::int64_t since_ns = now_ns - set_at_ns_;
    return steady_then_ns_ + since_ns + since_ns / kMillion * drift_ppm_;
  }
  [[nodiscard]] std::int64_t wall_ns(std::int64_t now_ns) const { return steady_ns(now_ns) + wall_ahead_ns_; }
  /// The time of the world at which the steady clock shows `steady_ns`, or a little later.
  [[nodiscard]] std::int64_t world_ns(std::int64_t steady_ns) const {
    if (steady_ns >= INT64_MAX / 2) return INT64_MAX;
    const std::int64_t since_ns = steady_ns - steady_then_ns_;
    return set_at_ns_ + since_ns - since_ns / (kMillion + drift_ppm_) * drift_ppm_;
  }
  void set_drift(std::int64_t now_ns, std::int64_t ppm) {
    steady_then_ns_ = steady_ns(now_ns);
    set_at_ns_ = now_ns;
    drift_ppm_ = ppm;
  }
  void jump(std::int64_t by_ns) { wall_ahead_ns_ += by_ns; }

  /// What a `std::int64_t (*clock_ns)()` of the product reads while an actor is at work.
  [[nodiscard]] static std::int64_t shown() { return shown_ns_; }
  [[nodiscard]] static std::int64_t shown_wall() { return shown_wall_ns_; }
  void show(std::int64_t now_ns) const {
    shown_ns_ = steady_ns(now_ns);
    shown_wall_ns_ = wall_ns(now_ns);
  }

 private:
  static constexpr std::int64_t kMillion = 1'000'000;
  inline static std::int64_t shown_ns_ = 0, shown_wall_ns_ = 0;
  std::int64_t set_at_ns_ = 0, steady_then_ns_ = kSecond;
  std::int64_t drift_ppm_ = 0;
  std::int64_t wall_ahead_ns_ = 1'700'000'000 * kSecond;
};

}  // namespace tandem::world
