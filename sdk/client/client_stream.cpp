// What comes of an epoch: take it in, and play.
#include <algorithm>
#include <utility>

#include "sdk/client/client_core.hpp"
#include "sdk/transport/units.hpp"

namespace tandem::client {

namespace {

// A scheduled input that a delta promised may be this late before the client joins again.
constexpr std::int64_t kInputPatienceNs = 250 * kMillisecond;
// A client that is far behind does what else is due, and lets others call it, after so many frames.
constexpr int kFramesPerPoll = 64;

// A stamp is untrusted: clocks an hour apart say nothing about latency, and no difference may overflow.
std::int64_t latency_ns(std::int64_t wall_ns, std::int64_t server_time_ns) {
  constexpr std::int64_t kMostNs = 3600 * kSecond;
  return wall_ns - std::clamp(server_time_ns, wall_ns - kMostNs, wall_ns + kMostNs);
}

}  // namespace

// Deltas first: whatever scheduled inputs they promise were published before them, so taking the inputs
// afterwards finds the most.
void ClientCore::take_stream(Now now) {
  if (!epoch_->played.is_open) return;
  take_deltas(now);
  take_scheduled();
  take_snapshots(now);
}

FollowedStream* ClientCore::followed(const StreamId& stream) {
  if (stream == epoch_->played.stream.id) return &epoch_->played;
  if (epoch_->next && stream == epoch_->next->stream.id) return &*epoch_->next;
  ++statistics_.stale_messages;
  return nullptr;
}

void ClientCore::take_deltas(Now now) {
  using Outcome = DeltaAssembly::Outcome;
  inbox_.deltas.clear();
  port_.take(inbox_.deltas);
  for (auto& received : inbox_.deltas) {
    if (!belongs(received)) continue;
    FollowedStream* const to = followed(received.message.stream);
    if (to == nullptr) continue;
    const bool is_played = to == &epoch_->played;
    const Frame frame = received.message.frame;
    const std::int64_t server_time_ns = received.message.server_time_ns;
    const bool last_part = received.message.part + 1 == received.message.parts;
    const Outcome outcome = to->assembly.add(std::move(received.message));
    statistics_.queue_high_water =
        std::max(statistics_.queue_high_water, static_cast<std::uint32_t>(to->assembly.high_water()));
    if (outcome == Outcome::kStored && last_part && is_played)
      epoch_->pacer.on_delta(frame, server_time_ns, now.steady_ns);
    if (outcome == Outcome::kStored || outcome == Outcome::kIgnored) continue;
    const std::string at = " at frame " + std::to_string(frame);
    if (outcome == Outcome::kRefused) {
      ++statistics_.refused_messages;
      lose(*to, ResyncReason::kRefused, "malformed delta" + at, now);
    } else if (outcome == Outcome::kOverflow) {
      lose(*to, ResyncReason::kOverflow, "too many deltas waiting" + at, now);
    } else if (outcome == Outcome::kLostPart) {
      lose(*to, ResyncReason::kLostPart, "part of a delta lost" + at, now);
    } else if (outcome == Outcome::kGap) {
      lose(*to, ResyncReason::kGap, "gap before the delta" + at, now);
    }
  }
}

void ClientCore::take_scheduled() {
  inbox_.inputs.clear();
  port_.take(inbox_.inputs);
  for (const auto& received : inbox_.inputs) {
    if (!belongs(received)) continue;
    const auto input = read_scheduled(received.message);
    if (!input) {
      // Its number stays missing, which brings about a rejoin when a delta needs it.
      ++statistics_.refused_messages;
      log(LogLevel::kWarning, input.error().message);
      continue;
    }
    epoch_->scheduled.add(*input);
    if (received.message.source_client == options_.id)
      epoch_->echo.on_scheduled(received.message.source_number, input->frame);
    listener_.on_scheduled(received.message);
  }
}

void ClientCore::take_snapshots(Now now) {
  using Outcome = SnapshotAssembly::Outcome;
  inbox_.snapshots.clear();
  port_.take(inbox_.snapshots);  // also while nothing joins: what comes late is not kept
  FollowedStream* const joined = joined_stream();
  if (joined == nullptr) return;
  for (auto& received : inbox_.snapshots) {
    if (!belongs(received)) continue;
    FollowedStream* const to = followed(received.message.stream);
    if (to == nullptr || !to->joining || !to->joiner.asked()) continue;
    if (to->too_old(received.message.frame)) continue;  // made for an earlier joiner
    const Outcome outcome = to->snapshot.add(std::move(received.message));
    if (outcome == Outcome::kRefused) ++statistics_.refused_messages;
    if (outcome != Outcome::kStored) continue;
    to->heard_ns = now.steady_ns;
    to->joiner.progress(now.steady_ns);
    // Tells the server early what came and what did not, and how long parts take.
    to->part_unacknowledged = true;
    if (now.steady_ns - last_ack_ns_ >= EpochState::kPartAckNs) ack_due_ = true;
    if (auto whole = to->snapshot.take()) to->joiner.offer(std::move(*whole));
  }
}

bool ClientCore::apply_front(FollowedStream& to, Now now, std::int64_t since_last_poll_ns) {
  const CompleteDelta* delta = to.assembly.front();
  if (delta == nullptr) return false;
  if (delta->frame != to.timeline.applied() + 1) {
    lose(to, ResyncReason::kGap, "gap before frame " + std::to_string(delta->frame), now);
    return false;
  }
  if (const auto scheduled = epoch_->scheduled.hand_over(to.timeline, delta->last_input); !scheduled) {
    ++statistics_.refused_messages;
    lose(to, ResyncReason::kRefused, scheduled.error().message, now);
    return false;
  }
  if (to.timeline.inputs_held() < delta->last_input) {
    to.input_missing_ns = to.input_missing_ns ? *to.input_missing_ns + since_last_poll_ns : 0;
    if (*to.input_missing_ns < kInputPatienceNs) return false;
    lose(to, ResyncReason::kMissingInput,
         "scheduled inputs up to " + std::to_string(delta->last_input) + " did not come", now);
    return false;
  }
  to.input_missing_ns.reset();
  const auto applied = to.timeline.apply(delta->frame, delta->last_input, delta->hash, delta->payload);
  if (applied) return true;
  const bool mismatch = applied.error().code == ErrorCode::kMismatch;
  ++(mismatch ? statistics_.hash_mismatches : statistics_.refused_messages);
  const std::string why = "frame " + std::to_string(delta->frame) + ": " + applied.error().message;
  to.assembly.pop();  // of no use any more, while those behind it are
  lose(to, mismatch ? ResyncReason::kMismatch : ResyncReason::kRefused, why, now);
  return false;
}

void ClientCore::play(Now now, std::int64_t since_last_poll_ns) {
  EpochState& e = *epoch_;
  FollowedStream& played = e.played;
  play_ahead(now);
  played.assembly.drop_through(played.timeline.applied());
  if (e.lag.exceeded(played.assembly.size(), now.steady_ns)) {
    lose(played, ResyncReason::kLag,
         std::to_string(played.assembly.size()) + " frames behind and not catching up", now);
    return;
  }
  for (int i = 0; i < kFramesPerPoll; ++i) {
    const std::int64_t began_ns = measure();
    if (!apply_front(played, now, since_last_poll_ns)) return;
    const std::int64_t cost_ns = std::exchange(e.frame_cost_ns, 0) + measure() - began_ns;
    const CompleteDelta& delta = *played.assembly.front();
    if (e.uncorrected) e.uncorrected->on_applied(played.timeline);
    e.pictures.on_applied(played.timeline, e.pacer, now.steady_ns);
    ++statistics_.frames_applied;
    statistics_.payload_bytes += delta.payload.size();
    statistics_.add_latency(latency_ns(now.wall_ns + measure() - poll_began_ns_, delta.server_time_ns));
    if (options_.measure_ns != nullptr) {
      statistics_.frame_cost.add(cost_ns);
      statistics_.recent_cost.add(cost_ns);
      const ClientTimeline::Timings timings = played.timeline.timings();
      statistics_.costs.predict_ns += cost_ns - timings.decode_ns - timings.hash_ns;
      statistics_.costs.decode_ns += timings.decode_ns;
      statistics_.costs.hash_ns += timings.hash_ns;
    }
    if (statistics_.first_applied_ns == 0) statistics_.first_applied_ns = now.steady_ns;
    statistics_.last_applied_ns = now.steady_ns;
    if (!e.next) chooser_->on_frame(cost_ns);
    sent_.on_applied(delta.frame, now.steady_ns, outcomes_);
    listener_.on_applied(e.session.epoch, delta);
    played.assembly.pop();
    play_ahead(now);
  }
}

// The frames that the server simulates by now, as far as the lead allows.
void ClientCore::simulate_ahead(Now now) {
  EpochState& e = *epoch_;
  if (!e.pacer.known()) return;
  while (e.pacer.due_ns(e.played.timeline.now() + 1) <= now.steady_ns && e.played.timeline.step(e.lead)) {
  }
}

void ClientCore::play_ahead(Now now) {
  EpochState& e = *epoch_;
  const std::int64_t began_ns = measure();
  const Frame simulated = e.played.timeline.now();
  simulate_ahead(now);
  e.frame_cost_ns += measure() - began_ns;
  if (e.played.timeline.now() != simulated) e.pictures.on_simulated(e.played.timeline, e.pacer);
}

// Once all that others wait for is done: the picture and the acknowledgement of the last frame.
void ClientCore::prepare_next() {
  EpochState& e = *epoch_;
  if (e.played.joining) return;
  const std::int64_t began_ns = measure();
  e.played.timeline.prepare();
  e.frame_cost_ns += measure() - began_ns;
}

}  // namespace tandem::client
