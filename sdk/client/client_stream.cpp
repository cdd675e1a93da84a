// Takes the messages of an epoch, and plays.
#include <algorithm>
#include <utility>

#include "sdk/client/client_core.hpp"
#include "sdk/wire/units.hpp"

namespace tandem::client {

namespace {

// After so many frames, or kMostPollNs, a client that is far behind does its other work and lets other calls
// proceed.
constexpr int kFramesPerPoll = 64;

// Stamps are untrusted: no difference may overflow.
std::int64_t latency_ns(std::int64_t wall_ns, std::int64_t server_time_ns) {
  constexpr std::int64_t kMostNs = 3600 * kSecond;
  return wall_ns - std::clamp(server_time_ns, wall_ns - kMostNs, wall_ns + kMostNs);
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

// Deltas come first: the scheduled inputs that they count were published before them, so taking inputs
// afterwards finds as many as possible.
void ClientCore::take_stream(Now now) {
  if (!epoch_->played->is_open()) return;
  take_deltas(now);
  take_scheduled();
  take_snapshots(now);
}

Follower* ClientCore::followed(const StreamId& stream) {
  EpochState& e = *epoch_;
  if (stream == e.played->stream().id) return e.played.get();
  if (e.change && stream == e.change->to().stream().id) return &e.change->to();
  ++statistics_.stale_messages;
  return nullptr;
}

void ClientCore::take_deltas(Now now) {
  inbox_.deltas.clear();
  port_.take(inbox_.deltas);
  for (auto& received : inbox_.deltas) {
    if (!is_early(received) && belongs(received)) take_delta(std::move(received.message), now);
  }
}

void ClientCore::take_delta(transport::DeltaMessage&& delta, Now now) {
  Follower* const to = followed(delta.stream);
  if (to == nullptr) return;
  const bool is_played = to == epoch_->played.get();
  const Frame frame = delta.frame;
  const std::int64_t server_time_ns = delta.server_time_ns;
  const Follower::Step taken = to->take(std::move(delta), now.steady_ns);
  statistics_.queue_high_water =
      std::max(statistics_.queue_high_water, static_cast<std::uint32_t>(to->most_waiting()));
  if (taken.done && is_played) epoch_->pacer.on_delta(frame, server_time_ns, now.steady_ns);
  if (!taken.loss) return;
  if (is_played) {
    on_loss(*taken.loss, now);
  } else {
    on_loss_in_change(*taken.loss, now);
  }
}

void ClientCore::take_scheduled() {
  inbox_.inputs.clear();
  port_.take(inbox_.inputs);
  for (auto& received : inbox_.inputs) {
    if (!is_early(received) && belongs(received)) take_scheduled(received.message);
  }
}

void ClientCore::take_scheduled(const transport::ScheduledInputMessage& message) {
  const auto input = read_scheduled(message);
  if (!input) {
    // The number stays missing, which causes a rejoin when a delta needs it.
    ++statistics_.refused_messages;
    log(LogLevel::kWarning, input.error().message);
    return;
  }
  epoch_->scheduled.add(*input);
  if (message.source_client == options_.id) epoch_->echo.on_scheduled(message.source_number, input->frame);
  listener_.on_scheduled(message);
}

// Takes the messages that the new server sent while the old one still counted as alive.
void ClientCore::take_early(Now now) {
  Early early = std::exchange(epoch_->early, {});
  for (const auto& received : early.inputs) {
    if (received.from == epoch_->server) take_scheduled(received.message);
  }
  for (auto& received : early.deltas) {
    if (received.from == epoch_->server) take_delta(std::move(received.message), now);
  }
}

void ClientCore::take_snapshots(Now now) {
  using Outcome = SnapshotAssembly::Outcome;
  inbox_.snapshots.clear();
  port_.take(inbox_.snapshots);  // also while nothing joins, so that late parts are not kept
  if (!epoch_->played->joining() && !epoch_->played->fetching() &&
      !(epoch_->change && epoch_->change->to().joining()))
    return;
  for (auto& received : inbox_.snapshots) {
    if (!belongs(received)) continue;
    Follower* const to = followed(received.message.stream);
    if (to == nullptr) continue;
    const Outcome outcome = to->take(std::move(received.message), now.steady_ns);
    if (outcome == Outcome::kRefused) ++statistics_.refused_messages;
    // Tells the server early what came and what did not, and how long parts take.
    if (outcome == Outcome::kStored) part_ns_ = now.steady_ns;
    if (outcome == Outcome::kStored && now.steady_ns - last_ack_ns_ >= Follower::kPartAckNs) ack_due_ = true;
  }
}

void ClientCore::play(Now now, std::int64_t since_last_poll_ns) {
  EpochState& e = *epoch_;
  play_ahead(now);
  if (const auto lag = e.played->check_lag(now.steady_ns)) {
    on_loss(*lag, now);
    return;
  }
  for (int i = 0; i < kFramesPerPoll; ++i) {
    const std::int64_t began_ns = measure();
    const Follower::Step step = e.played->apply_front(e.scheduled, since_last_poll_ns);
    if (step.loss) on_loss(*step.loss, now);
    if (!step.done) return;
    const std::int64_t cost_ns = std::exchange(e.frame_cost_ns, 0) + measure() - began_ns;
    on_applied(*e.played->front(), cost_ns, now);
    e.played->pop();
    if (is_spent()) return;
    play_ahead(now);
  }
}

void ClientCore::on_applied(const CompleteDelta& delta, std::int64_t cost_ns, Now now) {
  EpochState& e = *epoch_;
  const ClientTimeline& timeline = e.played->timeline();
  if (e.uncorrected) e.uncorrected->on_applied(timeline);
  e.pictures.on_applied(timeline, e.pacer, now.steady_ns);
  ++statistics_.frames_applied;
  if (++e.frames_since_join == kSettledFrames) e.wrong_joins = 0;
  statistics_.payload_bytes += delta.payload.size();
  // The wall clocks of two machines, or of one that was set, need not agree.
  const std::int64_t server_now_ns =
      now.steady_ns + server_offset_ns(e.pacer.clock(), now) + measure() - poll_began_ns_;
  statistics_.add_latency(latency_ns(server_now_ns, delta.server_time_ns));
  if (options_.measure_ns != nullptr) {
    statistics_.frame_cost.add(cost_ns);
    statistics_.recent_cost.add(cost_ns);
    const ClientTimeline::Timings timings = timeline.timings();
    statistics_.costs.predict_ns += cost_ns - timings.decode_ns - timings.hash_ns;
    statistics_.costs.decode_ns += timings.decode_ns;
    statistics_.costs.hash_ns += timings.hash_ns;
  }
  if (statistics_.first_applied_ns == 0) statistics_.first_applied_ns = now.steady_ns;
  statistics_.last_applied_ns = now.steady_ns;
  if (!e.change) chooser_->on_frame(cost_ns);
  sent_.on_applied(delta.frame, now.steady_ns, outcomes_);
  listener_.on_applied(e.session.epoch, delta);
}

// Simulates the frames that the server has reached by now, as far as the lead allows.
void ClientCore::simulate_ahead(Now now) {
  EpochState& e = *epoch_;
  if (!e.pacer.known()) return;
  while (e.pacer.due_ns(e.played->timeline().now() + 1) <= now.steady_ns && e.played->step(e.lead)) {
  }
}

void ClientCore::play_ahead(Now now) {
  EpochState& e = *epoch_;
  const std::int64_t began_ns = measure();
  const Frame simulated = e.played->timeline().now();
  simulate_ahead(now);
  e.frame_cost_ns += measure() - began_ns;
  if (e.played->timeline().now() != simulated) e.pictures.on_simulated(e.played->timeline(), e.pacer);
}

// Called after the work that others wait for: the picture and the acknowledgement of the last frame.
void ClientCore::prepare_next() {
  EpochState& e = *epoch_;
  if (e.played->joining() || is_spent()) return;
  const std::int64_t began_ns = measure();
  e.played->prepare();
  e.frame_cost_ns += measure() - began_ns;
}

}  // namespace tandem::client
