#include "services/tandemd/restarts.hpp"

#include <algorithm>

namespace tandem::daemon {

std::optional<std::int64_t> Restarts::wait_after_ns(std::int64_t ran_ns) {
  if (ran_ns >= kGoodNs) in_a_row_ = 0;
  if (++in_a_row_ > kMaxInARow) return std::nullopt;
  return std::min(kFirstWaitNs << (in_a_row_ - 1), kLongestWaitNs);
}

}  // namespace tandem::daemon
