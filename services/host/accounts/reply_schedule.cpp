#include "services/host/accounts/reply_schedule.hpp"

namespace tandem::accounts {

bool ReplySchedule::due(transport::Role role, std::int64_t now_ns) {
  if (!elapsed(now_ns, kChangeNs)) return false;
  return for_more_than_outcomes(role, now_ns) || (outcomes_due_ && outcomes_.has(now_ns));
}

void ReplySchedule::sent(transport::Role role, std::int64_t now_ns) {
  if (!for_more_than_outcomes(role, now_ns)) outcomes_.take(now_ns);
  changed_ = outcomes_due_ = clock_moved_ = false;
  last_ns_ = now_ns;
}

}  // namespace tandem::accounts
