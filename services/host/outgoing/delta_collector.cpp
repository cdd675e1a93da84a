#include "services/host/outgoing/delta_collector.hpp"

#include <utility>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::host {

void DeltaCollector::take(const Made& made, std::int64_t now_ns,
                          std::vector<transport::DeltaMessage>& leaving) {
  const bool follows = before_.frame + 1 == made.frame && before_.frame != 0;
  const bool same_inputs = made.last_input == before_.last_input;
  if (!follows) {
    bundle_ = {};
    since_ns_.reset();
  }
  const std::size_t bytes = made.payload.size();
  const bool fits =
      same_inputs && bundle_.frames() < limits_.frames && bundle_.bytes_with(bytes) <= limits_.bytes;
  if (!bundle_.empty() && !fits) leave(now_ns, leaving);
  const bool quiet = follows && same_inputs && bytes == 0 && made.hash == before_.hash;
  bundle_.add(made.frame, made.hash, made.payload);
  before_ = made;
  before_.payload = {};
  if (!quiet && !since_ns_) since_ns_ = now_ns;
  // Waiting for the next frame pays if it may fit. It would be too late after the delay.
  const bool is_last = made.at_once || bundle_.bytes_with(bytes / 2) > limits_.bytes ||
                       (since_ns_ && now_ns + limits_.period_ns - *since_ns_ > limits_.delay_ns);
  release(is_last, now_ns, leaving);
}

void DeltaCollector::release(bool all, std::int64_t now_ns, std::vector<transport::DeltaMessage>& leaving) {
  if (bundle_.empty()) return;
  const bool waited = since_ns_ && now_ns - *since_ns_ >= limits_.delay_ns;
  if (all || waited || bundle_.frames() >= limits_.frames || now_ns - told_ns_ >= kLongestNs)
    leave(now_ns, leaving);
}

void DeltaCollector::leave(std::int64_t now_ns, std::vector<transport::DeltaMessage>& leaving) {
  transport::DeltaMessage& delta = leaving.emplace_back(bundle_.take());
  TANDEM_ASSERT(delta.frame == before_.frame);
  delta.last_input = before_.last_input;
  delta.server_time_ns = before_.wall_ns;
  since_ns_.reset();
  told_ns_ = now_ns;
}

}  // namespace tandem::host
