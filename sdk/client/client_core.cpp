#include "sdk/client/client_core.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sdk/client/session/history.hpp"
#include "sdk/client/session/reply_reason.hpp"
#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/lattice/hash.hpp"
#include "sdk/wire/limits.hpp"
#include "sdk/wire/units.hpp"

namespace tandem::client {
namespace {

constexpr std::int64_t kRecentNs = 3 * kSecond;  // what a server says each second still counts
// Maximum sleep that poll() asks for, in general and while the client plays and misses nothing, when every
// event wakes it.
constexpr std::int64_t kMaxSleepNs = 50 * kMillisecond;
constexpr std::int64_t kMaxPlayingSleepNs = 500 * kMillisecond;

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
    : lasting_(std::move(options), port, listener != nullptr ? *listener : silent_),
      status_report_(lasting_.options.role == transport::Role::kObserver ? 2 * kSecond : kSecond) {}

std::int64_t ClientCore::poll(Now now) {
  // After a pause of this process late messages may still wait to be read: counts the pause as one short
  // wait.
  const std::int64_t slept_ns = last_poll_ns_ == 0 ? 0 : now.steady_ns - last_poll_ns_;
  const std::int64_t since_ns = std::clamp<std::int64_t>(slept_ns, 0, kMaxSleepNs);
  last_poll_ns_ = now.steady_ns;
  lasting_.poll_began_ns = lasting_.measure();
  // One that is back, or has taken over, does not know who plays which stream.
  const bool was_alive = std::exchange(lasting_.server_alive, lasting_.port.server_alive());
  if (lasting_.server_alive && !was_alive) lasting_.ack_due = true;
  tell_trouble();
  if (const auto id = lasting_.port.take_renewal()) begin_under(*id);
  if (epoch_) epoch_->count_silence(since_ns, std::clamp<std::int64_t>(slept_ns, 0, kMaxPlayingSleepNs));
  take_sessions(now);
  if (epoch_) {
    if (const auto good = epoch_->leave_unplayable(now); !good) {
      refuse(good.error());
      lasting_.port.pass_over_session(transport::PassOver::kUntilAnnouncedAnew);
    }
  }
  if (epoch_) epoch_->poll(now, since_ns);
  report_outcomes();
  lasting_.statistics.wire_bytes = lasting_.port.wire_bytes(now.steady_ns);
  lasting_.statistics.wire_ns = now.steady_ns;
  if (now.steady_ns >= status_report_.due_ns()) send_status(now);
  return next_due_ns(now);
}

std::int64_t ClientCore::next_due_ns(Now now) const {
  const bool calm = epoch_ && epoch_->is_calm();
  std::int64_t due =
      std::min(now.steady_ns + (calm ? kMaxPlayingSleepNs : kMaxSleepNs), status_report_.due_ns());
  if (epoch_) due = std::min(due, epoch_->next_due_ns(now));
  // The result is never in the past and never causes a busy loop, whatever the estimates are.
  return std::max(due, now.steady_ns + kMillisecond / 2);
}

void ClientCore::tell_trouble() {
  std::string trouble = lasting_.port.trouble();
  if (trouble == trouble_) return;
  trouble_ = std::move(trouble);
  if (!trouble_.empty()) lasting_.log(LogLevel::kWarning, trouble_);
}

// The announcement comes again, and who sends it goes on with the epoch: most likely the same server.
void ClientCore::begin_under(transport::ClientId id) {
  lasting_.options.id = id;
  session_from_ = {};
  if (epoch_) epoch_->expect_announcement();
  lasting_.log(LogLevel::kInfo, "joined the network anew, as client " + to_hex(id));
}

void ClientCore::take_sessions(Now now) {
  do {
    announcements_.clear();
    lasting_.port.take_sessions(announcements_);
    for (auto& announcement : announcements_) take(announcement, now);
    // If a session cannot be played, the next one is tried. Each is tried once, so this ends.
  } while (!epoch_ && !announcements_.empty());
}

void ClientCore::take(transport::Received<transport::SessionMessage>& announcement, Now now) {
  auto& message = announcement.message;
  if (!lasting_.options.session.empty() && message.session != lasting_.options.session) return;
  if (message.server_role != transport::ServerRole::kLive) return;
  const bool same = session_ && session_->epoch == message.epoch && session_from_ == announcement.from;
  const bool other_streams = same && message.streams != session_->streams;
  if (!same && may_go_on_with(message)) {
    go_on_with(announcement, now);
  } else if (!same || (other_streams && !epoch_)) {
    adopt(announcement, now);
  } else if (other_streams) {
    session_ = message;
    if (const auto good = epoch_->adopt_streams(message, now); !good) refuse(good.error());
  } else {
    adopt_names(std::move(message.names));
  }
  if (!epoch_) lasting_.port.pass_over_session(transport::PassOver::kUntilAnnouncedAnew);
}

void ClientCore::end_epoch() {
  lasting_.port.close_streams();
  lasting_.join_attempts = join_attempt();
  epoch_.reset();
  lasting_.pictures.clear();
}

// Starts a new epoch: everything of the old one is dropped without being read.
void ClientCore::adopt(const transport::Received<transport::SessionMessage>& announcement, Now now) {
  const bool twin = session_ && session_->epoch == announcement.message.epoch &&
                    session_from_ != announcement.from && session_from_ != transport::ParticipantId{};
  note_imitator();
  end_epoch();
  const auto shared = session_ ? shared_history(*session_, announcement.message) : std::nullopt;
  if (shared) {
    lasting_.sent.carry_over(announcement.message.epoch, *shared,
                             session_->continues_epoch == announcement.message.epoch);
  } else {
    lasting_.sent.clear(announcement.message.epoch, lasting_.outcomes);
  }
  session_ = announcement.message;
  session_from_ = announcement.from;
  refusal_.clear();
  lasting_.listener.on_session(*session_);
  lasting_.news.enter(session_->epoch, shared);
  auto begun = FollowedEpoch::begin(announcement, lasting_, twin, now);
  if (!begun) {
    refuse(begun.error());
    return;
  }
  epoch_ = std::move(*begun);
  ++lasting_.statistics.epochs;
  if (epoch_->lead() < lasting_.options.lead) {
    lasting_.log(LogLevel::kWarning, "the session allows a lead of " + std::to_string(epoch_->lead()) +
                                         ", not " + std::to_string(lasting_.options.lead));
  }
  lasting_.log(LogLevel::kInfo, "found session '" + session_->session + "', scene '" + session_->scene +
                                    "', " + std::to_string(session_->capacity) + " slots, epoch " +
                                    std::to_string(session_->epoch));
}

// A relay that takes over from another, or was restarted, publishes the same epoch from another participant;
// a gateway announces it over another connection.
bool ClientCore::may_go_on_with(const transport::SessionMessage& announced) const {
  if (!epoch_ || !epoch_->may_go_on() || !lasting_.port.hears_all_servers()) return false;
  transport::SessionMessage renamed = announced;
  renamed.names = session_->names;
  return renamed == *session_;
}

// Called when another server is followed than before.
void ClientCore::note_imitator() {
  if (!epoch_ || !epoch_->unproven() || std::exchange(imitated_, session_->epoch) == session_->epoch) return;
  lasting_.log(LogLevel::kWarning,
               "who announced the server's epoch sent nothing: it is no server, and is left");
}

void ClientCore::go_on_with(transport::Received<transport::SessionMessage>& announcement, Now now) {
  TANDEM_ASSERT(epoch_ && session_);
  note_imitator();
  const bool is_another = session_from_ != transport::ParticipantId{};  // not after begin_under()
  if (is_another && !epoch_->unproven())
    lasting_.log(LogLevel::kInfo, "another server goes on with session '" + session_->session + "', epoch " +
                                      std::to_string(session_->epoch));
  session_from_ = announcement.from;
  epoch_->go_on_under(announcement.from, is_another);
  lasting_.ack_due = true;
  lasting_.sent.on_another_server(lasting_.outcomes);
  adopt_names(std::move(announcement.message.names));
  epoch_->take_early(now);
}

void ClientCore::adopt_names(std::vector<transport::BodyName> names) {
  TANDEM_ASSERT(session_.has_value());
  if (names == session_->names) return;
  session_->names = std::move(names);
  lasting_.listener.on_names(*session_);
}

void ClientCore::refuse(const Error& why) {
  end_epoch();
  lasting_.sent.clear(0, lasting_.outcomes);
  ++lasting_.statistics.refused_messages;
  refusal_ = why.message;
  lasting_.log(LogLevel::kError, refusal_);
}

void ClientCore::report_outcomes() {
  Statistics& statistics = lasting_.statistics;
  for (const InputOutcome& outcome : lasting_.outcomes) {
    switch (outcome.kind) {
      case InputOutcome::Kind::kActed:
        ++statistics.inputs_acted;
        statistics.input_latency.add(outcome.latency_ns);
        break;
      case InputOutcome::Kind::kRefused:
        ++statistics.inputs_refused;
        break;
      case InputOutcome::Kind::kUnknown:
      case InputOutcome::Kind::kLost:
        ++statistics.inputs_unknown;
        break;
    }
    if (epoch_) epoch_->on_over(outcome.number);
    lasting_.listener.on_outcome(outcome);
  }
  lasting_.outcomes.clear();
}

void ClientCore::send_status(Now now) {
  transport::ClientStatusMessage status = status_report_.next(lasting_.statistics, now.steady_ns);
  status.client = lasting_.options.id;
  status.session = session_ ? session_->session : lasting_.options.session;
  lasting_.statistics.recent_cost.clear();
  if (epoch_) epoch_->tell(status);
  // Best effort: the next figures replace a lost second.
  static_cast<void>(lasting_.port.write(status));
}

void ClientCore::prefer(std::string_view preference) {
  lasting_.preference = read_preference(preference);
  if (epoch_) epoch_->prefer(lasting_.preference);
}

ClientPhase ClientCore::phase() const {
  if (epoch_) return epoch_->phase();
  return session_ ? ClientPhase::kRefused : ClientPhase::kSearching;
}

Result<std::uint64_t> ClientCore::send(transport::InputKind kind, std::vector<double> values,
                                       transport::Bytes bytes, Now now) {
  if (lasting_.options.role == transport::Role::kObserver) {
    return fail(ErrorCode::kOutOfOrder, "observers may not send input; connect as a participant");
  }
  const ClientTimeline* const playing = timeline();
  if (playing == nullptr) return fail(ErrorCode::kOutOfOrder, "a client can send input only while it plays");
  if (values.size() > transport::kMaxInputValues || bytes.size() > transport::kMaxInputBytes) {
    return fail(ErrorCode::kInvalidArgument, "an input holds at most 16 values and 1,024 bytes");
  }
  if (!std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); })) {
    return fail(ErrorCode::kInvalidArgument, "an input value is not finite");
  }
  transport::InputMessage input;
  input.client = lasting_.options.id;
  input.epoch = epoch_->epoch();
  input.number = lasting_.sent.next_number();
  input.client_frame = playing->now();
  input.kind = static_cast<std::uint32_t>(kind);
  input.values = std::move(values);
  input.bytes = std::move(bytes);
  if (auto written = lasting_.port.write(input); !written) return tl::unexpected<Error>(written.error());
  lasting_.sent.on_sent(now.steady_ns, lasting_.outcomes);
  ++lasting_.statistics.inputs_sent;
  if (lasting_.options.echo && kind == transport::InputKind::kGravity) epoch_->echo(input, now);
  return input.number;
}

const transport::SessionMessage* ClientCore::session() const { return session_ ? &*session_ : nullptr; }
const transport::StreamMessage* ClientCore::stream() const { return epoch_ ? &epoch_->stream() : nullptr; }
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
const ClientTimeline* ClientCore::timeline() const { return epoch_ ? epoch_->timeline() : nullptr; }
bool ClientCore::holds_state() const { return timeline() != nullptr && timeline()->holds_state(); }
const transport::ReplyMessage* ClientCore::reply() const { return epoch_ ? epoch_->reply() : nullptr; }
std::optional<std::int64_t> ClientCore::server_wall_ns(std::int64_t steady_ns) const {
  if (!epoch_ || !epoch_->clock().known()) return std::nullopt;
  return steady_ns + epoch_->clock().offset_ns();
}
std::uint32_t ClientCore::join_attempt() const {
  return epoch_ ? epoch_->join_attempt() : lasting_.join_attempts;
}

ClientStatus ClientCore::status() const {
  ClientStatus out = figures(lasting_.statistics);
  out.phase = phase();
  out.client_id = lasting_.options.id;
  out.server_alive = lasting_.server_alive;
  out.reason = trouble_.empty() ? refusal_ : trouble_;
  out.refused_messages += lasting_.port.dropped();
  if (session_) {
    out.scene = session_->scene;
    out.epoch = session_->epoch;
    out.frame_rate_hz = session_->frame_rate_hz;
  }
  if (epoch_) epoch_->tell(out);
  if (reply() != nullptr && trouble_.empty()) out.reason = describe(reply()->reason);
  return out;
}

std::optional<bool> ClientCore::server_makes_frames(std::int64_t now_ns) const {
  if (!epoch_ || now_ns - lasting_.told_ns >= kRecentNs) return std::nullopt;
  return lasting_.makes_frames;
}

bool ClientCore::frames_are_due(std::int64_t now_ns) const {
  return server_makes_frames(now_ns).value_or(false) && now_ns - lasting_.part_ns >= kRecentNs;
}

void ClientCore::start_sampling() {
  if (lasting_.pictures.wanted()) return;
  if (epoch_) epoch_->start_sampling(last_poll_ns_);
  lasting_.pictures.want();  // last: the next call tries again if there was no memory for a first picture
}

std::optional<Drawable> ClientCore::drawable() {
  const PictureExchange::Reading reading(lasting_.pictures);
  if (reading.picture() == nullptr) return std::nullopt;
  return client::drawable(*reading.picture());
}

void ClientCore::show_uncorrected(bool on) {
  if (std::exchange(lasting_.shows_uncorrected, on) != on && epoch_) epoch_->follow_uncorrected();
}

std::optional<Drift> ClientCore::drift() const { return epoch_ ? epoch_->drift() : std::nullopt; }

// While the client rejoins, the last picture can still be drawn if it is of this epoch.
Result<SampledFrame> ClientCore::sample(const SampleRequest& request, const SampleColumns& columns, Now now) {
  const PictureExchange::Reading reading(lasting_.pictures);
  if (reading.picture() == nullptr) return fail(ErrorCode::kOutOfOrder, "nothing to draw");
  return sampler_.sample(*reading.picture(), request, columns, now.steady_ns, lasting_.options.run_blocks);
}

bool ClientCore::sample(Sample& out, SampleMode mode, Now now) {
  const PictureExchange::Reading reading(lasting_.pictures);
  if (reading.picture() == nullptr) return false;
  const SampleColumns columns = make_room(client::drawable(*reading.picture()), out);
  const auto sampled = sampler_.sample(*reading.picture(), {.mode = mode}, columns, now.steady_ns,
                                       lasting_.options.run_blocks);
  if (sampled) out.frame = sampled->frame;
  return sampled.has_value();
}

}  // namespace tandem::client
