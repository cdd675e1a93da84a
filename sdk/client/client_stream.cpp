// The stream of one epoch: buffer, join, play, join again.
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
  if (!epoch_->stream_open) return;
  take_deltas(now);
  take_scheduled();
  take_snapshots(now);
}

void ClientCore::take_deltas(Now now) {
  using Outcome = DeltaAssembly::Outcome;
  inbox_.deltas.clear();
  port_.take(inbox_.deltas);
  for (auto& received : inbox_.deltas) {
    if (!belongs(received)) continue;
    const Frame frame = received.message.frame;
    const std::int64_t server_time_ns = received.message.server_time_ns;
    const bool last_part = received.message.part + 1 == received.message.parts;
    const Outcome outcome = epoch_->assembly.add(std::move(received.message));
    statistics_.queue_high_water = std::max(statistics_.queue_high_water, epoch_->assembly.high_water());
    if (outcome == Outcome::kStored && last_part)
      epoch_->pacer.on_delta(frame, server_time_ns, now.steady_ns);
    if (outcome == Outcome::kStored || outcome == Outcome::kIgnored) continue;
    const std::string at = " at frame " + std::to_string(frame);
    if (outcome == Outcome::kRefused) {
      ++statistics_.refused_messages;
      rejoin(ResyncReason::kRefused, "malformed delta" + at, now);
    } else if (outcome == Outcome::kOverflow) {
      rejoin(ResyncReason::kOverflow, "too many deltas waiting" + at, now);
    } else if (outcome == Outcome::kLostPart) {
      rejoin(ResyncReason::kLostPart, "part of a delta lost" + at, now);
    } else if (outcome == Outcome::kGap) {
      rejoin(ResyncReason::kGap, "gap before the delta" + at, now);
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
  if (!epoch_->joining) return;
  inbox_.snapshots.clear();
  port_.take(inbox_.snapshots);
  for (auto& received : inbox_.snapshots) {
    if (!belongs(received) || !epoch_->joiner.asked()) continue;
    if (too_old(received.message.frame)) continue;  // made for an earlier joiner
    const Outcome outcome = epoch_->snapshot.add(std::move(received.message));
    if (outcome == Outcome::kRefused) ++statistics_.refused_messages;
    if (outcome != Outcome::kStored) continue;
    epoch_->joiner.progress(now.steady_ns);
    // Tells the server early what came and what did not, and how long parts take.
    epoch_->part_unacknowledged = true;
    if (now.steady_ns - last_ack_ns_ >= EpochState::kPartAckNs) ack_due_ = true;
    if (auto whole = epoch_->snapshot.take()) epoch_->joiner.offer(std::move(*whole));
  }
}

bool ClientCore::too_old(Frame snapshot) const {
  const CompleteDelta* first = epoch_->assembly.front();
  return first != nullptr && snapshot + 1 < first->frame;
}

void ClientCore::join(Now now) {
  EpochState& e = *epoch_;
  if (!e.stream_open) {
    if (auto opened = port_.open_stream(e.session, e.stream, options_.id); !opened) {
      log(LogLevel::kError, opened.error().message);
      return;
    }
    e.stream_open = true;
  }
  if (e.joiner.poll(now.steady_ns)) {
    if (auto opened = port_.open_snapshots(); !opened) log(LogLevel::kError, opened.error().message);
    ack_due_ = true;
  }
  // The deltas in between were lost meanwhile, or sent before this client read them.
  if (e.snapshot.parts() > 0 && too_old(e.snapshot.frame())) {
    e.snapshot.reject();
    e.joiner.ask_again(now.steady_ns);
  }
  const CompleteDelta* first = e.assembly.front();
  auto snapshot =
      e.joiner.choose(first != nullptr ? std::optional(first->frame) : std::nullopt, now.steady_ns);
  if (snapshot) load(std::move(*snapshot), now);
}

void ClientCore::load(transport::SnapshotMessage&& snapshot, Now now) {
  EpochState& e = *epoch_;
  auto loaded = e.timeline.load(snapshot.bytes, e.session.epoch, e.stream.id);
  if (loaded && e.timeline.applied() != snapshot.frame) {
    loaded = fail(ErrorCode::kMalformed, "snapshot of another frame than announced");
  }
  if (!loaded) {
    ++statistics_.refused_messages;
    if (loaded.error().code == ErrorCode::kMismatch) ++statistics_.hash_mismatches;
    log(LogLevel::kWarning, "snapshot refused: " + loaded.error().message);
    e.snapshot.reject();
    e.joiner.ask_again(now.steady_ns);
    return;
  }
  port_.close_snapshots();
  e.snapshot.clear();
  e.assembly.drop_through(snapshot.frame);
  follow_uncorrected();
  if (pictures_.wanted()) e.pictures.on_loaded(e.timeline, e.pacer, now.steady_ns);
  e.joining = false;
  e.played = true;
  e.input_missing_ns.reset();
  e.frame_cost_ns = 0;
  ack_due_ = true;
  statistics_.join_ns = now.steady_ns - e.join_began_ns;
  listener_.on_snapshot(snapshot);
  log(LogLevel::kInfo, "playing from frame " + std::to_string(snapshot.frame));
}

void ClientCore::play(Now now, std::int64_t since_last_poll_ns) {
  EpochState& e = *epoch_;
  play_ahead(now);
  e.assembly.drop_through(e.timeline.applied());
  if (e.lag.exceeded(e.assembly.size(), now.steady_ns)) {
    rejoin(ResyncReason::kLag, std::to_string(e.assembly.size()) + " frames behind and not catching up", now);
    return;
  }
  for (int i = 0; i < kFramesPerPoll && e.assembly.front() != nullptr; ++i) {
    const CompleteDelta* delta = e.assembly.front();
    if (delta->frame != e.timeline.applied() + 1) {
      rejoin(ResyncReason::kGap, "gap before frame " + std::to_string(delta->frame), now);
      return;
    }
    if (const auto scheduled = e.scheduled.hand_over(e.timeline, delta->last_input); !scheduled) {
      ++statistics_.refused_messages;
      rejoin(ResyncReason::kRefused, scheduled.error().message, now);
      return;
    }
    if (e.timeline.inputs_held() < delta->last_input) {
      e.input_missing_ns = e.input_missing_ns ? *e.input_missing_ns + since_last_poll_ns : 0;
      if (*e.input_missing_ns < kInputPatienceNs) return;
      rejoin(ResyncReason::kMissingInput,
             "scheduled inputs up to " + std::to_string(delta->last_input) + " did not come", now);
      return;
    }
    e.input_missing_ns.reset();
    const std::int64_t began_ns = measure();
    const auto applied = e.timeline.apply(delta->frame, delta->last_input, delta->hash, delta->payload);
    const std::int64_t cost_ns = std::exchange(e.frame_cost_ns, 0) + measure() - began_ns;
    if (!applied) {
      const bool mismatch = applied.error().code == ErrorCode::kMismatch;
      ++(mismatch ? statistics_.hash_mismatches : statistics_.refused_messages);
      const std::string why = "frame " + std::to_string(delta->frame) + ": " + applied.error().message;
      e.assembly.pop();  // of no use any more, while those behind it are
      rejoin(mismatch ? ResyncReason::kMismatch : ResyncReason::kRefused, why, now);
      return;
    }
    if (e.uncorrected) e.uncorrected->on_applied(e.timeline);
    e.pictures.on_applied(e.timeline, e.pacer, now.steady_ns);
    ++statistics_.frames_applied;
    statistics_.payload_bytes += delta->payload.size();
    statistics_.add_latency(latency_ns(now.wall_ns + measure() - poll_began_ns_, delta->server_time_ns));
    if (options_.measure_ns != nullptr) {
      statistics_.frame_cost.add(cost_ns);
      statistics_.recent_cost.add(cost_ns);
      const ClientTimeline::Timings timings = e.timeline.timings();
      statistics_.costs.predict_ns += cost_ns - timings.decode_ns - timings.hash_ns;
      statistics_.costs.decode_ns += timings.decode_ns;
      statistics_.costs.hash_ns += timings.hash_ns;
    }
    if (statistics_.first_applied_ns == 0) statistics_.first_applied_ns = now.steady_ns;
    statistics_.last_applied_ns = now.steady_ns;
    sent_.on_applied(delta->frame, now.steady_ns, outcomes_);
    listener_.on_applied(e.session.epoch, *delta);
    e.assembly.pop();
    play_ahead(now);
  }
}

// From the agreed state as it is now.
void ClientCore::follow_uncorrected() {
  EpochState& e = *epoch_;
  e.pictures.draw_instead(nullptr);
  e.uncorrected.reset();
  if (!shows_uncorrected_) return;
  e.uncorrected.emplace(e.stream.layout, e.timeline);
  e.pictures.draw_instead(&e.uncorrected->state());
}

// Simulates the frames that the server simulates by now, as far as the lead allows.
void ClientCore::play_ahead(Now now) {
  EpochState& e = *epoch_;
  if (!e.pacer.known()) return;
  const std::int64_t began_ns = measure();
  const Frame simulated = e.timeline.now();
  while (e.pacer.due_ns(e.timeline.now() + 1) <= now.steady_ns && e.timeline.step(e.lead)) {
  }
  e.frame_cost_ns += measure() - began_ns;
  if (e.timeline.now() != simulated) e.pictures.on_simulated(e.timeline, e.pacer);
}

void ClientCore::rejoin(ResyncReason reason, const std::string& why, Now now) {
  EpochState& e = *epoch_;
  listener_.on_resync(reason);
  if (e.joining) {
    // Not playing yet: the buffer starts again, and the snapshot asked for may still fit what follows.
    if (reason != ResyncReason::kGap && reason != ResyncReason::kLostPart) e.joiner.ask_again(now.steady_ns);
    return;
  }
  ++statistics_.resyncs;
  ++statistics_.resyncs_by_reason[static_cast<std::size_t>(reason)];
  if (reason != ResyncReason::kLag || !std::exchange(e.told_lag, true)) {
    log(LogLevel::kWarning, "joining again: " + why);
  }
  e.joining = true;
  e.join_began_ns = now.steady_ns;
  e.input_missing_ns.reset();
  e.lag.reset();
  e.joiner.start(now.steady_ns);
}

}  // namespace tandem::client
