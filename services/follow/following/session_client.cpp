#include "services/follow/following/session_client.hpp"

#include <utility>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::following {

SessionClient::SessionClient(client::CoreOptions options, transport::ClientPort& port)
    : port_(port), core_(std::move(options), port, this) {}

std::int64_t SessionClient::poll(std::span<SessionSink* const> sinks, client::Now now) {
  TANDEM_ASSERT(!sinks.empty() && sinks_.empty());  // a sink does not poll
  sinks_ = sinks;
  now_ns_ = now.steady_ns;
  const std::int64_t due_ns = core_.poll(now);
  tell(&SessionSink::on_server_alive, port_.server_alive());
  if (untold_) {
    told_.reset();
    tell(&SessionSink::on_unplayed, *std::exchange(untold_, std::nullopt));
  }
  tell(&SessionSink::on_polled, now);
  sinks_ = {};
  return due_ns;
}

// The role until the server says otherwise; the server itself reports what it refuses.
transport::Role SessionClient::role() const {
  const transport::ReplyMessage* reply = core_.reply();
  return reply != nullptr ? reply->role : transport::Role::kParticipant;
}

std::optional<std::int64_t> SessionClient::server_time_ns(std::int64_t now_ns) const {
  return core_.server_wall_ns(now_ns);
}

std::optional<FollowedWorld::Cut> SessionClient::cut() {
  const ClientTimeline* timeline = core_.timeline();
  if (timeline == nullptr || !timeline->holds_state()) return std::nullopt;
  TANDEM_ASSERT(told_);
  Cut cut{.stream = told_->streams.front().id,
          .frame = timeline->applied(),
          .last_input = timeline->inputs_held(),
          .bytes = {}};
  timeline->snapshot(cut.bytes);
  return cut;
}

Result<std::uint64_t> SessionClient::send(transport::InputKind kind, std::vector<double> values,
                                          transport::Bytes bytes, std::int64_t now_ns) {
  return core_.send(kind, std::move(values), std::move(bytes), {.steady_ns = now_ns, .wall_ns = 0});
}

void SessionClient::report(const transport::ClientStatusMessage& status) {
  static_cast<void>(port_.write(status));
}

void SessionClient::on_session(const transport::SessionMessage& session) { untold_ = session; }

void SessionClient::on_names(const transport::SessionMessage& session) {
  if (untold_ || !told_) {
    untold_ = session;
    return;
  }
  told_->names = session.names;
  tell(&SessionSink::on_names, *told_);
}

void SessionClient::on_stream(const transport::StreamMessage& stream) {
  transport::SessionMessage told = untold_ ? *std::exchange(untold_, std::nullopt) : *core_.session();
  told.streams = {stream};
  told.streams.front().carries = stream.id.id;  // whoever is told knows no other
  // The server offers other streams besides the one that is played, which goes on.
  const bool goes_on = core_.phase() == ClientPhase::kPlaying && told_ && told.epoch == told_->epoch &&
                       told.streams == told_->streams;
  told_ = std::move(told);
  tell(goes_on ? &SessionSink::on_names : &SessionSink::on_session, *told_);
}

void SessionClient::on_server_status(const transport::ServerStatusMessage& status) {
  const std::uint32_t stream = told_ ? told_->streams.front().id.id : 0;
  if (status.stream == stream) tell(&SessionSink::on_status, status, now_ns_);
}

void SessionClient::on_resync(client::ResyncReason reason) { tell(&SessionSink::on_resync, reason); }

void SessionClient::on_snapshot(const transport::SnapshotMessage& snapshot) {
  tell(&SessionSink::on_snapshot, snapshot);
}

void SessionClient::on_scheduled(const transport::ScheduledInputMessage& input) {
  tell(&SessionSink::on_scheduled, input, now_ns_);
}

void SessionClient::on_happened(const client::Happened& event) {
  tell(&SessionSink::on_happened, event, now_ns_);
}

void SessionClient::on_applied(Epoch /*epoch*/, const client::CompleteDelta& delta) {
  tell(&SessionSink::on_applied, delta, now_ns_);
}

void SessionClient::on_outcome(const client::InputOutcome& outcome) {
  tell(&SessionSink::on_outcome, outcome, now_ns_);
}

}  // namespace tandem::following
