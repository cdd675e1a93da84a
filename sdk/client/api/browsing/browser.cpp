#include "sdk/client/api/browsing/browser.hpp"

#include "sdk/client/session/session_check.hpp"

namespace tandem::api {
namespace {

// Status comes once a second.
constexpr std::int64_t kSilenceNs = 3'000'000'000;
// A machine that floods the status topic shall not fill this one's memory.
constexpr std::size_t kMaxHeard = 4096;

}  // namespace

void Browser::hear(std::int64_t now_ns) {
  std::vector<transport::Stamped<transport::ServerStatusMessage>> statuses;
  monitor_->take(statuses);
  for (auto& heard : statuses) {
    transport::ServerStatusMessage& status = heard.message;
    const std::pair key{status.session, status.stream};
    if (status.stream >= transport::kMaxStreams || status.server_role != transport::ServerRole::kLive ||
        (heard_.size() >= kMaxHeard && !heard_.contains(key)))
      continue;
    heard_[key] = {std::move(status), now_ns};
  }
  std::erase_if(heard_, [now_ns](const auto& entry) { return now_ns - entry.second.at_ns > kSilenceNs; });
}

transport::ServerStatusMessage Browser::status_of(const transport::SessionMessage& session) const {
  transport::ServerStatusMessage sum;
  for (auto heard = heard_.lower_bound({session.session, 0});
       heard != heard_.end() && heard->first.first == session.session; ++heard) {
    const transport::ServerStatusMessage& status = heard->second.status;
    if (status.epoch != session.epoch) continue;
    if (sum.epoch != session.epoch) {
      sum = status;
      continue;
    }
    sum.participants += status.participants;
    sum.observers += status.observers;
  }
  return sum;
}

std::size_t Browser::playable_stream(const transport::Received<transport::SessionMessage>& announced) {
  const auto [at, first] = playable_.try_emplace(Run{announced.from, announced.message.epoch}, kNone);
  if (first) {
    if (const auto playable = client::playable_streams(announced.message)) at->second = playable->front();
  }
  return at->second;
}

void Browser::refresh(std::int64_t now_ns) {
  hear(now_ns);
  std::vector<transport::Received<transport::SessionMessage>> live;
  monitor_->list_sessions(live);
  sessions_.clear();
  std::map<Run, std::size_t> playable;
  for (auto& announced : live) {
    if (announced.message.server_role != transport::ServerRole::kLive) continue;
    const std::size_t stream = playable_stream(announced);
    playable.emplace(Run{announced.from, announced.message.epoch}, stream);
    const auto [at, first] = sessions_.try_emplace(announced.message.session);
    if (!first) continue;
    FoundSession& found = at->second;
    found.announced = std::move(announced.message);
    if (stream != kNone) found.stream = &found.announced.streams[stream];
    found.status = status_of(found.announced);
  }
  playable_ = std::move(playable);
}

}  // namespace tandem::api
