#include "services/host/clients/audience.hpp"

namespace tandem::host {

StreamSet Audience::wanted(Roster& roster, std::int64_t now_ns) {
  StreamSet wanted;
  for (std::uint32_t stream = 0; stream < needed_ns_.size(); ++stream) {
    for (const auto& [id, account] : roster.accounts())
      if (needs(account, stream)) needed_ns_[stream] = now_ns;
    wanted[stream] = needed_ns_[stream] && now_ns - *needed_ns_[stream] < kLingerNs;
  }
  if (wanted.none()) wanted.set(0);
  return wanted;
}

}  // namespace tandem::host
