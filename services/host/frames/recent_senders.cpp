#include "services/host/frames/recent_senders.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace tandem::host {

void RecentSenders::sent(transport::ClientId client, std::int64_t now_ns) {
  std::erase_if(senders_, [client](const Sender& sender) { return sender.client == client; });
  if (senders_.size() >= kMaxKept) senders_.erase(senders_.begin());
  senders_.push_back({client, now_ns});
}

std::string RecentSenders::names(std::int64_t now_ns) const {
  std::string names;
  std::size_t named = 0, more = 0;
  for (auto sender = senders_.rbegin(); sender != senders_.rend(); ++sender) {
    const std::int64_t age_ns = now_ns - sender->at_ns;
    if (age_ns > kLatelyNs) break;
    if (named == kMaxNamed) {
      ++more;
      continue;
    }
    names += fmt::format("{}client {:016x} ({:.1f} s)", named == 0 ? "" : ", ", sender->client,
                         static_cast<double>(age_ns) * 1e-9);
    ++named;
  }
  if (more > 0) names += fmt::format(" and {} more", more);
  return names;
}

}  // namespace tandem::host
