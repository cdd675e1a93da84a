#pragma once
// Seeded random numbers for fills and scripts: the same on every machine.

#include <array>
#include <cmath>
#include <cstdint>

namespace tandem::scenes {

/// splitmix64 (Steele, Lea, Flood 2014). Streams of different keys are independent for our purposes.
class Random {
 public:
  explicit Random(std::uint64_t seed, std::uint64_t key_a = 0, std::uint64_t key_b = 0)
      : state_(mix(mix(mix(seed) ^ key_a) ^ key_b)) {}

  std::uint64_t bits() {
    state_ += kStep;
    return mix(state_);
  }
  /// Uniform in [0, 1).
  double unit() { return static_cast<double>(bits() >> 11U) * 0x1p-53; }
  /// Uniform in [-1, 1).
  double both_sides() { return 2 * unit() - 1; }
  /// Uniform in the unit ball, by rejection.
  std::array<double, 3> in_ball() {
    for (;;) {
      const std::array<double, 3> p{both_sides(), both_sides(), both_sides()};
      if (p[0] * p[0] + p[1] * p[1] + p[2] * p[2] <= 1) return p;
    }
  }

 private:
  static constexpr std::uint64_t kStep = 0x9E3779B97F4A7C15U;
  static std::uint64_t mix(std::uint64_t x) {
    x += kStep;
    x = (x ^ (x >> 30U)) * 0xBF58476D1CE4E5B9U;
    x = (x ^ (x >> 27U)) * 0x94D049BB133111EBU;
    return x ^ (x >> 31U);
  }
  std::uint64_t state_;
};

/// Unit vector along `v`, or `fallback` where `v` has no direction.
inline std::array<double, 3> normalised(const std::array<double, 3>& v,
                                        const std::array<double, 3>& fallback) {
  const double length = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  if (!(length > 1e-9)) return fallback;
  return {v[0] / length, v[1] / length, v[2] / length};
}

}  // namespace tandem::scenes
