#include "services/gateway/gateway.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sdk/client/session/history.hpp"
#include "sdk/core/lattice/assert.hpp"
#include "sdk/transport/network/wire_bytes.hpp"
#include "sdk/wire/envelope.hpp"

namespace tandem::gateway {

using transport::Reason;
using transport::Role;
namespace {

/// Viewers are told a status in turns, this long after each other: all of them within half a second.
constexpr std::int64_t kStatusTurns = 15, kStatusTurnNs = 33 * kMillisecond;

}  // namespace

Gateway::Gateway(const Limits& limits, following::FollowedWorld& world)
    : limits_(limits), world_(world), log_(limits.queue_bytes) {
  announce(make_outgoing(transport::AbsentMessage{}));
}

void Gateway::announce(OutgoingPtr announcement) {
  announcement_ = std::move(announcement);
  ++announcement_number_;
}

// The same epoch with another stream: inputs and their outcomes continue.
void Gateway::on_session(const transport::SessionMessage& session) {
  const bool same_epoch = session_ && session_->epoch == session.epoch;
  const bool continues = session_ && client::shared_history(*session_, session).has_value();
  session_ = session;
  alive_ = true;
  announce(make_outgoing(session));
  log_.clear();
  grouping_.start(log_, session.capacity, session.frame_rate_hz);
  newest_delta_.reset();
  frame_ = 0;
  bundle_ = {};
  collecting_since_ns_.reset();
  snapshot_bytes_ = 0;
  status_.reset();
  for (auto& [id, viewer] : viewers_) {
    if (same_epoch) {
      viewer.now.flow = Viewer::Flow::kSilent;
      viewer.now.served_attempt.reset();
      viewer.now.passage = {};
      viewer.now.holds.reset();
      viewer.now.catches_up_from.reset();
    } else if (continues) {
      viewer.now = std::move(viewer.now).carried_over();
    } else {
      viewer.now = {};
    }
  }
  if (same_epoch) return;
  coming_inputs_.clear();
  settling_ = continues;
  if (!continues) return merger_.clear();
  merger_.carry_over(verdicts_);  // told in poll()
}

void Gateway::on_names(const transport::SessionMessage& session) {
  if (!session_) return;
  session_->names = session.names;
  if (alive_) announce(make_outgoing(*session_));
}

void Gateway::on_server_alive(bool alive) {
  if (alive == alive_ || !session_) return;
  alive_ = alive;
  if (alive) return announce(make_outgoing(*session_));
  announce(make_outgoing(transport::AbsentMessage{}));
}

void Gateway::on_status(const transport::ServerStatusMessage& status, std::int64_t now_ns) {
  if (!session_ || status.epoch != session_->epoch) return;
  status_ns_ = now_ns;
  status_ = make_outgoing(status);
  ++status_number_;
}

void Gateway::on_scheduled(const transport::ScheduledInputMessage& input, std::int64_t now_ns) {
  OutgoingPtr message = make_outgoing(input);
  coming_inputs_.push_back({input.number, message});
  if (coming_inputs_.size() > kMaxComingInputs) coming_inputs_.pop_front();
  log_.push_input(std::move(message), input.number, now_ns);
  grouping_.added(log_, now_ns);
}

void Gateway::on_applied(const client::CompleteDelta& delta, std::int64_t now_ns) {
  TANDEM_ASSERT(session_);
  if (delta.frame != frame_ + 1) bundle_ = {};  // it joined again in the midst of a message
  frame_ = delta.frame;
  std::erase_if(coming_inputs_,
                [&delta](const ComingInput& input) { return input.number <= delta.last_input; });
  bundle_.add(delta.frame, delta.hash, delta.payload);
  if (delta.more > 0) return;
  transport::DeltaMessage message = bundle_.take();
  message.epoch = session_->epoch;
  message.stream = session_->streams.front().id;
  message.last_input = delta.last_input;
  message.server_time_ns = delta.server_time_ns;
  newest_delta_ = log_.end();
  OutgoingPtr outgoing = make_outgoing(message);
  deltas_.add(transport::websocket_wire_bytes(outgoing->size()), now_ns);
  log_.push_delta(std::move(outgoing), delta.frame, delta.last_input, now_ns, message.earlier,
                  message.payload.size());
  grouping_.added(log_, now_ns);
}

// As a server does, and as seldom.
void Gateway::on_happened(const client::Happened& /*event*/, std::int64_t now_ns) {
  if (now_ns - hurried_ns_ < Grouping::kInputSpacingNs) return;
  hurried_ns_ = now_ns;
  for (auto& [id, viewer] : viewers_) viewer.now.hurries = true;
}

void Gateway::on_outcome(const client::InputOutcome& outcome, std::int64_t now_ns) {
  merger_.on_outcome(outcome, verdicts_);
  tell(verdicts_, now_ns);
}

std::optional<ViewerId> Gateway::admit(std::shared_ptr<accounts::TokenBucket> inputs, bool may_act) {
  if (viewers_.size() >= limits_.viewers) return std::nullopt;
  Viewer& viewer = viewers_[++last_id_];
  viewer.id = last_id_;
  viewer.may_act = may_act;
  viewer.address_inputs = std::move(inputs);
  ++counts_.joined;
  return last_id_;
}

InputTally Gateway::take_tally(ViewerId id) {
  const auto found = viewers_.find(id);
  return found == viewers_.end() ? InputTally() : std::exchange(found->second.tally, {});
}

void Gateway::leave(ViewerId id) { counts_.left += viewers_.erase(id); }

bool Gateway::reply_due(Viewer& viewer, std::int64_t now_ns) const {
  return viewer.now.heard && !settling_ && viewer.now.reply.due(role_of(viewer), now_ns);
}

LiveLog::Place Gateway::until(const Viewer& viewer) const {
  if (viewer.delay_steps == 0 || viewer.now.catches_up_from) return log_.end();
  return std::max(grouping_.released(viewer.delay_steps), viewer.now.not_waiting);
}

// A snapshot on its way is in front of the queue, so it alone does not make a viewer slow.
bool Gateway::is_behind(const Viewer& viewer, std::int64_t now_ns) const {
  const Viewer::InEpoch& state = viewer.now;
  if (state.place < log_.begin()) return true;
  if (state.place == log_.end() || state.catches_up_from || state.passage.unfinished()) return false;
  return now_ns - log_.time_ns(state.place) > kBehindNs + Grouping::delay_ns(viewer.delay_steps) &&
         snapshot_bytes_ > 0 && log_.bytes_from(state.place) > snapshot_bytes_;
}

void Gateway::resume(Viewer& viewer) {
  Viewer::InEpoch& state = viewer.now;
  TANDEM_ASSERT(state.holds && session_);
  if (*state.holds > frame_) return;
  const auto place = log_.after(*state.holds);
  if (place) ++counts_.resumed;
  // Where it cannot, the newest message shows it what it lacks.
  state.place = place ? *place : newest_delta_.value_or(log_.end());
  state.flow = Viewer::Flow::kFollowing;
  state.catches_up_from = place ? std::exchange(state.holds, std::nullopt) : std::nullopt;
  state.holds.reset();
}

void Gateway::skip(Viewer& viewer) {
  ++counts_.skips;
  Viewer::InEpoch& state = viewer.now;
  state.catches_up_from.reset();
  if (state.passage.unfinished()) {
    // It joins, and waits for a snapshot that is useless now.
    state.passage = {};
    state.flow = Viewer::Flow::kWaiting;
    return;
  }
  // The gap makes it join again.
  state.place = newest_delta_ && *newest_delta_ >= log_.begin() ? *newest_delta_ : log_.end();
}

bool Gateway::ready(Viewer& viewer, std::int64_t now_ns) const {
  if (viewer.told_announcement != announcement_number_ || reply_due(viewer, now_ns)) return true;
  if (viewer.now.passage.has_next(now_ns)) return true;
  if (viewer.now.flow == Viewer::Flow::kFollowing && viewer.now.place < until(viewer)) return true;
  return status_due(viewer, now_ns);
}

// Told to all viewers at once, it would delay a frame by as long as a frame takes.
bool Gateway::status_due(const Viewer& viewer, std::int64_t now_ns) const {
  if (!status_ || viewer.told_status == status_number_) return false;
  const auto turn = static_cast<std::int64_t>(viewer.id % kStatusTurns);
  return viewer.told_status == 0 || now_ns - status_ns_ >= turn * kStatusTurnNs;
}

void Gateway::list_ready(std::int64_t now_ns, std::vector<ViewerId>& out) {
  out.clear();
  for (auto& [id, viewer] : viewers_) {
    if (!ready(viewer, now_ns)) continue;
    if (!viewer.waiting_since_ns) viewer.waiting_since_ns = now_ns;
    out.push_back(id);
  }
}

bool Gateway::any_ready(std::int64_t now_ns) {
  return std::ranges::any_of(viewers_, [&](auto& entry) { return ready(entry.second, now_ns); });
}

void Gateway::list_not_reading(std::int64_t now_ns, std::vector<ViewerId>& out) const {
  out.clear();
  for (const auto& [id, viewer] : viewers_) {
    if (viewer.waiting_since_ns && now_ns - *viewer.waiting_since_ns > kNotReadingNs) out.push_back(id);
  }
}

// Without a session there is nothing to acknowledge.
void Gateway::list_silent(std::int64_t now_ns, std::vector<ViewerId>& out) {
  out.clear();
  for (auto& [id, viewer] : viewers_) {
    if (!alive_ || viewer.told_announcement != announcement_number_) {
      viewer.silent_since_ns.reset();
    } else if (!viewer.silent_since_ns) {
      viewer.silent_since_ns = now_ns;
    } else if (now_ns - *viewer.silent_since_ns > kSilentNs) {
      out.push_back(id);
    }
  }
}

void Gateway::list_over_cap(std::int64_t now_ns, std::vector<std::pair<ViewerId, std::string>>& out) {
  out.clear();
  for (auto& [id, viewer] : viewers_) {
    const double takes = viewer.cap.over_kbit_s(now_ns);
    if (takes <= 0) continue;
    out.emplace_back(id, "the session takes " + std::to_string(std::llround(takes)) +
                             " kbit/s, above the viewer's cap of " + std::to_string(viewer.cap.kbit_s()));
  }
}

double Gateway::deltas_bytes_per_s(std::int64_t now_ns) {
  return static_cast<double>(deltas_.in_two_seconds(now_ns).value_or(0)) / RecentBytes::kSeconds;
}

Gateway::Next Gateway::next(ViewerId id, std::int64_t now_ns) {
  const auto found = viewers_.find(id);
  if (found == viewers_.end()) return {};
  Viewer& viewer = found->second;
  viewer.waiting_since_ns.reset();
  if (viewer.now.flow == Viewer::Flow::kFollowing && is_behind(viewer, now_ns)) skip(viewer);
  OutgoingPtr message = take_next(viewer, now_ns);
  if (!message) return {};
  ++counts_.messages;
  counts_.bytes += message->size();
  viewer.cap.took(transport::websocket_wire_bytes(message->size()), now_ns);
  if (viewer.now.phase != transport::Phase::kPlaying || viewer.now.catches_up_from) viewer.cap.excuse();
  return {std::move(message), ready(viewer, now_ns)};
}

OutgoingPtr Gateway::take_next(Viewer& viewer, std::int64_t now_ns) {
  Viewer::InEpoch& state = viewer.now;
  if (viewer.told_announcement != announcement_number_) {
    viewer.told_announcement = announcement_number_;
    return announcement_;
  }
  if (reply_due(viewer, now_ns)) return reply(viewer, now_ns);
  if (state.passage.has_next(now_ns)) return state.passage.next(now_ns);
  if (const LiveLog::Place end = until(viewer); state.flow == Viewer::Flow::kFollowing && state.place < end) {
    if (viewer.delay_steps > 0 && !state.catches_up_from)
      return grouping_.take(log_, state.place, end, viewer.delay_steps);
    OutgoingPtr message = log_.at(state.place++);
    // What follows may be a frame that it has, between inputs that it may lack.
    while (state.catches_up_from && state.place != log_.end() && log_.frame(state.place) != 0 &&
           log_.frame(state.place) <= *state.catches_up_from)
      ++state.place;
    if (state.place == log_.end()) state.catches_up_from.reset();
    return message;
  }
  if (!status_due(viewer, now_ns)) return nullptr;
  viewer.told_status = status_number_;
  return status_;
}

OutgoingPtr Gateway::reply(Viewer& viewer, std::int64_t now_ns) const {
  Viewer::InEpoch& state = viewer.now;
  transport::ReplyMessage reply;
  reply.client = viewer.client;
  reply.epoch = session_->epoch;
  reply.role = role_of(viewer);
  reply.phase = state.phase;
  const bool demoted =
      viewer.may_act && reply.role != state.wanted && state.phase == transport::Phase::kPlaying;
  const Reason standing = demoted ? Reason::kDemoted : Reason::kNone;
  reply.reason = static_cast<std::uint32_t>(state.once != Reason::kNone ? state.once : standing);
  reply.highest_input = state.decided();
  // Without the server's time, an echo would be wrong.
  if (const auto server_ns = world_.server_time_ns(now_ns)) {
    reply.client_clock_ns = state.clock_ns;
    reply.server_time_ns = *server_ns;
  }
  state.outcomes.tell(reply, now_ns);
  state.reply.sent(reply.role, now_ns);
  if (std::exchange(state.once, Reason::kNone) ==
      Reason::kNone) {  // otherwise a viewer takes it for nothing else
    state.lost.clear();
    state.before.reset();
  }
  return make_outgoing(reply);
}

std::optional<std::int64_t> Gateway::cut_due_ns() const {
  if (!collecting_since_ns_) return std::nullopt;
  const std::int64_t spaced_ns = cut_at_ns_ ? *cut_at_ns_ + accounts::kSnapshotSpacingNs : INT64_MIN;
  return std::max(*collecting_since_ns_ + accounts::kGatewayTransfers.collect_ns, spaced_ns);
}

// All viewers that wait share one snapshot; live messages follow it.
void Gateway::cut(std::int64_t now_ns) {
  const auto made = world_.cut();
  if (!made) return;
  std::vector<OutgoingPtr> inputs;
  for (const ComingInput& input : coming_inputs_) {
    if (input.number > made->last_input) inputs.push_back(input.message);
  }
  const auto snapshot = std::make_shared<SnapshotParts>(*made, session_->epoch, std::move(inputs));
  frame_ = snapshot->frame;  // may come from a snapshot that the gateway itself received
  snapshot_bytes_ = snapshot->bytes;
  ++counts_.snapshots;
  for (auto& [id, viewer] : viewers_) {
    Viewer::InEpoch& state = viewer.now;
    if (state.flow != Viewer::Flow::kWaiting) continue;
    state.flow = Viewer::Flow::kFollowing;
    state.place = log_.end();
    state.passage = SnapshotPassage(snapshot, now_ns);
    state.passage.limit(viewer.cap.kbit_s(), deltas_bytes_per_s(now_ns));
    state.served_attempt = state.attempt;
  }
  collecting_since_ns_.reset();
  cut_at_ns_ = now_ns;
}

std::int64_t Gateway::poll(std::int64_t now_ns) {
  const Role granted = world_.role();
  grouping_.release(log_, now_ns);
  std::int64_t wake_ns = INT64_MAX;
  const bool role_changed = std::exchange(granted_, granted) != granted;
  for (auto& [id, viewer] : viewers_) {
    if (role_changed) viewer.now.reply.on_change();
    const SnapshotPassage& passage = viewer.now.passage;
    if (passage.unfinished() && (now_ns - passage.progress_ns() > accounts::kGatewayTransfers.stalled_ns ||
                                 now_ns - passage.began_ns() > accounts::kGatewayTransfers.longest_ns))
      viewer.now.passage = {};
    if (viewer.now.flow == Viewer::Flow::kWaiting && !collecting_since_ns_) collecting_since_ns_ = now_ns;
    if (viewer.now.holds) resume(viewer);
    viewer.adopt_delay(now_ns);
    viewer.cap.adopt(now_ns);
    if (viewer.cap.kbit_s() > 0 && passage.unfinished()) {
      viewer.now.passage.limit(viewer.cap.kbit_s(), deltas_bytes_per_s(now_ns));
      wake_ns = std::min(wake_ns, std::max(passage.next_ns(), now_ns + kMillisecond));
    }
    if (viewer.delay_steps == 0) continue;
    wake_ns = std::min(wake_ns, grouping_.due_ns(viewer.delay_steps));
    // Not in the midst of a message that is being applied.
    if (bundle_.empty() && std::exchange(viewer.now.hurries, false)) viewer.now.not_waiting = log_.end();
  }
  if (settling_ && world_.inputs_settled()) {
    settling_ = false;
    for (auto& [id, viewer] : viewers_) viewer.now.outcomes.renew(now_ns);
  }
  merger_.flush(world_, now_ns, verdicts_);
  tell(verdicts_, now_ns);
  if (const auto due_ns = cut_due_ns(); due_ns && now_ns >= *due_ns) cut(now_ns);
  counts_.inputs_sent = merger_.sent();
  // A cut that was not possible is tried again when the world moves on.
  const auto due_ns = cut_due_ns();
  if (due_ns && *due_ns > now_ns) wake_ns = std::min(wake_ns, *due_ns);
  if (merger_.waiting()) wake_ns = std::min(wake_ns, now_ns + 10 * kMillisecond);
  return wake_ns;
}

}  // namespace tandem::gateway
