// The order of a poll, and what each of its steps does.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/lattice/groups.hpp"
#include "services/host/impl.hpp"

namespace tandem::host {
namespace {

using transport::Reason;

constexpr std::int64_t kLongestWakeNs = 50 * kMillisecond;
constexpr std::int64_t kShortWakeNs = 10 * kMillisecond;
constexpr std::int64_t kLookNs = kSecond / 4;  // time between checks for rivals and for dead clients
// Time between two announcements with other names: an announcement has the whole scene.
constexpr std::int64_t kNamesNs = kSecond;
// A pause of the server itself (a debugger, a busy machine) must not be charged to its clients.
constexpr std::int64_t kLongestChargeNs = 2 * kLongestWakeNs;

}  // namespace

bool Host::Impl::poll() {
  if (!first_poll_ns) {
    first_poll_ns = now_ns;
    for (Lane& lane : lanes) lane.status.start(now_ns);
  }
  bool produced = false;
  if (state == State::kClaiming) claim_name();
  if (state == State::kWaiting || state == State::kRunning) {
    charge_waiting();
    receive();
    succession.poll(*port, source->frame(), roster.notices(), now_ns);
    look_around();
    roster.refresh(moment());
    settle_inputs();
    const StreamSet due = snapshots_due();
    produced = advance_if_due(due);
    if (produced) announce_names();
    // What is ready of a fed source is the state before a frame that came in this poll.
    const bool now = source->is_fed() ? !produced : produced || now_ns >= frame_awaited_until_ns();
    if (due.any() && now) make_snapshots(due);
    // Streams take turns as well, as one alone may fill the outbox.
    first_to_send = (first_to_send + 1) % lanes.size();
    for (std::size_t i = 0; i < lanes.size(); ++i) {
      Lane& lane = lanes[(first_to_send + i) % lanes.size()];
      lane.transfer.send(roster.accounts(), lane.status.wire_mbit_per_s() * kBitsPerMbit / 8, now_ns);
    }
    succession.send(now_ns);
    replies.send_due(roster, now_ns, stamp_ns());
    publish_status();
    if (produced) source->use_spare_time();
  }
  last_poll_ns = now_ns;
  plan_wake();
  return produced;
}

void Host::Impl::claim_name() {
  error = claim.check(*port, roster.notices(), now_ns);
  if (error) {
    state = State::kRefused;
    return;
  }
  const bool afresh = source->session().continues_epoch == 0;
  const std::int64_t claims_ns = config.claim_ns + (afresh ? claim.gives_ns() : 0);
  if (now_ns - *first_poll_ns < claims_ns || !outbox.push(source->announced())) return;
  state = State::kWaiting;
  claim.announced(now_ns);
  last_look_ns = now_ns;
}

// Charges the time since the last poll to those that were to blame then, before new messages are taken.
void Host::Impl::charge_waiting() {
  if (waiting == Waiting::kNothing) return;
  const std::int64_t waited_ns = now_ns - std::max(last_poll_ns, pacing.suspended_from_ns());
  if (waited_ns <= 0) return;
  suspended_ns += waited_ns;
  if (waiting != Waiting::kParticipants) return;
  TANDEM_ASSERT(delay != Delay::kNone);
  if (std::exchange(delay, Delay::kStalled) != Delay::kStalled) ++totals.stalls;
  Roster::Now then = moment();
  then.written = written_then;
  roster.charge(std::min(waited_ns, kLongestChargeNs), then);
}

void Host::Impl::receive() {
  // Inputs are taken first and handled last, so that an acknowledgement that was sent before an input is
  // handled before it.
  acks.clear();
  input_samples.clear();
  // While the session is handed over, inputs wait: this server may have to go on.
  if (!succession.stopped()) port->take(input_samples);
  port->take(acks);
  for (auto& ack : acks) digest(roster.with_role(ack, *port));
  for (const auto& input : input_samples) digest(input);
}

void Host::Impl::digest(const transport::Received<transport::AckMessage>& ack) {
  const bool of_session = ack.message.epoch != 0;  // false: the client still looks for a session
  if (of_session) claim.acknowledged(ack.message.epoch, ack.from, now_ns);
  const Reason reason = roster.acknowledge(ack.message, ack.from, moment());
  if (reason == Reason::kNone) {
    if (!of_session) return;
    for (Lane& lane : lanes) lane.transfer.acknowledged(ack.message, now_ns);
    return;
  }
  totals.messages_refused.add(reason);
  if (reason == Reason::kNoStream || reason == Reason::kCap) refuse_stream(ack, reason);
  if (reason == Reason::kForeignClient) note_foreigner(ack.message.client);
  if (reason == Reason::kProtocolVersion || reason == Reason::kFull) {
    replies.refuse(ack.message.client, reason, now_ns, stamp_ns());
  }
}

void Host::Impl::refuse_stream(const transport::Received<transport::AckMessage>& ack, Reason why) {
  const std::uint32_t needed = why == Reason::kCap ? needed_kbit_s() : 0;
  Reason reason = Reason::kNone;
  Account* const account = roster.find(ack.message.client, ack.from, reason);
  if (account == nullptr) return replies.refuse(ack.message.client, why, now_ns, stamp_ns(), needed);
  account->reply.once = why;
  account->reply.needed_kbit_s = needed;
  account->reply.schedule.on_change();
}

// The smallest cap with which a client may play something: as streams have caps, or take on the network.
std::uint32_t Host::Impl::needed_kbit_s() const {
  std::uint32_t least = 0;
  for (const transport::StreamMessage& stream : source->announced().streams) {
    const double wire_kbit_s = std::ceil(lanes[stream.id.id].status.wire_mbit_per_s() * kBitsPerMbit / 1000);
    const std::uint32_t needs =
        stream.cap_kbit_s > 0
            ? stream.cap_kbit_s
            : static_cast<std::uint32_t>(std::min<double>(wire_kbit_s, transport::kMaxCapKbitS));
    if (needs > 0 && (least == 0 || needs < least)) least = needs;
  }
  return std::max(least, transport::kLeastCapKbitS);
}

void Host::Impl::digest(const transport::Received<transport::InputMessage>& input) {
  Reason reason = Reason::kNone;
  Account* const account = roster.find(input.message.client, input.from, reason);
  if (account != nullptr) {
    inputs.handle(*account, roster.peer(*account), input.message, now_ns);
    return;
  }
  totals.messages_refused.add(reason);
  if (reason == Reason::kForeignClient) {
    // Not answered, because a reply is keyed by the client's id, and the rightful owner would take it as its
    // own.
    note_foreigner(input.message.client);
    return;
  }
  if (input.message.epoch != config.epoch) reason = Reason::kStaleEpoch;
  totals.inputs_refused.add(reason);
  replies.refuse(input.message.client, reason, now_ns, stamp_ns());
}

void Host::Impl::note(std::string notice) { roster.notices().add(std::move(notice), now_ns); }

void Host::Impl::note_foreigner(transport::ClientId client) {
  if (last_foreign_note_ns != INT64_MIN && now_ns - last_foreign_note_ns < kSecond) return;
  last_foreign_note_ns = now_ns;
  note(fmt::format("client {} is used by a second participant: refused", client_name(client)));
}

void Host::Impl::settle_inputs() {
  later.clear();
  source->take_outcomes(later);
  for (InputVerdict& verdict : later) inputs.settle(roster, std::move(verdict), now_ns);
}

StreamSet Host::Impl::snapshots_due() {
  StreamSet due;
  for (std::uint32_t id = 0; id < lanes.size(); ++id)
    due[id] = lanes[id].joins.due(roster, *port, lanes[id].transfer, now_ns);
  const StreamSet ready = due.any() ? source->prepare(due) : due;
  unprepared = due & ~ready;
  return ready;
}

// Nothing of a stream that ends remains to be sent.
void Host::Impl::choose_streams(StreamSet joined) {
  const StreamSet before = source->active();
  source->set_active(audience.wanted(roster, now_ns) | joined);
  const StreamSet ended = before & ~source->active();
  for (std::uint32_t id = 0; id < lanes.size(); ++id)
    if (ended[id]) lanes[id].transfer.end();
}

void Host::Impl::look_around() {
  // More often while the server waits for a client, because that client may be gone.
  const bool hurries = waiting == Waiting::kParticipants || succession.stopped();
  if (now_ns - last_look_ns < (hurries ? kShortWakeNs : kLookNs)) return;
  last_look_ns = now_ns;
  roster.look_for_dead(*port, moment());
  error = claim.check(*port, roster.notices(), now_ns);
  if (error) state = State::kRefused;
  // One of two may not have heard the other, and announcements are made once.
  if (!error && claim.has_rival() && now_ns - names_announced_ns >= kNamesNs && outbox.has_control_room()) {
    announce();
  }
  if (succession.stopped() && claim.is_continued()) state = State::kHandedOver;
}

bool Host::Impl::advance_if_due(StreamSet snapshots_due) {
  if (source->failed()) {  // also while nothing is due
    tell_collected_frames(true);
    state = State::kEnded;
    error = source->error();
    return false;
  }
  if (source->stepping()) return source->next_ready() && produce_frame(snapshots_due);
  if (state == State::kWaiting && roster.counted() >= config.wait_for) {
    state = State::kRunning;
    pacing.start(now_ns);
  }
  tell_collected_frames(succession.stopped());
  waiting = Waiting::kNothing;
  if (state != State::kRunning || succession.stopped() || !pacing.due(now_ns)) return false;
  const Roster::Now then = moment();
  written_then = then.written;
  if (source->is_fed() && !source->next_ready()) return false;
  if (!source->is_fed() && roster.blocked(then))
    waiting = roster.blamed(then) ? Waiting::kParticipants : Waiting::kQueue;
  if (!outbox.has_frame_room()) waiting = Waiting::kQueue;
  if (waiting != Waiting::kNothing) {
    if (delay == Delay::kNone) delay = Delay::kHeld;
    return false;
  }
  begin_frame(then);
  return source->next_ready() && produce_frame(snapshots_due);
}

void Host::Impl::begin_frame(const Roster::Now& then) {
  TANDEM_ASSERT(outbox.has_frame_room() && !source->stepping());
  pacing.frame_started(now_ns, delay == Delay::kStalled || (delay == Delay::kHeld && !config.free_rate));
  delay = Delay::kNone;
  roster.frame_starts(then);
  frame_began_ns = clock();
  source->begin_next();
}

// Begins the next step before the frame at hand is encoded, if it would be due meanwhile.
void Host::Impl::begin_early() {
  if (!source->may_begin_early() || succession.ends()) return;
  if (source->needs_rest() && now_ns - last_rest_ns >= kNamesNs) {
    last_rest_ns = now_ns;
    return;
  }
  const Roster::Now then = moment(source->frame() + 1);
  if (!pacing.due(now_ns + encoding_ns) || roster.blocked(then) || !outbox.has_frame_room(2)) return;
  begin_frame(then);
}

bool Host::Impl::produce_frame(StreamSet snapshots_due) {
  choose_streams({});
  const std::int64_t start = clock(), began_ns = frame_began_ns;
  const bool taken = source->take_step();
  if (taken) begin_early();
  source->set_budgets(publication.budgets(now_ns));
  const auto frame = taken ? source->next(snapshots_due, outbox) : std::nullopt;
  if (!frame) {
    tell_collected_frames(true);
    state = State::kEnded;
    error = source->error();
    return false;
  }
  const std::int64_t produced = clock();
  encoding_ns = produced - start;
  succession.made(*source, now_ns);
  publication.push(outbox, *frame, {.now_ns = now_ns, .wall_ns = stamp_ns() + (produced - start)});
  report.frame = frame->frame;
  report.frame_ms = static_cast<double>(produced - began_ns) * 1e-6;
  report.step_ms = static_cast<double>(frame->step_ns) * 1e-6;
  report.deltas.clear();
  for (const MadeDelta& made : frame->deltas) {
    report.deltas.push_back({made.stream, made.hash, made.payload.size(), made.corrected, made.predict_ns,
                             made.encode_ns, made.apply_ns});
    StreamTotals& of_stream = lanes[made.stream].totals;
    ++of_stream.frames;
    of_stream.payload_bytes += made.payload.size();
    of_stream.corrected += made.corrected;
  }
  for (std::string& line : source->take_notices(now_ns)) note(std::move(line));
  for (std::string& line : source->take_warnings(now_ns)) roster.notices().warn(std::move(line), now_ns);
  ++totals.frames;
  frame_durations.add(produced - began_ns);
  if (!config.free_rate) {
    // Of two stages side by side, the longer one decides the rate.
    const std::int64_t took_ns =
        source->stepping() ? std::max(frame->step_ns, encoding_ns) : produced - began_ns;
    if (auto line = overrun.frame_took(frame->step_ns, took_ns, now_ns); !line.empty()) note(std::move(line));
  }
  for (Lane& lane : lanes) lane.status.frame_took(produced - began_ns);
  return true;
}

void Host::Impl::tell_collected_frames(bool all) {
  if (outbox.has_frame_room()) publication.push_collected(outbox, all, now_ns);
}

void Host::Impl::make_snapshots(StreamSet due) {
  choose_streams(due);
  for (std::uint32_t id = 0; id < lanes.size(); ++id) {
    if (!due[id]) continue;
    Lane& lane = lanes[id];
    source->snapshot(id, snapshot);
    lane.transfer.start(config.epoch, {.id = id, .generation = 0}, source->frame(), snapshot,
                        lane.joins.ready(), now_ns);
    lane.joins.served(roster, now_ns);
    ++lane.totals.snapshots;
  }
}

void Host::Impl::announce_names() {
  if (now_ns - names_announced_ns < kNamesNs || !outbox.has_control_room() || !source->refresh_names())
    return;
  announce();
}

void Host::Impl::announce() {
  names_announced_ns = now_ns;
  const bool queued = outbox.push(source->announced());
  TANDEM_ASSERT(queued);  // the caller saw room, and no other thread pushes
}

HostTotals Host::Impl::totals_now() const {
  HostTotals now = totals;
  const StreamSet active = source->active();
  for (std::uint32_t id = 0; id < lanes.size(); ++id) {
    StreamTotals stream = lanes[id].totals;
    stream.made = active[id];
    stream.messages = publication.told()[id].messages;
    stream.message_bytes = publication.told()[id].bytes;
    now.rejoins += lanes[id].joins.rejoins();
    stream.snapshot_bytes = lanes[id].transfer.bytes();
    stream.participants = roster.counted(id);
    stream.observers = roster.watching(id);
    now.corrected += stream.corrected;
    now.payload_bytes += stream.payload_bytes;
    now.snapshots += stream.snapshots;
    now.snapshot_bytes += stream.snapshot_bytes;
    now.streams.push_back(std::move(stream));
  }
  now.reply_bytes = outbox.traffic().replies;
  now.input_bytes = outbox.traffic().scheduled_inputs;
  now.suspended_ms = static_cast<std::uint64_t>(suspended_ns / kMillisecond);
  for (std::size_t reason = 0; reason < transport::kReasons; ++reason)
    now.inputs_refused.by_reason[reason] += inputs.refused().by_reason[reason];
  now.refused_inputs = now.inputs_refused.total();
  now.refused_messages = now.messages_refused.total() + port->dropped();
  now.demotions = roster.demotions();
  now.repeated_demotions = roster.repeated_demotions();
  now.clients_seen = roster.seen();
  now.hidden = source->hidden();
  now.frame_ms_p50 = frame_durations.quantile_ms(0.5);
  now.frame_ms_p99 = frame_durations.quantile_ms(0.99);
  return now;
}

void Host::Impl::publish_status() {
  if (std::exchange(seen_before, roster.seen()) != roster.seen() || source->active() != active_before)
    for (Lane& lane : lanes) lane.status.hurry();
  active_before = source->active();
  for (std::uint32_t id = 0; id < lanes.size(); ++id) {
    // A stream on trial is told once, whatever the delays in which it will be offered.
    if (!lanes[id].totals.encodes && !source->offers(id)) continue;
    if (!lanes[id].status.due(now_ns)) continue;
    const HostTotals now = totals_now();
    const Layout& layout = source->session().streams[id].layout;
    const bool made = source->active()[id];
    lanes[id].status.publish(
        now,
        {.frame = source->frame(),
         .bodies = source->bodies(first_made()).alive,
         .at_rest = made ? source->bodies(id).at_rest : 0,
         .participants = now.streams[id].participants,
         .observers = now.streams[id].observers,
         .window = roster.window(),
         .raw_body_bytes = static_cast<std::uint32_t>(body_bytes(bits_of(groups_of(layout)))),
         .made = made,
         .estimated_mbit_per_s = made ? 0 : estimated_mbit_per_s(id),
         .messages_per_s = WireCap::messages_per_s(capped(source->session(), source->session().streams[id])),
         .threshold_m = threshold_m(id),
         .codec = layout.codec,
         .predictor = layout.predictor},
        now_ns);
  }
}

void Host::Impl::plan_wake() {
  wake_ns = now_ns + kLongestWakeNs;
  const auto at = [this](std::int64_t ns) { wake_ns = std::min(wake_ns, ns); };
  if (state == State::kClaiming) at(std::max(*first_poll_ns + config.claim_ns, now_ns + kShortWakeNs));
  if (succession.stopped()) at(now_ns + kShortWakeNs);
  if (source->stepping()) {
    if (source->next_descriptor() < 0) at(now_ns + kMillisecond);
  } else if (state == State::kRunning && waiting == Waiting::kNothing && !succession.stopped() &&
             (!source->is_fed() || source->next_ready())) {
    at(pacing.deadline_ns());
  }
  if (waiting == Waiting::kQueue) at(now_ns + kMillisecond);
  if (waiting == Waiting::kParticipants) {
    if (const auto left = roster.patience_ns(moment())) {
      at(std::max(now_ns, pacing.suspended_from_ns()) + *left + kMillisecond);
    }
  }
  const bool serves = state == State::kWaiting || state == State::kRunning;
  for (const Lane& lane : lanes) {
    if (serves) at(std::min(lane.transfer.next_ns(), succession.standbys().next_ns()));
    if (const auto due = lane.joins.due_ns(lane.transfer, now_ns))
      at(*due > now_ns ? *due : std::max(*due, frame_awaited_until_ns()));
  }
  if (unprepared.any()) {
    wake_ns = std::max(wake_ns, now_ns + kMillisecond);
    at(now_ns + kShortWakeNs);
  }
  for (const auto& [id, account] : roster.accounts()) {
    const bool unmatched = joined_stream(account).has_value();
    if (unmatched || account.reply.schedule.changed()) at(now_ns + kShortWakeNs);
  }
  wake_ns = std::max(wake_ns, now_ns);
}

}  // namespace tandem::host
