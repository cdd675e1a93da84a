// Plays a stream: the hot loop.
#include <algorithm>
#include <utility>

#include "sdk/client/followed_epoch.hpp"
#include "sdk/wire/units.hpp"

namespace tandem::client {

namespace {

// After so many frames, or Lasting::kMaxPollNs, a client that is far behind does its other work and lets
// other calls proceed.
constexpr int kFramesPerPoll = 64;

// Stamps are untrusted: no difference may overflow.
std::int64_t latency_ns(std::int64_t wall_ns, std::int64_t server_time_ns) {
  constexpr std::int64_t kMaxNs = 3600 * kSecond;
  return wall_ns - std::clamp(server_time_ns, wall_ns - kMaxNs, wall_ns + kMaxNs);
}

// From the client's steady clock to the server's wall clock: what the client's own wall clock says, unless
// messages and echoes prove that the two do not agree.
std::int64_t server_offset_ns(const ServerClock& server, Now now) {
  // Until there is an echo: the longest time on the way that is believed of the fastest message.
  constexpr std::int64_t kUnheardNs = kSecond;
  constexpr std::int64_t kToleranceNs = 2 * kMillisecond;  // as much is a clock slewed in a few seconds
  const std::int64_t own_ns = now.wall_ns - now.steady_ns;
  if (!server.known()) return own_ns;
  const std::int64_t least_ns = server.arrival_offset_ns();
  const std::int64_t most_ns = least_ns + (server.round_trip_ns() > 0 ? server.round_trip_ns() : kUnheardNs);
  const bool agree = own_ns >= least_ns - kToleranceNs && own_ns <= most_ns + kToleranceNs;
  return agree ? own_ns : server.offset_ns();
}

}  // namespace

void FollowedEpoch::play(Now now, std::int64_t since_last_poll_ns) {
  play_ahead(now);
  if (const auto lag = played().check_lag(now.steady_ns)) {
    on_loss(*lag, now);
    return;
  }
  for (int i = 0; i < kFramesPerPoll; ++i) {
    if (front_waits(now)) return;
    const std::int64_t began_ns = client_.measure();
    const Follower::Step step = played().apply_front(scheduled_, since_last_poll_ns);
    if (step.loss) on_loss(*step.loss, now);
    if (!step.done) return;
    const std::int64_t cost_ns = std::exchange(frame_cost_ns_, 0) + client_.measure() - began_ns;
    on_applied(*played().front(), cost_ns, now);
    played().pop();
    if (client_.is_spent()) return;
    play_ahead(now);
  }
}

void FollowedEpoch::on_applied(const CompleteDelta& delta, std::int64_t cost_ns, Now now) {
  Statistics& statistics = client_.statistics;
  const ClientTimeline& timeline = played().timeline();
  if (uncorrected_) uncorrected_->on_applied(timeline);
  pictures_.on_applied(timeline, pacer_, now.steady_ns);
  ++statistics.frames_applied;
  if (++frames_since_join_ == kSettledFrames) wrong_joins_ = 0;
  statistics.payload_bytes += delta.payload.size();
  // The wall clocks of two machines, or of one that was set, need not agree.
  const std::int64_t server_now_ns =
      now.steady_ns + server_offset_ns(clock(), now) + client_.measure() - client_.poll_began_ns;
  // That frames wait for others, for as long as the stream says, is no lag.
  const std::int64_t late_ns = latency_ns(server_now_ns, delta.server_time_ns);
  statistics.add_latency(late_ns - std::clamp<std::int64_t>(late_ns, 0, pacer_.delay_ns()));
  if (client_.options.measure_ns != nullptr) {
    statistics.frame_cost.add(cost_ns);
    statistics.recent_cost.add(cost_ns);
    const ClientTimeline::Timings timings = timeline.timings();
    statistics.costs.predict_ns += cost_ns - timings.decode_ns - timings.hash_ns;
    statistics.costs.decode_ns += timings.decode_ns;
    statistics.costs.hash_ns += timings.hash_ns;
  }
  if (statistics.first_applied_ns == 0) {
    statistics.first_applied_ns = now.steady_ns;
    statistics.wire_bytes_before = statistics.wire_bytes;
  }
  statistics.last_applied_ns = now.steady_ns;
  if (!change_) chooser_.on_frame(cost_ns);
  client_.sent.on_applied(delta.frame, now.steady_ns, client_.outcomes);
  client_.listener.on_applied(session_.epoch, delta);
  if (timeline.holds_state()) client_.news.on_applied(timeline);
}

// Simulates the frames that the server has reached by now, as far as the lead allows.
void FollowedEpoch::simulate_ahead(Now now) {
  if (!pacer_.known()) return;
  while (pacer_.due_ns(played().timeline().now() + 1) <= now.steady_ns && played().step(lead_)) {
  }
}

void FollowedEpoch::play_ahead(Now now) {
  const std::int64_t began_ns = client_.measure();
  const Frame simulated = played().timeline().now();
  simulate_ahead(now);
  frame_cost_ns_ += client_.measure() - began_ns;
  if (played().timeline().now() != simulated) pictures_.on_simulated(played().timeline(), pacer_);
}

// Called after the work that others wait for: the picture and the acknowledgement of the last frame.
void FollowedEpoch::prepare() {
  if (played().joining() || client_.is_spent()) return;
  const std::int64_t began_ns = client_.measure();
  played().prepare();
  frame_cost_ns_ += client_.measure() - began_ns;
}

}  // namespace tandem::client
