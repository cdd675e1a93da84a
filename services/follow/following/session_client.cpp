#include "services/follow/following/session_client.hpp"

#include <utility>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::following {

SessionClient::SessionClient(client::CoreOptions options, transport::ClientPort& port)
    : port_(port), core_(std::move(options), port, this) {}

std::int64_t SessionClient::poll(SessionSink& sink, client::Now now) {
  TANDEM_ASSERT(sink_ == nullptr);  // a sink does not poll
  sink_ = &sink;
  now_ns_ = now.steady_ns;
  const std::int64_t due_ns = core_.poll(now);
  sink.on_server_alive(port_.server_alive());
  if (untold_) sink.on_session(*std::exchange(untold_, std::nullopt));
  sink_ = nullptr;
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
  Cut cut{
      .stream = stream_.id, .frame = timeline->applied(), .last_input = timeline->inputs_held(), .bytes = {}};
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

// Viewers are told of the one stream that exists for them. If it cannot be played, they give the reason
// themselves.
void SessionClient::on_session(const transport::SessionMessage& session) { untold_ = session; }

void SessionClient::on_names(const transport::SessionMessage& session) {
  if (untold_) untold_->names = session.names;
  sink_->on_names(session.names);
}

void SessionClient::on_stream(const transport::StreamMessage& stream) {
  transport::SessionMessage told = untold_ ? *std::exchange(untold_, std::nullopt) : *core_.session();
  told.streams = {stream};
  // The server offers other streams besides the one that is played, which goes on.
  const bool goes_on = core_.phase() == ClientPhase::kPlaying && told.epoch == epoch_ && stream == stream_;
  if (goes_on) return sink_->on_names(told.names);
  epoch_ = told.epoch;
  stream_ = stream;
  sink_->on_session(told);
}

void SessionClient::on_server_status(const transport::ServerStatusMessage& status) {
  if (status.stream == stream_.id.id) sink_->on_status(status, now_ns_);
}

void SessionClient::on_snapshot(const transport::SnapshotMessage& snapshot) {
  sink_->on_snapshot(snapshot.frame);
}

void SessionClient::on_scheduled(const transport::ScheduledInputMessage& input) {
  sink_->on_scheduled(input, now_ns_);
}

void SessionClient::on_applied(Epoch /*epoch*/, const client::CompleteDelta& delta) {
  sink_->on_applied(delta, now_ns_);
}

void SessionClient::on_outcome(const client::InputOutcome& outcome) { sink_->on_outcome(outcome, now_ns_); }

}  // namespace tandem::following
