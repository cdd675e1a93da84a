#pragma once
// How much may happen, where it happens in amounts.

#include <algorithm>
#include <cstdint>

namespace tandem::accounts {

/// A reserve from which amounts are taken, and which fills again at a constant rate. It starts full. Time
/// never goes back.
class Budget {
 public:
  struct Rule {
    double per_second = 0;
    double most = 0;  ///< the reserve; 0: everything may be taken
  };

  /// Takes `amount`, if it is there. More than the whole reserve is taken as the whole.
  bool take(double amount, const Rule& rule, std::int64_t now_ns) {
    if (!(rule.most > 0)) return true;
    const double wanted = std::min(amount, rule.most);
    if (!(spent(rule, now_ns) + wanted <= rule.most)) return false;
    spend(wanted);
    return true;
  }
  /// The part of the reserve that is spent now.
  [[nodiscard]] double spent(const Rule& rule, std::int64_t now_ns) {
    spent_ = std::max(spent_ - static_cast<double>(now_ns - at_ns_) * 1e-9 * rule.per_second, 0.0);
    at_ns_ = now_ns;
    return spent_;
  }
  /// Takes `amount` after spent(), also more than there is: what is missing has to come back first.
  void spend(double amount) { spent_ += amount; }

 private:
  double spent_ = 0;  // as of at_ns_
  std::int64_t at_ns_ = 0;
};

}  // namespace tandem::accounts
