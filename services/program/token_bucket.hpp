#pragma once
// Limits how often something may happen.

#include <cmath>
#include <cstdint>

#include "services/program/budget.hpp"

namespace tandem::accounts {

/// `burst` at once, and `per_second` on average: a budget from which ones are taken. Starts full. Time never
/// goes back.
class TokenBucket {
 public:
  constexpr TokenBucket(double per_second, double burst) : rule_{.per_second = per_second, .most = burst} {}

  /// Takes one, if there is one.
  bool take(std::int64_t now_ns) {
    if (!has(now_ns)) return false;
    spend(1);
    return true;
  }
  [[nodiscard]] bool has(std::int64_t now_ns) { return missing(now_ns) <= 0; }
  /// The time until has(); 0: there is one.
  [[nodiscard]] std::int64_t wait_ns(std::int64_t now_ns) {
    const double seconds = missing(now_ns) / rule_.per_second;
    return seconds > 0 ? static_cast<std::int64_t>(std::ceil(seconds * 1e9)) : 0;
  }
  /// Takes so many after has(), also more than there are: what is missing has to come back first.
  void spend(double amount) { reserve_.spend(amount); }
  /// True if nothing of the burst is spent.
  [[nodiscard]] bool full(std::int64_t now_ns) { return has(now_ns) && reserve_.spent(rule_, now_ns) == 0; }

 private:
  /// What has to come back until there is one.
  [[nodiscard]] double missing(std::int64_t now_ns) { return reserve_.spent(rule_, now_ns) + 1 - rule_.most; }

  Budget::Rule rule_;
  Budget reserve_;
};

}  // namespace tandem::accounts
