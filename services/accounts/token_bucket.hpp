#pragma once
// Limits how often something may happen.

#include <algorithm>
#include <cstdint>

namespace tandem::accounts {

/// `burst` at once, and `per_second` on average. Starts full. Time never goes back.
class TokenBucket {
 public:
  constexpr TokenBucket(double per_second, double burst) : per_second_(per_second), burst_(burst) {}

  /// Takes one, if there is one.
  bool take(std::int64_t now_ns) {
    if (!has(now_ns)) return false;
    spent_ += 1;
    return true;
  }
  [[nodiscard]] bool has(std::int64_t now_ns) {
    const double returned = static_cast<double>(now_ns - at_ns_) * 1e-9 * per_second_;
    spent_ = std::max(spent_ - returned, 0.0);
    at_ns_ = now_ns;
    return spent_ + 1 <= burst_;
  }

 private:
  double per_second_;
  double burst_;
  double spent_ = 0;  // spent part of the burst at at_ns_
  std::int64_t at_ns_ = 0;
};

}  // namespace tandem::accounts
