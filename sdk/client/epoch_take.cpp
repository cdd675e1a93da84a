// Takes the messages of an epoch.
#include <algorithm>
#include <utility>

#include "sdk/client/followed_epoch.hpp"
#include "sdk/client/session/reply_reason.hpp"

namespace tandem::client {

// Deltas come first: the scheduled inputs that they count were published before them, so taking inputs
// afterwards finds as many as possible.
void FollowedEpoch::take_stream(Now now) {
  if (!played().is_open()) return;
  take_deltas(now);
  take_scheduled();
  take_snapshots(now);
}

Follower* FollowedEpoch::followed(const StreamId& stream) {
  if (stream == played().stream().id) return played_.get();
  if (change_ && stream == change_->to().stream().id) return &change_->to();
  ++client_.statistics.stale_messages;
  return nullptr;
}

void FollowedEpoch::take_deltas(Now now) {
  inbox_.deltas.clear();
  client_.port.take(inbox_.deltas);
  for (auto& received : inbox_.deltas) {
    if (!is_early(received) && belongs(received)) take_delta(std::move(received.message), now);
  }
}

void FollowedEpoch::take_delta(transport::DeltaMessage&& delta, Now now) {
  Follower* const to = followed(delta.stream);
  if (to == nullptr) return;
  const bool is_played = to == played_.get();
  const Frame frame = delta.frame;
  const std::int64_t server_time_ns = delta.server_time_ns;
  const Follower::Step taken = to->take(std::move(delta), now.steady_ns);
  std::uint32_t& high_water = client_.statistics.queue_high_water;
  high_water = std::max(high_water, static_cast<std::uint32_t>(to->most_waiting()));
  if (taken.done && is_played) pacer_.on_delta(frame, server_time_ns, now.steady_ns);
  if (!taken.loss) return;
  if (is_played) {
    on_loss(*taken.loss, now);
  } else {
    on_loss_in_change(*taken.loss, now);
  }
}

void FollowedEpoch::take_scheduled() {
  inbox_.inputs.clear();
  client_.port.take(inbox_.inputs);
  for (auto& received : inbox_.inputs) {
    if (!is_early(received) && belongs(received)) take_scheduled(received.message);
  }
}

void FollowedEpoch::take_scheduled(const transport::ScheduledInputMessage& message) {
  const auto input = read_scheduled(message);
  if (!input) {
    // The number stays missing, which causes a rejoin when a delta needs it.
    ++client_.statistics.refused_messages;
    client_.log(LogLevel::kWarning, input.error().message);
    return;
  }
  scheduled_.add(*input);
  if (message.source_client == client_.options.id) echo_.on_scheduled(message.source_number, input->frame);
  client_.listener.on_scheduled(message);
}

void FollowedEpoch::take_early(Now now) {
  Early early = std::exchange(early_, {});
  for (const auto& received : early.inputs) {
    if (received.from == server_) take_scheduled(received.message);
  }
  for (auto& received : early.deltas) {
    if (received.from == server_) take_delta(std::move(received.message), now);
  }
}

void FollowedEpoch::take_snapshots(Now now) {
  using Outcome = SnapshotAssembly::Outcome;
  inbox_.snapshots.clear();
  client_.port.take(inbox_.snapshots);  // also while nothing joins, so that late parts are not kept
  if (!played().joining() && !played().fetching() && !(change_ && change_->to().joining())) return;
  for (auto& received : inbox_.snapshots) {
    if (!belongs(received)) continue;
    Follower* const to = followed(received.message.stream);
    if (to == nullptr) continue;
    const Outcome outcome = to->take(std::move(received.message), now.steady_ns);
    if (outcome == Outcome::kRefused) ++client_.statistics.refused_messages;
    if (outcome != Outcome::kStored) continue;
    client_.part_ns = now.steady_ns;
    // Tells the server early what came and what did not, and how long parts take.
    if (now.steady_ns - client_.last_ack_ns >= Follower::kPartAckNs) client_.ack_due = true;
  }
}

void FollowedEpoch::take_replies(Now now) {
  inbox_.replies.clear();
  client_.port.take(inbox_.replies);
  for (auto& received : inbox_.replies) {
    if (received.message.client != client_.options.id || !belongs(received)) continue;
    const transport::ReplyMessage& reply = received.message;
    pacer_.on_echo(reply.server_time_ns, reply.client_clock_ns, now.steady_ns);
    client_.sent.on_reply(reply, client_.outcomes);
    if (reply.reason != 0 && (!reply_ || reply_->reason != reply.reason))
      client_.log(LogLevel::kWarning, describe(reply.reason));
    const bool above = reply.reason == static_cast<std::uint32_t>(transport::Reason::kCap);
    if (above && client_.options.cap_kbit_s > 0) refuse_for_cap(reply.needed_kbit_s);
    reply_ = std::move(received.message);
  }
}

void FollowedEpoch::take_statuses(Now now) {
  inbox_.statuses.clear();
  client_.port.take(inbox_.statuses);
  for (const auto& received : inbox_.statuses) {
    if (received.from != server_ || received.message.epoch != session_.epoch) continue;
    quiet_ns_ = 0;
    client_.told_ns = now.steady_ns;
    client_.makes_frames = received.message.frame_rate_hz > 0;
    unproven_ = false;
    tell_if_only_measured(received.message);
    chooser_.on_status(received.message);
    client_.listener.on_server_status(received.message);
  }
}

// A server has a status of streams that it does not offer yet.
void FollowedEpoch::tell_if_only_measured(const transport::ServerStatusMessage& status) {
  const StreamPreference& wanted = client_.preference;
  if (wanted.kind != StreamPreference::Kind::kNamed || status.predictor != wanted.name ||
      client_.told_measured)
    return;
  for (const transport::StreamMessage& offered : session_.streams)
    if (offered.id.id == status.stream) return;
  client_.told_measured = true;
  client_.log(LogLevel::kInfo, "the stream that was asked for is measured, not offered");
}

}  // namespace tandem::client
