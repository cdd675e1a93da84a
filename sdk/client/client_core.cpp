#include "sdk/client/client_core.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sdk/client/session/history.hpp"
#include "sdk/client/session/reply_reason.hpp"
#include "sdk/client/session/session_check.hpp"
#include "sdk/core/lattice/hash.hpp"
#include "sdk/wire/limits.hpp"
#include "sdk/wire/plain_text.hpp"
#include "sdk/wire/units.hpp"

namespace tandem::client {
namespace {

constexpr std::int64_t kRecentNs = 3 * kSecond;  // what a server says each second still counts

// An acknowledgement is repeated after this time, so that the server hears from a client even if no frame
// comes.
constexpr std::int64_t kPlayingRepeatNs = kSecond;
constexpr std::int64_t kDeafRepeatNs = 4 * kSecond;  // no server hears it, and DDS repeats each many times
// Maximum sleep that poll() asks for, in general and while the client plays and misses nothing, when every
// event wakes it.
constexpr std::int64_t kMaxSleepNs = 50 * kMillisecond;
constexpr std::int64_t kMaxPlayingSleepNs = 500 * kMillisecond;
// If nothing comes from a server for so long while the client joins, another server may take its place.
constexpr std::int64_t kSilencePatienceNs = 10 * kSecond;
// If nothing comes from a server that lives for so long, one that continues its world takes its place. A
// server sends a status each second.
constexpr std::int64_t kQuietNs = 3 * kSecond / 2;

Drawable drawable(const Picture& picture) {
  return {picture.epoch, static_cast<std::uint32_t>(picture.agreed->alive.size()),
          picture.agreed->has_orientations()};
}

SampleColumns make_room(const Drawable& drawable, Sample& out) {
  out.epoch = drawable.epoch;
  out.capacity = drawable.capacity;
  out.positions.resize(std::size_t{3} * drawable.capacity);
  out.orientations.resize(drawable.has_orientations ? std::size_t{4} * drawable.capacity : 0);
  out.alive.resize(drawable.capacity);
  out.generation.resize(drawable.capacity);
  out.types.resize(drawable.capacity);
  out.changes.resize(drawable.capacity);
  SampleColumns columns{.capacity = drawable.capacity};
  columns.positions = packed(out.positions.data(), 3);
  columns.orientations = packed(out.orientations.data(), 4);
  columns.alive = packed(out.alive.data());
  columns.reuse = packed(out.generation.data());
  columns.types = packed(out.types.data());
  columns.changes = packed(reinterpret_cast<std::uint8_t*>(out.changes.data()));  // of that type
  return columns;
}

}  // namespace

ClientCore::ClientCore(CoreOptions options, transport::ClientPort& port, CoreListener* listener)
    : options_(std::move(options)),
      preference_(read_preference(options_.prefer)),
      port_(port),
      listener_(listener != nullptr ? *listener : silent_),
      status_report_(options_.role == transport::Role::kObserver ? 2 * kSecond : kSecond) {}

std::int64_t ClientCore::poll(Now now) {
  // After a pause of this process late messages may still wait to be read: counts the pause as one short
  // wait.
  const std::int64_t slept_ns = last_poll_ns_ == 0 ? 0 : now.steady_ns - last_poll_ns_;
  const std::int64_t since_ns = std::clamp<std::int64_t>(slept_ns, 0, kMaxSleepNs);
  last_poll_ns_ = now.steady_ns;
  poll_began_ns_ = measure();
  server_alive_ = port_.server_alive();
  tell_trouble();
  if (const auto id = port_.take_renewal()) begin_under(*id);
  if (epoch_ != nullptr && epoch_->played->joining() &&
      (epoch_->silence_ns += since_ns) >= kSilencePatienceNs) {
    epoch_->silence_ns = 0;
    port_.pass_over_session(transport::PassOver::kWhileThereIsAnother);
  }
  if (epoch_ != nullptr) leave_silent(std::clamp<std::int64_t>(slept_ns, 0, kMaxPlayingSleepNs));
  take_sessions(now);
  if (epoch_ != nullptr) leave_unplayable(now);
  if (epoch_ != nullptr) {
    take_stream(now);
    take_replies(now);
    take_statuses(now);
    if (statistics_.frames_applied > 0) statistics_.costs.receive_ns += measure() - poll_began_ns_;
    if (epoch_->played->joining()) begin(now);
    epoch_->played->keep_state(options_.keeps_state, now.steady_ns);
    if (!epoch_->played->joining()) play(now, since_ns);
    if (epoch_->played->fetching()) fetch_state(now);
    if (epoch_->played->joining()) begin(now);
    consider_streams(now);
    show_clock();
    if (ack_due_ || now.steady_ns >= next_ack_ns()) send_ack(now);
    if (options_.prepares) prepare_next();
  }
  report_outcomes();
  if (now.steady_ns >= status_report_.due_ns()) send_status(now);
  return next_due_ns(now);
}

std::int64_t ClientCore::next_due_ns(Now now) const {
  const bool calm =
      epoch_ != nullptr && !epoch_->change && !epoch_->played->joining() && !epoch_->played->misses_input();
  std::int64_t due =
      std::min(now.steady_ns + (calm ? kMaxPlayingSleepNs : kMaxSleepNs), status_report_.due_ns());
  if (epoch_ != nullptr && !epoch_->is_chosen) {
    due = std::min(due, choice_due_ns_);
  } else if (epoch_ != nullptr) {
    due = std::min(due, next_ack_ns());
    if (epoch_->change && epoch_->change->to().joining())
      due = std::min(due, epoch_->change->to().next_due_ns());
    if (epoch_->played->fetching()) due = std::min(due, epoch_->played->next_due_ns());
    if (epoch_->played->joining()) {
      due = std::min(due, epoch_->played->next_due_ns());
    } else if (epoch_->played->front() != nullptr && !epoch_->played->misses_input()) {
      due = now.steady_ns;  // there are more frames than one poll applies
    } else if (pictures_.wanted() && epoch_->pacer.known() &&
               epoch_->played->timeline().now() < epoch_->played->timeline().applied() + epoch_->lead) {
      due = std::min(due, epoch_->pacer.due_ns(epoch_->played->timeline().now() + 1));
    }
  }
  // The result is never in the past and never causes a busy loop, whatever the estimates are.
  return std::max(due, now.steady_ns + kMillisecond / 2);
}

void ClientCore::tell_trouble() {
  std::string trouble = port_.trouble();
  if (trouble == trouble_) return;
  trouble_ = std::move(trouble);
  if (!trouble_.empty()) log(LogLevel::kWarning, trouble_);
}

// The announcement comes again, and who sends it goes on with the epoch: most likely the same server.
void ClientCore::begin_under(transport::ClientId id) {
  options_.id = id;
  session_from_ = {};
  if (epoch_ != nullptr) {
    epoch_->server = {};
    epoch_->unproven = false;
    epoch_->quiet_ns = 0;
  }
  log(LogLevel::kInfo, "joined the network anew, as client " + to_hex(id));
}

// Acknowledgements are rare if the server does not wait for them (idl/STATES.md, "Acknowledgements"), because
// each costs more bytes than many a delta.
std::int64_t ClientCore::next_ack_ns() const {
  const EpochState& e = *epoch_;
  if (e.played->joining()) return last_ack_ns_ + e.played->repeat_ns();
  const std::int64_t changing_ns = e.change               ? last_ack_ns_ + e.change->to().repeat_ns()
                                   : e.played->fetching() ? last_ack_ns_ + e.played->repeat_ns()
                                                          : INT64_MAX;
  if (options_.role == transport::Role::kObserver)
    return std::min(changing_ns, last_ack_ns_ + 2 * kPlayingRepeatNs);
  const std::int64_t repeat_ns =
      std::min(changing_ns, last_ack_ns_ + (server_alive_ ? kPlayingRepeatNs : kDeafRepeatNs));
  if (e.played->timeline().applied() == acknowledged_) return repeat_ns;
  const double period_ns = 1e9 / e.session.frame_rate_hz;
  if (e.played->timeline().applied() - acknowledged_ >= transport::ack_spacing(e.session.window_ceiling))
    return last_ack_ns_;
  // If no further delta comes, the server may be waiting.
  const auto quiet_ns = statistics_.last_applied_ns + static_cast<std::int64_t>(1.25 * period_ns);
  return std::min({repeat_ns, last_ack_ns_ + transport::kAckSpacingNs, quiet_ns});
}

// DDS may go on for a server that hangs. A participant that only announces another's epoch is no server.
void ClientCore::leave_silent(std::int64_t since_ns) {
  epoch_->quiet_ns += since_ns;
  if (epoch_->quiet_ns < kQuietNs) return;
  if (epoch_->unproven) server_alive_ = false;
  port_.pass_over_session(epoch_->unproven ? transport::PassOver::kWhileThereIsAnother
                                           : transport::PassOver::kForItsSuccessor);
}

void ClientCore::take_sessions(Now now) {
  do {
    inbox_.sessions.clear();
    port_.take_sessions(inbox_.sessions);
    for (auto& announcement : inbox_.sessions) {
      auto& message = announcement.message;
      if (!options_.session.empty() && message.session != options_.session) continue;
      if (message.server_role != transport::ServerRole::kLive) continue;
      const bool same = session_ && session_->epoch == message.epoch && session_from_ == announcement.from;
      const bool other_streams = same && message.streams != session_->streams;
      if (!same && may_go_on_with(message)) {
        go_on_with(announcement, now);
      } else if (!same || (other_streams && !epoch_)) {
        adopt(announcement, now);
      } else if (other_streams) {
        adopt_streams(message, now);
      } else {
        adopt_names(std::move(message.names));
      }
      if (!epoch_) port_.pass_over_session(transport::PassOver::kUntilAnnouncedAnew);
    }
    // If a session cannot be played, the next one is tried. Each is tried once, so this ends.
  } while (!epoch_ && !inbox_.sessions.empty());
}

// Starts a new epoch: everything of the old one is dropped without being read.
void ClientCore::adopt(const transport::Received<transport::SessionMessage>& announcement, Now now) {
  const bool twin = session_ && session_->epoch == announcement.message.epoch &&
                    session_from_ != announcement.from && session_from_ != transport::ParticipantId{};
  note_imitator();
  port_.close_streams();
  join_attempts_ = join_attempt();
  epoch_.reset();
  pictures_.clear();
  if (const auto shared = session_ ? shared_history(*session_, announcement.message) : std::nullopt) {
    sent_.carry_over(announcement.message.epoch, *shared,
                     session_->continues_epoch == announcement.message.epoch);
  } else {
    sent_.clear(announcement.message.epoch, outcomes_);
  }
  session_ = announcement.message;
  session_from_ = announcement.from;
  refusal_.clear();
  listener_.on_session(*session_);
  auto chosen = choose_stream(*session_, now);
  if (!chosen) {
    refuse(chosen.error());
    return;
  }
  epoch_ = std::make_unique<EpochState>(*session_, announcement.from, std::move(*chosen), options_.lead,
                                        pictures_);
  epoch_->join_began_ns = now.steady_ns;
  epoch_->unproven = twin;
  ++statistics_.epochs;
  if (epoch_->lead < options_.lead) {
    log(LogLevel::kWarning, "the session allows a lead of " + std::to_string(epoch_->lead) + ", not " +
                                std::to_string(options_.lead));
  }
  log(LogLevel::kInfo, "found session '" + session_->session + "', scene '" + session_->scene + "', " +
                           std::to_string(session_->capacity) + " slots, epoch " +
                           std::to_string(session_->epoch));
}

// A relay that takes over from another, or was restarted, publishes the same epoch from another participant;
// a gateway announces it over another connection.
bool ClientCore::may_go_on_with(const transport::SessionMessage& announced) const {
  if (epoch_ == nullptr || epoch_->played->joining() || !port_.hears_all_servers()) return false;
  transport::SessionMessage renamed = announced;
  renamed.names = session_->names;
  return renamed == *session_;
}

// Called when another server is followed than before.
void ClientCore::note_imitator() {
  if (!epoch_ || !epoch_->unproven || std::exchange(imitated_, session_->epoch) == session_->epoch) return;
  log(LogLevel::kWarning, "who announced the server's epoch sent nothing: it is no server, and is left");
}

// Nothing that is held is dropped: its first frames are those that the other may not have published any more.
// Where they are later than that, the client finds a gap and joins again.
void ClientCore::go_on_with(transport::Received<transport::SessionMessage>& announcement, Now now) {
  note_imitator();
  const bool is_another = session_from_ != transport::ParticipantId{};  // not after begin_under()
  if (is_another && !epoch_->unproven)
    log(LogLevel::kInfo, "another server goes on with session '" + session_->session + "', epoch " +
                             std::to_string(session_->epoch));
  session_from_ = epoch_->server = announcement.from;
  epoch_->unproven = is_another;
  epoch_->reply.reset();
  epoch_->silence_ns = epoch_->quiet_ns = 0;
  ack_due_ = true;
  sent_.on_another_server(outcomes_);
  adopt_names(std::move(announcement.message.names));
  take_early(now);
}

void ClientCore::adopt_names(std::vector<transport::BodyName> names) {
  if (names == session_->names) return;
  session_->names = std::move(names);
  listener_.on_names(*session_);
}

void ClientCore::refuse(const Error& why) {
  port_.close_streams();
  join_attempts_ = join_attempt();
  epoch_.reset();
  pictures_.clear();
  sent_.clear(0, outcomes_);
  ++statistics_.refused_messages;
  refusal_ = why.message;
  log(LogLevel::kError, refusal_);
}

void ClientCore::take_replies(Now now) {
  inbox_.replies.clear();
  port_.take(inbox_.replies);
  for (auto& received : inbox_.replies) {
    if (received.message.client != options_.id || !belongs(received)) continue;
    const transport::ReplyMessage& reply = received.message;
    epoch_->pacer.on_echo(reply.server_time_ns, reply.client_clock_ns, now.steady_ns);
    sent_.on_reply(reply, outcomes_);
    if (!epoch_->reply || epoch_->reply->reason != reply.reason) {
      if (reply.reason != 0) log(LogLevel::kWarning, describe(reply.reason));
    }
    epoch_->reply = std::move(received.message);
  }
}

void ClientCore::report_outcomes() {
  for (const InputOutcome& outcome : outcomes_) {
    switch (outcome.kind) {
      case InputOutcome::Kind::kActed:
        ++statistics_.inputs_acted;
        statistics_.input_latency.add(outcome.latency_ns);
        break;
      case InputOutcome::Kind::kRefused:
        ++statistics_.inputs_refused;
        break;
      case InputOutcome::Kind::kUnknown:
      case InputOutcome::Kind::kLost:
        ++statistics_.inputs_unknown;
        break;
    }
    if (epoch_) epoch_->echo.on_over(outcome.number);
    listener_.on_outcome(outcome);
  }
  outcomes_.clear();
}

void ClientCore::send_ack(Now now) {
  EpochState& e = *epoch_;
  const bool changes = e.change && e.change->to().asked();
  Follower& joined = changes ? e.change->to() : *e.played;
  const bool fetches = !changes && joined.fetching() && joined.asked();
  if (!joined.asked() && !joined.fetching()) return;
  transport::AckMessage ack;
  ack.client = options_.id;
  ack.epoch = e.session.epoch;
  ack.stream = joined.stream().id;
  const bool joins = changes || fetches || e.played->joining();
  ack.phase = joins ? transport::Phase::kJoining : transport::Phase::kPlaying;
  if (joins) joined.tell_progress(ack);
  // A client that changes its stream, or fetches a state of it, acknowledges both the incoming snapshot and
  // the last frame that it played.
  if (!e.played->joining()) {
    ack.applied = acknowledged_ = e.played->timeline().applied();
    ack.simulated = e.played->timeline().now();
  }
  ack.role_wanted = options_.role;
  ack.clock_ns = now.steady_ns;
  ack.join_attempt = joined.join_attempt();
  const std::int64_t began_ns = measure();
  // A failed write is tried again at the next poll, because the acknowledgement stays due.
  ack_due_ = !port_.write(ack).has_value();
  if (statistics_.frames_applied > 0) statistics_.costs.acknowledge_ns += measure() - began_ns;
  last_ack_ns_ = now.steady_ns;
}

void ClientCore::send_status(Now now) {
  transport::ClientStatusMessage status = status_report_.next(statistics_, now.steady_ns);
  status.client = options_.id;
  status.session = session_ ? session_->session : options_.session;
  statistics_.recent_cost.clear();
  if (epoch_) {
    const double period_ms = 1e3 / epoch_->session.frame_rate_hz;
    const bool too_slow = status.client_ms_p50 > period_ms / 2;
    status.too_slow = too_slow ? 1 : 0;
    if (too_slow && !std::exchange(epoch_->told_too_slow, true)) {
      log(LogLevel::kWarning, "this client is too slow for the session: half of its frames take more than " +
                                  std::to_string(std::lround(status.client_ms_p50)) + " of " +
                                  std::to_string(std::lround(period_ms)) + " ms");
    }
    status.epoch = epoch_->session.epoch;
    status.stream = epoch_->played->stream().id;
    status.stream_reason = transport::plain_text(chooser_->reason(), transport::kMaxReasonBytes);
    status.applied = epoch_->played->joining() ? 0 : epoch_->played->timeline().applied();
    status.role =
        static_cast<std::uint32_t>(epoch_->reply ? epoch_->reply->role : transport::Role::kObserver);
    status.phase = static_cast<std::uint32_t>(epoch_->played->joining() ? transport::Phase::kJoining
                                                                        : transport::Phase::kPlaying);
  }
  // Best effort: the next figures replace a lost second.
  static_cast<void>(port_.write(status));
}

ClientPhase ClientCore::phase() const {
  if (epoch_) return epoch_->played->joining() ? ClientPhase::kJoining : ClientPhase::kPlaying;
  return session_ ? ClientPhase::kRefused : ClientPhase::kSearching;
}

Result<std::uint64_t> ClientCore::send(transport::InputKind kind, std::vector<double> values,
                                       transport::Bytes bytes, Now now) {
  if (options_.role == transport::Role::kObserver) {
    return fail(ErrorCode::kOutOfOrder, "observers may not send input; connect as a participant");
  }
  if (phase() != ClientPhase::kPlaying)
    return fail(ErrorCode::kOutOfOrder, "a client can send input only while it plays");
  if (values.size() > transport::kMaxInputValues || bytes.size() > transport::kMaxInputBytes) {
    return fail(ErrorCode::kInvalidArgument, "an input holds at most 16 values and 1,024 bytes");
  }
  if (!std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); })) {
    return fail(ErrorCode::kInvalidArgument, "an input value is not finite");
  }
  transport::InputMessage input;
  input.client = options_.id;
  input.epoch = epoch_->session.epoch;
  input.number = sent_.next_number();
  input.client_frame = epoch_->played->timeline().now();
  input.kind = static_cast<std::uint32_t>(kind);
  input.values = std::move(values);
  input.bytes = std::move(bytes);
  if (auto written = port_.write(input); !written) return tl::unexpected<Error>(written.error());
  sent_.on_sent(now.steady_ns, outcomes_);
  ++statistics_.inputs_sent;
  if (options_.echo && kind == transport::InputKind::kGravity) echo(input, now);
  return input.number;
}

void ClientCore::echo(const transport::InputMessage& gravity, Now now) {
  EpochState& e = *epoch_;
  if (gravity.values.size() != kPositionChannels || !e.pacer.known()) return;
  // Lattice velocities are in 1/64 of the lattice unit.
  const double scale = 64 * e.session.dt_s * e.session.dt_s / e.session.lattice_unit;
  std::array<float, kPositionChannels> in_lattice{};
  for (std::size_t axis = 0; axis < kPositionChannels; ++axis) {
    constexpr double kMost = kVelocityLimit;
    in_lattice[axis] = static_cast<float>(std::clamp(gravity.values[axis] * scale, -kMost, kMost));
  }
  e.echo.on_sent(gravity.number, in_lattice, e.pacer.server_frame(now.steady_ns));
  show_clock();
}

void ClientCore::show_clock() {
  EpochState& e = *epoch_;
  if (!e.played->joining()) e.echo.on_simulated(e.played->timeline().now());
  e.pictures.on_echo(e.echo.shown());
  e.pictures.on_clock(e.pacer);
}

const transport::SessionMessage* ClientCore::session() const { return session_ ? &*session_ : nullptr; }
const transport::StreamMessage* ClientCore::stream() const {
  return epoch_ ? &epoch_->played->stream() : nullptr;
}
std::string_view ClientCore::body_name(Slot slot) const {
  const ClientTimeline* const held = timeline();
  if (held == nullptr || slot >= session_->capacity) return {};
  const State& state = held->state(held->applied());
  const auto& names = session_->names;
  const auto found = std::lower_bound(names.begin(), names.end(), slot,
                                      [](const transport::BodyName& name, Slot s) { return name.slot < s; });
  const bool named = found != names.end() && found->slot == slot && state.alive()[slot] != 0 &&
                     found->reuse == state.reuse()[slot];
  return named ? std::string_view(found->name) : std::string_view();
}
const ClientTimeline* ClientCore::timeline() const {
  return phase() == ClientPhase::kPlaying ? &epoch_->played->timeline() : nullptr;
}
bool ClientCore::holds_state() const {
  return phase() == ClientPhase::kPlaying && epoch_->played->timeline().holds_state();
}
const transport::ReplyMessage* ClientCore::reply() const {
  return epoch_ && epoch_->reply ? &*epoch_->reply : nullptr;
}
std::optional<std::int64_t> ClientCore::server_wall_ns(std::int64_t steady_ns) const {
  if (!epoch_ || !epoch_->pacer.clock().known()) return std::nullopt;
  return steady_ns + epoch_->pacer.clock().offset_ns();
}
std::uint32_t ClientCore::join_attempt() const {
  if (!epoch_) return join_attempts_;
  const std::uint32_t played = epoch_->played->join_attempt();
  return epoch_->change ? std::max(played, epoch_->change->to().join_attempt()) : played;
}

ClientStatus ClientCore::status() const {
  ClientStatus out = figures(statistics_);
  out.phase = phase();
  out.client_id = options_.id;
  out.server_alive = server_alive_;
  out.reason = trouble_.empty() ? refusal_ : trouble_;
  out.refused_messages += port_.dropped();
  if (session_) {
    out.scene = session_->scene;
    out.epoch = session_->epoch;
    out.frame_rate_hz = session_->frame_rate_hz;
  }
  if (!epoch_) return out;
  if (epoch_->reply) {
    out.role = epoch_->reply->role == transport::Role::kParticipant ? ClientRole::kParticipant
                                                                    : ClientRole::kObserver;
    if (trouble_.empty()) out.reason = describe(epoch_->reply->reason);
  }
  out.lead = epoch_->lead;
  out.stream = chooser_->chosen().name;
  out.stream_reason = chooser_->reason();
  if (!epoch_->played->joining()) {
    out.frame = epoch_->played->timeline().applied();
    out.state_hash = epoch_->played->timeline().hash();
  }
  out.round_trip_ms = static_cast<double>(epoch_->pacer.clock().round_trip_ns()) / 1e6;
  out.jitter_ms = epoch_->pacer.jitter_ms();
  return out;
}

std::optional<bool> ClientCore::server_makes_frames(std::int64_t now_ns) const {
  if (epoch_ == nullptr || now_ns - told_ns_ >= kRecentNs) return std::nullopt;
  return makes_frames_;
}

bool ClientCore::frames_are_due(std::int64_t now_ns) const {
  return server_makes_frames(now_ns).value_or(false) && now_ns - part_ns_ >= kRecentNs;
}

void ClientCore::start_sampling() {
  if (pictures_.wanted()) return;
  if (epoch_ && epoch_->has_loaded)
    epoch_->pictures.on_loaded(epoch_->played->timeline(), epoch_->pacer, last_poll_ns_);
  pictures_.want();  // last, so that the next call tries again if there was no memory for a first picture
}

std::optional<Drawable> ClientCore::drawable() {
  const PictureExchange::Reading reading(pictures_);
  if (reading.picture() == nullptr) return std::nullopt;
  return client::drawable(*reading.picture());
}

void ClientCore::show_uncorrected(bool on) {
  if (on == shows_uncorrected_) return;
  shows_uncorrected_ = on;
  if (epoch_ && !epoch_->played->joining()) follow_uncorrected();
}

std::optional<Drift> ClientCore::drift() const {
  if (phase() != ClientPhase::kPlaying || !epoch_->uncorrected) return std::nullopt;
  return epoch_->uncorrected->drift();
}

// While the client rejoins, the last picture can still be drawn if it is of this epoch.
Result<SampledFrame> ClientCore::sample(const SampleRequest& request, const SampleColumns& columns, Now now) {
  const PictureExchange::Reading reading(pictures_);
  if (reading.picture() == nullptr) return fail(ErrorCode::kOutOfOrder, "nothing to draw");
  return sampler_.sample(*reading.picture(), request, columns, now.steady_ns, options_.run_blocks);
}

bool ClientCore::sample(Sample& out, SampleMode mode, Now now) {
  const PictureExchange::Reading reading(pictures_);
  if (reading.picture() == nullptr) return false;
  const SampleColumns columns = make_room(client::drawable(*reading.picture()), out);
  const auto sampled =
      sampler_.sample(*reading.picture(), {.mode = mode}, columns, now.steady_ns, options_.run_blocks);
  if (sampled) out.frame = sampled->frame;
  return sampled.has_value();
}

}  // namespace tandem::client
