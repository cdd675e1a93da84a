#pragma once
// Seeded numbers and turns for tests; the same everywhere.

#include <array>
#include <cmath>
#include <cstdint>
#include <random>

#include "sdk/core/lattice/turn.hpp"

namespace tandem::synthetic {

/// Only the engine of the standard library is the same everywhere; its distributions are not.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  /// 0 .. count - 1.
  std::uint64_t below(std::uint64_t count) { return engine_() % count; }
  bool one_in(std::uint64_t count) { return below(count) == 0; }
  /// Within +-limit, every order of magnitude about as often as any other.
  std::int32_t value(std::int32_t limit) {
    const auto spread = static_cast<std::int64_t>(below(2 * static_cast<std::uint64_t>(limit) + 1)) - limit;
    return static_cast<std::int32_t>(spread >> below(30));
  }
  /// Within +-limit, evenly.
  std::int32_t even(std::int32_t limit) {
    return static_cast<std::int32_t>(
        static_cast<std::int64_t>(below(2 * static_cast<std::uint64_t>(limit) + 1)) - limit);
  }

 private:
  std::mt19937_64 engine_;
};

/// Any turn, valid.
inline Quaternion any_quaternion(Random& random) {
  std::array<double, kQuaternionChannels> q{};
  double norm = 0;
  for (double& a : q) {
    a = random.even(1 << 20) + 0.5;
    norm += a * a;
  }
  Quaternion rounded{};
  for (std::size_t i = 0; i < q.size(); ++i)
    rounded[i] = static_cast<std::int32_t>(std::lround(q[i] / std::sqrt(norm) * kQuaternionOne));
  return rounded;
}

/// Valid, of any order of magnitude.
inline Spin any_spin(Random& random) {
  Spin spin{};
  for (std::int32_t& a : spin) a = random.value(kSpinLimit);
  return limited_spin({spin[0], spin[1], spin[2]});
}

}  // namespace tandem::synthetic
