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
  /// Takes so many after has(), also more than there are: what is missing has to come back first.
  void spend(double amount) { spent_ += amount; }
  /// True if nothing of the burst is spent.
  [[nodiscard]] bool full(std::int64_t now_ns) { return has(now_ns) && spent_ == 0; }

 private:
  double per_second_;
  double burst_;
  double spent_ = 0;  // spent part of the burst at at_ns_
  std::int64_t at_ns_ = 0;
};

}  // namespace tandem::accounts
