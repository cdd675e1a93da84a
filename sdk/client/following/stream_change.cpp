#include "sdk/client/following/stream_change.hpp"

namespace tandem::client {

bool StreamChange::gets_nowhere(std::int64_t now_ns, std::int64_t last_applied_ns) {
  // A server that is completely silent says nothing about this stream.
  if (now_ns - last_applied_ns > kSecond) to_->excuse_silence(now_ns);
  return now_ns - to_->heard_ns() > kPatienceNs;
}

Follower::Step StreamChange::catch_up(const Follower& played, const ScheduledInputs& scheduled,
                                      const std::function<bool(const ClientTimeline&)>& is_spent) {
  TANDEM_ASSERT(!played.joining() && !to().joining());
  const Frame here = played.timeline().applied();
  // A client that is far behind does not wait for the stream that it leaves to catch up.
  const bool behind = static_cast<double>(played.waiting()) > frame_rate_hz_;
  for (int i = 0; i < kFramesPerPoll && (behind || to_->timeline().applied() < here); ++i) {
    Follower::Step step = to_->apply_front(scheduled, 0);
    if (step.loss) return step;
    if (!step.done) break;
    const bool spent = is_spent(to_->timeline());
    to_->pop();
    if (spent) break;
  }
  const Frame there = to_->timeline().applied();
  return {.done = there == here || (behind && there > here)};
}

}  // namespace tandem::client
