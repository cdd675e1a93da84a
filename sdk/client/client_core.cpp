#include "sdk/client/client_core.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sdk/client/client_core_impl.hpp"
#include "sdk/client/session_check.hpp"

namespace tandem::client {
namespace {

constexpr std::size_t kMaxInputValues = 16;
constexpr std::size_t kMaxInputBytes = 1024;

std::string describe(std::uint32_t reason) {
  switch (static_cast<transport::Reason>(reason)) {
    case transport::Reason::kNone:
      return "";
    case transport::Reason::kObserver:
      return "observers may not send input";
    case transport::Reason::kDemoted:
      return "made an observer: it had delayed the others for too long";
    case transport::Reason::kInvalid:
      return "input refused: not finite, out of range or of an unknown kind";
    case transport::Reason::kRateLimited:
      return "input refused: too many a second";
    case transport::Reason::kStaleEpoch:
      return "input refused: of an earlier run of the server";
    case transport::Reason::kDuplicate:
      return "input refused: its number was handled before";
    case transport::Reason::kNotPlaying:
      return "input refused: this client was still joining";
    case transport::Reason::kForeignClient:
      return "the client id belongs to another participant";
    case transport::Reason::kProtocolVersion:
      return "the server speaks another protocol version";
    case transport::Reason::kFull:
      return "the server is full";
  }
  return "refused for reason " + std::to_string(reason);
}

}  // namespace

ClientCore::ClientCore(CoreOptions options, transport::ClientPort& port, CoreListener* listener)
    : impl_(std::make_unique<Impl>(std::move(options), port, listener)) {}
ClientCore::~ClientCore() = default;

std::int64_t ClientCore::poll(Now now) {
  Impl& self = *impl_;
  // After a pause of the process itself, what is late may be waiting outside: count it as one short wait.
  const std::int64_t since_ns =
      self.last_poll_ns == 0 ? 0
                             : std::clamp<std::int64_t>(now.steady_ns - self.last_poll_ns, 0, kMaxSleepNs);
  self.last_poll_ns = now.steady_ns;
  self.poll_began_ns = self.measure();
  self.server_alive = self.port.server_alive();
  self.take_sessions(now);
  if (self.epoch != nullptr) {
    self.take_stream(now);
    self.take_replies(now);
    if (self.epoch->joining) self.join(now);
    if (!self.epoch->joining) self.play(now, since_ns);
    if (self.epoch->joining) self.join(now);
    if (self.ack_due || now.steady_ns - self.last_ack_ns >= kAckRepeatNs) self.send_ack(now);
  }
  self.report_outcomes();
  if (now.steady_ns - self.last_status_ns >= kStatusPeriodNs) self.send_status(now);
  return self.next_due_ns(now);
}

void ClientCore::Impl::take_sessions(Now now) {
  sessions.clear();
  port.take_sessions(sessions);
  for (const auto& announcement : sessions) {
    const auto& message = announcement.message;
    if (message.session != options.session) continue;
    const bool same =
        session && session->epoch == message.epoch && (!epoch || epoch->server == announcement.from);
    if (!same) adopt(announcement, now);
  }
}

// A new epoch: everything of the old one is dropped, unseen.
void ClientCore::Impl::adopt(const transport::Received<transport::SessionMessage>& announcement, Now now) {
  port.close_snapshots();
  epoch.reset();
  sent.clear(outcomes);
  session = announcement.message;
  refusal.clear();
  listener.on_session(*session);
  auto config = check_session(*session);
  auto timeline = config ? ClientTimeline::create(*config) : tl::unexpected<Error>(config.error());
  if (!timeline) {
    ++statistics.refused_messages;
    refusal = timeline.error().message;
    log(LogLevel::kError, refusal);
    return;
  }
  epoch = std::make_unique<EpochState>(*session, announcement.from, std::move(*timeline), options.lead);
  epoch->join_began_ns = now.steady_ns;
  epoch->joiner.start(now.steady_ns);
  ++statistics.epochs;
  if (epoch->lead < options.lead) {
    log(LogLevel::kWarning, "lead " + std::to_string(options.lead) + " asked for, the session allows " +
                                std::to_string(epoch->lead));
  }
  log(LogLevel::kInfo, "found session '" + session->session + "', scene '" + session->scene + "', " +
                           std::to_string(session->layout.capacity) + " slots, epoch " +
                           std::to_string(session->epoch));
}

void ClientCore::Impl::take_replies(Now now) {
  replies.clear();
  port.take(replies);
  for (auto& received : replies) {
    if (received.message.client != options.id || !belongs(received)) continue;
    const transport::ReplyMessage& reply = received.message;
    epoch->pacer.on_echo(reply.server_time_ns, reply.client_clock_ns, now.steady_ns);
    sent.on_reply(reply, outcomes);
    if (!epoch->reply || epoch->reply->reason != reply.reason) {
      if (reply.reason != 0) log(LogLevel::kWarning, describe(reply.reason));
    }
    epoch->reply = std::move(received.message);
  }
}

void ClientCore::Impl::report_outcomes() {
  for (const InputOutcome& outcome : outcomes) {
    switch (outcome.kind) {
      case InputOutcome::Kind::kActed:
        ++statistics.inputs_acted;
        statistics.input_latency.add(outcome.latency_ns);
        break;
      case InputOutcome::Kind::kRefused:
        ++statistics.inputs_refused;
        break;
      case InputOutcome::Kind::kUnknown:
        ++statistics.inputs_unknown;
        break;
    }
    listener.on_outcome(outcome);
  }
  outcomes.clear();
}

void ClientCore::Impl::send_ack(Now now) {
  if (!epoch->joiner.asked()) return;
  transport::AckMessage ack;
  ack.client = options.id;
  ack.epoch = epoch->session.epoch;
  ack.phase = epoch->joining ? transport::Phase::kJoining : transport::Phase::kPlaying;
  if (!epoch->joining) {
    ack.applied = epoch->timeline.applied();
    ack.simulated = epoch->timeline.now();
  }
  ack.role_wanted = options.role;
  ack.clock_ns = now.steady_ns;
  ack.join_attempt = epoch->joiner.attempt();
  // A failed write is tried again at the next poll, as the acknowledgement stays due.
  ack_due = !port.write(ack).has_value();
  last_ack_ns = now.steady_ns;
}

void ClientCore::Impl::send_status(Now now) {
  const double elapsed_s = static_cast<double>(now.steady_ns - last_status_ns) / 1e9;
  const std::uint64_t bytes =
      statistics.payload_bytes - std::exchange(status_bytes, statistics.payload_bytes);
  transport::ClientStatusMessage status;
  status.client = options.id;
  status.session = options.session;
  if (epoch) {
    status.epoch = epoch->session.epoch;
    status.applied = epoch->joining ? 0 : epoch->timeline.applied();
    status.role = static_cast<std::uint32_t>(epoch->reply ? epoch->reply->role : transport::Role::kObserver);
    status.phase =
        static_cast<std::uint32_t>(epoch->joining ? transport::Phase::kJoining : transport::Phase::kPlaying);
  }
  status.lag_ms = statistics.smoothed_latency_ns / 1e6;
  status.client_ms_p50 = statistics.frame_cost.quantile_ms(0.5);
  status.mbit_per_s = last_status_ns == 0 ? 0 : static_cast<double>(bytes) * 8 / (1U << 20U) / elapsed_s;
  status.frames_applied = statistics.frames_applied;
  status.resyncs = statistics.resyncs;
  status.hash_mismatches = statistics.hash_mismatches;
  status.inputs_sent = statistics.inputs_sent;
  status.inputs_refused = statistics.inputs_refused;
  status.queue_high_water = static_cast<std::uint32_t>(statistics.queue_high_water);
  last_status_ns = now.steady_ns;
  // Best effort: one lost second of figures is made good by the next.
  static_cast<void>(port.write(status));
}

ClientPhase ClientCore::Impl::phase() const {
  if (epoch) return epoch->joining ? ClientPhase::kJoining : ClientPhase::kPlaying;
  return session ? ClientPhase::kRefused : ClientPhase::kSearching;
}

Result<std::uint64_t> ClientCore::send(transport::InputKind kind, std::vector<double> values,
                                       transport::Bytes bytes, Now now) {
  Impl& self = *impl_;
  if (self.options.role == transport::Role::kObserver) {
    return fail(ErrorCode::kOutOfOrder, "observers may not send input; connect as a participant");
  }
  if (self.phase() != ClientPhase::kPlaying)
    return fail(ErrorCode::kOutOfOrder, "input is possible while playing only");
  if (values.size() > kMaxInputValues || bytes.size() > kMaxInputBytes) {
    return fail(ErrorCode::kInvalidArgument, "an input holds at most 16 values and 1,024 bytes");
  }
  if (!std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); })) {
    return fail(ErrorCode::kInvalidArgument, "an input value is not finite");
  }
  transport::InputMessage input;
  input.client = self.options.id;
  input.epoch = self.epoch->session.epoch;
  input.number = self.sent.next_number();
  input.client_frame = self.epoch->timeline.now();
  input.kind = static_cast<std::uint32_t>(kind);
  input.values = std::move(values);
  input.bytes = std::move(bytes);
  if (auto written = self.port.write(input); !written) return tl::unexpected<Error>(written.error());
  self.sent.on_sent(now.steady_ns, self.outcomes);
  ++self.statistics.inputs_sent;
  return input.number;
}

ClientPhase ClientCore::phase() const { return impl_->phase(); }
const Statistics& ClientCore::statistics() const { return impl_->statistics; }
const transport::SessionMessage* ClientCore::session() const {
  return impl_->session ? &*impl_->session : nullptr;
}
const ClientTimeline* ClientCore::timeline() const {
  return impl_->phase() == ClientPhase::kPlaying ? &impl_->epoch->timeline : nullptr;
}
std::uint32_t ClientCore::join_attempt() const { return impl_->epoch ? impl_->epoch->joiner.attempt() : 0; }

ClientStatus ClientCore::status() const {
  const Impl& self = *impl_;
  const Statistics& figures = self.statistics;
  ClientStatus out;
  out.phase = self.phase();
  out.client_id = self.options.id;
  out.server_alive = self.server_alive;
  out.reason = self.refusal;
  if (self.session) {
    out.scene = self.session->scene;
    out.epoch = self.session->epoch;
    out.frame_rate_hz = self.session->frame_rate_hz;
  }
  if (self.epoch) {
    const EpochState& epoch = *self.epoch;
    if (epoch.reply) {
      out.role = epoch.reply->role == transport::Role::kParticipant ? ClientRole::kParticipant
                                                                    : ClientRole::kObserver;
      out.reason = describe(epoch.reply->reason);
    }
    out.lead = epoch.lead;
    if (!epoch.joining) {
      out.frame = epoch.timeline.applied();
      out.state_hash = epoch.timeline.hash();
    }
    out.round_trip_ms = static_cast<double>(epoch.pacer.clock().round_trip_ns()) / 1e6;
    out.jitter_ms = epoch.pacer.jitter_ms();
  }
  out.frames_applied = figures.frames_applied;
  out.resyncs = figures.resyncs;
  out.hash_mismatches = figures.hash_mismatches;
  out.refused_messages = figures.refused_messages + figures.foreign_messages + self.port.dropped();
  out.payload_bytes = figures.payload_bytes;
  out.mbit_per_s = figures.mbit_per_s();
  out.latency_ms_p50 = figures.latency.quantile_ms(0.5);
  out.latency_ms_p99 = figures.latency.quantile_ms(0.99);
  out.input_latency_ms_p50 = figures.input_latency.quantile_ms(0.5);
  out.input_latency_ms_p99 = figures.input_latency.quantile_ms(0.99);
  out.client_ms_p50 = figures.frame_cost.quantile_ms(0.5);
  out.client_ms_p99 = figures.frame_cost.quantile_ms(0.99);
  out.join_ms = static_cast<double>(figures.join_ns) / 1e6;
  out.inputs_sent = figures.inputs_sent;
  out.inputs_acted = figures.inputs_acted;
  out.inputs_refused = figures.inputs_refused;
  out.inputs_unknown = figures.inputs_unknown;
  out.queue_high_water = static_cast<std::uint32_t>(figures.queue_high_water);
  return out;
}

bool ClientCore::sample(Sample& out, SampleMode mode, Now now) {
  Impl& self = *impl_;
  // While joining again, the last state is still there to be drawn, as long as it is of this epoch.
  if (!self.epoch || !self.epoch->timeline.playing()) return false;
  self.epoch->sampler.sample(self.epoch->timeline, self.epoch->pacer, now.steady_ns, mode, out);
  out.epoch = self.epoch->session.epoch;
  return true;
}

}  // namespace tandem::client
