#include "sdk/client/followed_epoch.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "sdk/wire/limits.hpp"
#include "sdk/wire/plain_text.hpp"
#include "sdk/wire/units.hpp"

namespace tandem::client {
namespace {

// An acknowledgement is repeated after this time, so that the server hears from a client even if no frame
// comes.
constexpr std::int64_t kPlayingRepeatNs = kSecond;
constexpr std::int64_t kObserverRepeatNs = 10 * kSecond;
constexpr std::int64_t kDeafRepeatNs = 4 * kSecond;  // no server hears it, and DDS repeats each many times
// If nothing comes from a server for so long while the client joins, another server may take its place.
constexpr std::int64_t kSilencePatienceNs = 10 * kSecond;
// If nothing comes from a server that lives for so long, one that continues its world takes its place. A
// server sends a status each second.
constexpr std::int64_t kQuietNs = 3 * kSecond / 2;

}  // namespace

FollowedEpoch::FollowedEpoch(const transport::Received<transport::SessionMessage>& announced, Lasting& client,
                             bool unproven, StreamChooser chooser, std::unique_ptr<Follower> first, Now now)
    : client_(client),
      session_(announced.message),
      server_(announced.from),
      chooser_(std::move(chooser)),
      played_(std::move(first)),
      lead_(std::min(client.options.lead, session_.lead)),
      pacer_(session_.frame_rate_hz),
      pictures_(client.pictures, session_),
      unproven_(unproven),
      join_began_ns_(now.steady_ns) {
  pace();
}

// A gateway collects for the longer of the two: what came together stays together.
void FollowedEpoch::pace() {
  const std::uint32_t steps =
      client_.port.collects() ? client_.options.delay_ms() / transport::kDelayStepMs : 0;
  const std::uint32_t own_ms = steps * transport::kDelayStepMs;
  pacer_.set_delay(std::max(played().stream().delay_ms, own_ms) * kMillisecond);
}

// Only for who draws. Stamps are untrusted, so a frame waits for no longer than the stream's delay.
bool FollowedEpoch::front_waits(Now now) const {
  if (pacer_.delay_ns() == 0 || !client_.pictures.wanted() || !pacer_.known() || played().front() == nullptr)
    return false;
  const std::int64_t waits_ns = pacer_.arrival_ns(played().front()->frame) - now.steady_ns;
  return waits_ns > 0 && waits_ns <= pacer_.delay_ns();
}

void FollowedEpoch::poll(Now now, std::int64_t since_ns) {
  Statistics& statistics = client_.statistics;
  take_stream(now);
  take_replies(now);
  take_statuses(now);
  if (statistics.frames_applied > 0) statistics.costs.receive_ns += client_.measure() - client_.poll_began_ns;
  if (played().joining()) join_played(now);
  played().keep_state(client_.options.keeps_state, now.steady_ns);
  if (!played().joining()) play(now, since_ns);
  if (played().fetching()) fetch_state(now);
  if (played().joining()) join_played(now);
  consider_streams(now);
  show_clock();
  if (client_.ack_due || now.steady_ns >= next_ack_ns()) send_ack(now);
  if (client_.options.prepares) prepare();
  check();
}

// What holds between two polls.
void FollowedEpoch::check() const {
  const bool joins = played().joining();
  TANDEM_ASSERT(joins || (is_told_ && has_loaded_));
  TANDEM_ASSERT(!joins || !change_);
  TANDEM_ASSERT(!is_told_ || !choice_due_ns_);
  TANDEM_ASSERT(lead_ <= session_.lead);
}

// DDS may go on for a server that hangs. A participant that only announces another's epoch is no server.
void FollowedEpoch::count_silence(std::int64_t joining_ns, std::int64_t any_ns) {
  if (played().joining() && (silence_ns_ += joining_ns) >= kSilencePatienceNs) {
    silence_ns_ = 0;
    client_.port.pass_over_session(transport::PassOver::kWhileThereIsAnother);
  }
  quiet_ns_ += any_ns;
  if (quiet_ns_ < kQuietNs) return;
  if (unproven_) client_.server_alive = false;
  client_.port.pass_over_session(unproven_ ? transport::PassOver::kWhileThereIsAnother
                                           : transport::PassOver::kForItsSuccessor);
}

void FollowedEpoch::expect_announcement() {
  server_ = {};
  unproven_ = false;
  quiet_ns_ = 0;
}

// Nothing that is held is dropped: its first frames are those that the other may not have published any more.
// Where they are later than that, the client finds a gap and joins again.
void FollowedEpoch::go_on_under(const transport::ParticipantId& server, bool is_another) {
  TANDEM_ASSERT(may_go_on());
  server_ = server;
  unproven_ = is_another;
  reply_.reset();
  client_.ack_due = true;
  silence_ns_ = quiet_ns_ = 0;
}

std::int64_t FollowedEpoch::next_due_ns(Now now) const {
  if (!is_told_) {
    // Under a cap it may wait for figures for longer.
    const std::int64_t soonest_ns = now.steady_ns + (chooser_.needed_kbit_s() ? 20 * kMillisecond : 0);
    return std::max(choice_due_ns_.value_or(now.steady_ns), soonest_ns);
  }
  std::int64_t due = next_ack_ns();
  if (change_ && change_->to().joining()) due = std::min(due, change_->to().next_due_ns());
  if (played().joining() || played().fetching()) due = std::min(due, played().next_due_ns());
  if (played().joining()) return due;
  const ClientTimeline& timeline = played().timeline();
  if (front_waits(now)) {
    due = std::min(due, pacer_.arrival_ns(played().front()->frame));
  } else if (played().front() != nullptr && !played().misses_input()) {
    return now.steady_ns;  // there are more frames than one poll applies
  }
  if (client_.pictures.wanted() && pacer_.known() && timeline.now() < timeline.applied() + lead_)
    due = std::min(due, pacer_.due_ns(timeline.now() + 1));
  return due;
}

// Acknowledgements are rare if the server does not wait for them (idl/STATES.md, "Acknowledgements"), because
// each costs more bytes than many a delta.
std::int64_t FollowedEpoch::next_ack_ns() const {
  const std::int64_t last_ns = client_.last_ack_ns;
  if (played().joining()) return last_ns + played().repeat_ns();
  const std::int64_t changing_ns = change_               ? last_ns + change_->to().repeat_ns()
                                   : played().fetching() ? last_ns + played().repeat_ns()
                                                         : INT64_MAX;
  const std::int64_t soon_ns = last_ns + (client_.server_alive ? kPlayingRepeatNs : kDeafRepeatNs);
  if (client_.options.role == transport::Role::kObserver) {
    // A server that has just begun makes no stream of which it does not know that somebody plays it.
    const std::int64_t missed_ns =
        reply_ ? std::max(soon_ns, client_.statistics.last_applied_ns + kQuietNs) : soon_ns;
    return std::min({changing_ns, last_ns + kObserverRepeatNs, missed_ns});
  }
  const std::int64_t repeat_ns = std::min(changing_ns, soon_ns);
  const Frame applied = played().timeline().applied();
  if (applied == client_.acknowledged) return repeat_ns;
  const double period_ns = 1e9 / session_.frame_rate_hz;
  if (applied - client_.acknowledged >= transport::ack_spacing(session_.window_ceiling)) return last_ns;
  // If no further delta comes, the server may be waiting.
  const auto quiet_ns = client_.statistics.last_applied_ns + static_cast<std::int64_t>(1.25 * period_ns);
  return std::min({repeat_ns, last_ns + transport::kAckSpacingNs, quiet_ns});
}

void FollowedEpoch::send_ack(Now now) {
  const bool changes = change_ && change_->to().asked();
  Follower& joined = changes ? change_->to() : played();
  const bool fetches = !changes && joined.fetching() && joined.asked();
  if (!joined.asked() && !joined.fetching()) return;
  transport::AckMessage ack;
  ack.client = client_.options.id;
  ack.epoch = session_.epoch;
  ack.stream = joined.stream().id;
  const bool joins = changes || fetches || played().joining();
  ack.phase = joins ? transport::Phase::kJoining : transport::Phase::kPlaying;
  if (joins) joined.tell_progress(ack);
  // A client that changes its stream, or fetches a state of it, acknowledges both the incoming snapshot and
  // the last frame that it played.
  if (!played().joining()) {
    ack.applied = client_.acknowledged = played().timeline().applied();
    ack.simulated = played().timeline().now();
  }
  ack.role_wanted = client_.options.role;
  ack.max_delay_ms = client_.options.delay_ms();
  ack.cap_kbit_s = client_.options.cap_kbit_s;
  ack.clock_ns = now.steady_ns;
  ack.join_attempt = joined.join_attempt();
  const std::int64_t began_ns = client_.measure();
  // A failed write is tried again at the next poll, because the acknowledgement stays due.
  client_.ack_due = !client_.port.write(ack).has_value();
  if (client_.statistics.frames_applied > 0)
    client_.statistics.costs.acknowledge_ns += client_.measure() - began_ns;
  client_.last_ack_ns = now.steady_ns;
}

std::uint32_t FollowedEpoch::join_attempt() const {
  const std::uint32_t attempt = played().join_attempt();
  return change_ ? std::max(attempt, change_->to().join_attempt()) : attempt;
}

void FollowedEpoch::echo(const transport::InputMessage& gravity, Now now) {
  if (gravity.values.size() != kPositionChannels || !pacer_.known()) return;
  // Lattice velocities are in 1/64 of the lattice unit.
  const double scale = 64 * session_.dt_s * session_.dt_s / session_.lattice_unit;
  std::array<float, kPositionChannels> in_lattice{};
  for (std::size_t axis = 0; axis < kPositionChannels; ++axis) {
    constexpr double kMax = kVelocityLimit;
    in_lattice[axis] = static_cast<float>(std::clamp(gravity.values[axis] * scale, -kMax, kMax));
  }
  echo_.on_sent(gravity.number, in_lattice, pacer_.server_frame(now.steady_ns));
  show_clock();
}

void FollowedEpoch::show_clock() {
  if (!played().joining()) echo_.on_simulated(played().timeline().now());
  pictures_.on_echo(echo_.shown());
  pictures_.on_clock(pacer_);
}

void FollowedEpoch::start_sampling(std::int64_t now_ns) {
  if (has_loaded_) pictures_.on_loaded(played().timeline(), pacer_, now_ns);
}

void FollowedEpoch::tell(ClientStatus& out) const {
  if (reply_) {
    out.role =
        reply_->role == transport::Role::kParticipant ? ClientRole::kParticipant : ClientRole::kObserver;
  }
  out.lead = lead_;
  out.stream = chooser_.chosen().name;
  out.stream_reason = chooser_.reason();
  if (const ClientTimeline* const playing = timeline()) {
    out.frame = playing->applied();
    out.state_hash = playing->hash();
  }
  out.round_trip_ms = static_cast<double>(clock().round_trip_ns()) / 1e6;
  out.jitter_ms = pacer_.jitter_ms();
}

void FollowedEpoch::tell(transport::ClientStatusMessage& out) {
  const double period_ms = 1e3 / session_.frame_rate_hz;
  const bool too_slow = out.client_ms_p50 > period_ms / 2;
  out.too_slow = too_slow ? 1 : 0;
  if (too_slow && !std::exchange(told_too_slow_, true)) {
    client_.log(LogLevel::kWarning,
                "this client is too slow for the session: half of its frames take more than " +
                    std::to_string(std::lround(out.client_ms_p50)) + " of " +
                    std::to_string(std::lround(period_ms)) + " ms");
  }
  out.epoch = session_.epoch;
  out.stream = stream().id;
  out.stream_reason = transport::plain_text(chooser_.reason(), transport::kMaxReasonBytes);
  out.applied = timeline() != nullptr ? timeline()->applied() : 0;
  out.role = static_cast<std::uint32_t>(reply_ ? reply_->role : transport::Role::kObserver);
  out.phase = static_cast<std::uint32_t>(played().joining() ? transport::Phase::kJoining
                                                            : transport::Phase::kPlaying);
}

}  // namespace tandem::client
