#include "services/host/host.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "sdk/statistics/duration_histogram.hpp"
#include "sdk/transport/limits.hpp"
#include "sdk/transport/units.hpp"
#include "services/host/claim.hpp"
#include "services/host/inputs.hpp"
#include "services/host/joins.hpp"
#include "services/host/live_source.hpp"
#include "services/host/pacing.hpp"
#include "services/host/publication.hpp"
#include "services/host/replies.hpp"
#include "services/host/roster.hpp"
#include "services/host/snapshot_transfer.hpp"
#include "services/host/status.hpp"
#include "services/host/window.hpp"

namespace tandem::host {
namespace {

using transport::Reason;

constexpr std::int64_t kLongestWakeNs = 50 * kMillisecond;
constexpr std::int64_t kShortWakeNs = 10 * kMillisecond;
constexpr std::int64_t kLookNs = kSecond / 4;  // between looks for rivals and for dead clients
// A pause of the server itself (a debugger, a busy machine) must not be charged to its clients.
constexpr std::int64_t kLongestChargeNs = 2 * kLongestWakeNs;

tl::unexpected<Error> refuse(std::string message) {
  return fail(ErrorCode::kInvalidArgument, std::move(message));
}

Result<void> check(const ServiceConfig& config) {
  if (auto named = transport::check_session_name(config.session); !named) return named;
  if (!(config.frame_rate_hz >= 1 && config.frame_rate_hz <= 1000))
    return refuse("frame rate must lie in 1..1000 Hz");
  if (config.window_ceiling < 1 || config.window_ceiling > 64)
    return refuse("window ceiling must lie in 1..64");
  if (config.window && (*config.window < 1 || *config.window > config.window_ceiling)) {
    return refuse(fmt::format("window must lie in 1..{}", config.window_ceiling));
  }
  if (config.client_limit == 0 || config.participant_limit == 0)
    return refuse("client limits must be positive");
  if (config.epoch == 0) return refuse("epoch must not be 0");
  return {};
}

Result<void> check(const HostConfig& config, const engine::Simulation& simulation) {
  if (auto good = check(config); !good) return good;
  if (config.stream.layout.lead > 1) return refuse("lead must be 0 or 1");
  if (config.types.size() != config.stream.layout.type_count)
    return refuse(
        fmt::format("{} body types, {} described", config.stream.layout.type_count, config.types.size()));
  static_assert(engine::kMaxBodies == kMaxCapacity);
  const std::uint32_t capacity = simulation.capacity();
  if (capacity != config.stream.layout.capacity)
    return refuse(fmt::format("{} slots for a simulation of {}", config.stream.layout.capacity, capacity));
  return {};
}

}  // namespace

struct Host::Impl {
  Impl(ServiceConfig configuration, std::unique_ptr<FrameSource> frames, transport::ServerPort& endpoints)
      : config(std::move(configuration)),
        port(&endpoints),
        source(std::move(frames)),
        outbox(config.outbox),
        roster({.epoch = config.epoch,
                .client_limit = config.client_limit,
                .participant_limit = config.participant_limit,
                .stall_timeout_ns = config.stall_timeout_ns,
                .fixed_window = config.window,
                .window_ceiling = config.window_ceiling}),
        inputs(config.epoch, *source, outbox),
        replies(config.epoch, outbox),
        claim(config.epoch, endpoints.self()),
        pacing(config.frame_rate_hz, config.free_rate),
        status(config.session, config.epoch, outbox) {
    report.frame = source->frame();
    report.hash = source->hash();
  }

  // --- What the rules see ---
  [[nodiscard]] Roster::Now moment() const {
    const Frame unwritten = outbox.unwritten_frames();
    return {.ns = now_ns,
            .frame = source->frame(),
            .written = source->frame() - std::min(source->frame(), unwritten),
            .period_ns = pacing.period_ns()};
  }
  // A snapshot waits for a frame, which is rounded for it; not while the session is suspended.
  [[nodiscard]] std::int64_t frame_awaited_until_ns() const {
    return state == State::kRunning ? pacing.suspended_from_ns() + pacing.period_ns() : INT64_MIN;
  }
  [[nodiscard]] const Layout& layout() const { return source->session().streams[0].layout; }
  [[nodiscard]] double threshold_m() const {
    return source->parameters().codec.threshold * source->session().lattice_unit;
  }
  [[nodiscard]] std::int64_t clock() const { return config.clock_ns == nullptr ? 0 : config.clock_ns(); }

  // --- One poll, in this order ---
  bool poll();
  void claim_name();
  void charge_waiting();
  void receive();
  void look_around();
  bool advance_if_due(bool snapshot_due);
  void make_snapshot();
  void publish_status();
  void plan_wake();

  void digest(const transport::Received<transport::AckMessage>& ack);
  void digest(const transport::Received<transport::InputMessage>& input);
  bool produce_frame(bool snapshot_due);
  [[nodiscard]] HostTotals totals_now() const;
  void note(std::string notice);
  void note_foreigner(transport::ClientId client);
  void note_mishaps();
  void note_target();

  enum class Waiting : std::uint8_t { kNothing, kParticipants, kQueue };

  ServiceConfig config;
  transport::ServerPort* port;
  std::unique_ptr<FrameSource> source;
  LiveSource* live = nullptr;  // the same, where a simulation runs
  Outbox outbox;
  Roster roster;
  InputDesk inputs;
  JoinDesk joins;
  SnapshotTransfer transfer{outbox};
  ReplyDesk replies;
  Claim claim;
  Pacing pacing;
  PublishTimes times;
  StatusDesk status;

  State state = State::kClaiming;
  std::optional<Error> error;
  std::int64_t now_ns = 0, wall_ns = 0, last_poll_ns = 0, wake_ns = 0;
  std::optional<std::int64_t> first_poll_ns;
  std::int64_t last_look_ns = 0, last_foreign_note_ns = INT64_MIN;
  std::int64_t last_mishap_note_ns = -kSecond;
  engine::Mishaps noted_mishaps;
  Waiting waiting = Waiting::kNothing;  // what the due frame waits for, since the last poll
  Frame written_then = 0;               // at the last poll
  bool held = false;                    // the due frame had to wait
  bool stalled = false;                 // and was counted as a stall
  std::int64_t suspended_ns = 0;

  FrameReport report;
  HostTotals totals;
  DurationHistogram frame_durations;
  std::vector<std::byte> snapshot;
  std::vector<transport::Received<transport::AckMessage>> acks;
  std::vector<transport::Received<transport::InputMessage>> input_samples;
};

bool Host::Impl::poll() {
  if (!first_poll_ns) {
    first_poll_ns = now_ns;
    status.start(now_ns);
  }
  bool produced = false;
  if (state == State::kClaiming) claim_name();
  if (state == State::kWaiting || state == State::kRunning) {
    charge_waiting();
    receive();
    look_around();
    roster.refresh(moment());
    const bool snapshot_due = joins.due(roster, *port, transfer, now_ns);
    produced = advance_if_due(snapshot_due);
    if (snapshot_due && (produced || now_ns >= frame_awaited_until_ns())) make_snapshot();
    transfer.send(roster.accounts(), now_ns);
    replies.send_due(roster, now_ns, wall_ns);
    publish_status();
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
  if (now_ns - *first_poll_ns < config.claim_ns || !outbox.push(source->session())) return;
  state = State::kWaiting;
  claim.announced(now_ns);
  last_look_ns = now_ns;
}

// Before anything new is taken in: the time since the last poll is charged to those who were to blame then.
void Host::Impl::charge_waiting() {
  if (waiting == Waiting::kNothing) return;
  const std::int64_t waited_ns = now_ns - std::max(last_poll_ns, pacing.suspended_from_ns());
  if (waited_ns <= 0) return;
  suspended_ns += waited_ns;
  if (waiting != Waiting::kParticipants) return;
  if (!stalled) ++totals.stalls;
  stalled = true;
  Roster::Now then = moment();
  then.written = written_then;
  roster.charge(std::min(waited_ns, kLongestChargeNs), then);
}

void Host::Impl::receive() {
  // Inputs are taken first and digested last: an acknowledgement sent before an input is then seen before it.
  acks.clear();
  input_samples.clear();
  port->take(input_samples);
  port->take(acks);
  for (const auto& ack : acks) digest(ack);
  for (const auto& input : input_samples) digest(input);
}

void Host::Impl::digest(const transport::Received<transport::AckMessage>& ack) {
  claim.acknowledged(ack.message.epoch, ack.from, now_ns);
  const Reason reason = roster.acknowledge(ack.message, ack.from, times, moment());
  if (reason == Reason::kNone) return transfer.acknowledged(ack.message, now_ns);
  ++totals.refused_messages;
  if (reason == Reason::kForeignClient) note_foreigner(ack.message.client);
  if (reason == Reason::kProtocolVersion || reason == Reason::kFull) {
    replies.refuse(ack.message.client, reason, now_ns, wall_ns);
  }
}

void Host::Impl::digest(const transport::Received<transport::InputMessage>& input) {
  Reason reason = Reason::kNone;
  Account* const account = roster.find(input.message.client, input.from, reason);
  if (account != nullptr) {
    inputs.handle(*account, input.message, now_ns);
    return;
  }
  ++totals.refused_messages;
  if (reason == Reason::kForeignClient) {
    // Not answered: a reply is keyed by the client, so the rightful owner would take it for his.
    note_foreigner(input.message.client);
    return;
  }
  ++totals.refused_inputs;
  replies.refuse(input.message.client, input.message.epoch == config.epoch ? reason : Reason::kStaleEpoch,
                 now_ns, wall_ns);
}

void Host::Impl::note(std::string notice) { roster.notices().add(std::move(notice), now_ns); }

void Host::Impl::note_foreigner(transport::ClientId client) {
  if (last_foreign_note_ns != INT64_MIN && now_ns - last_foreign_note_ns < kSecond) return;
  last_foreign_note_ns = now_ns;
  note(fmt::format("client {} is used by a second participant: refused", client_name(client)));
}

void Host::Impl::note_mishaps() {
  engine::Mishaps now = live->simulation().mishaps();
  const engine::Mishaps shown = live->stream().mishaps();
  now.removed += shown.removed;
  now.clamped += shown.clamped;
  if (now == noted_mishaps || now_ns - last_mishap_note_ns < kSecond) return;
  last_mishap_note_ns = now_ns;
  noted_mishaps = now;
  note(fmt::format("the simulation explodes: {} bodies removed and {} slowed down since its start",
                   now.removed, now.clamped));
}

void Host::Impl::note_target() {
  const Stream& stream = live->stream();
  const QualityGoal& goal = *stream.config().quality;
  if (!stream.target_out_of_reach()) {
    note(fmt::format("the target of {} Mbit/s is kept again", goal.target_mbit_per_s));
    return;
  }
  note(fmt::format("the target of {} Mbit/s is exceeded even at the largest threshold, {:.3g} m",
                   goal.target_mbit_per_s, goal.largest_threshold * stream.config().lattice.unit));
}

void Host::Impl::look_around() {
  // More often while somebody is waited for: he may be gone.
  if (now_ns - last_look_ns < (waiting == Waiting::kParticipants ? kLongestWakeNs : kLookNs)) return;
  last_look_ns = now_ns;
  roster.look_for_dead(*port, moment());
  error = claim.check(*port, roster.notices(), now_ns);
  if (error) state = State::kRefused;
}

bool Host::Impl::advance_if_due(bool snapshot_due) {
  if (state == State::kWaiting && roster.counted() >= config.wait_for) {
    state = State::kRunning;
    pacing.start(now_ns);
  }
  waiting = Waiting::kNothing;
  if (state != State::kRunning || !pacing.due(now_ns)) return false;
  const Roster::Now then = moment();
  written_then = then.written;
  if (roster.blocked(then)) waiting = roster.blamed(then) ? Waiting::kParticipants : Waiting::kQueue;
  if (!outbox.has_frame_room()) waiting = Waiting::kQueue;
  if (waiting != Waiting::kNothing) {
    held = true;
    return false;
  }
  pacing.frame_started(now_ns, config.free_rate ? stalled : held);
  held = false;
  stalled = false;
  return produce_frame(snapshot_due);
}

bool Host::Impl::produce_frame(bool snapshot_due) {
  roster.frame_starts(moment());
  const std::int64_t start = clock();
  const bool was_out_of_reach = live != nullptr && live->stream().target_out_of_reach();
  const auto frame = source->next(snapshot_due, outbox);
  if (!frame) {
    state = State::kEnded;
    if (live != nullptr) error = live->error();
    return false;
  }
  const std::int64_t produced = clock();
  push_delta(outbox, config.epoch, *frame, wall_ns + (produced - start));
  times.published(frame->frame, now_ns);
  if (live != nullptr) {
    if (live->stream().target_out_of_reach() != was_out_of_reach) note_target();
    note_mishaps();
  }
  report = {.frame = frame->frame,
            .hash = frame->hash,
            .payload_bytes = frame->payload.size(),
            .corrected = frame->corrected,
            .frame_ms = static_cast<double>(produced - start) * 1e-6,
            .step_ms = static_cast<double>(frame->step_ns) * 1e-6};
  ++totals.frames;
  totals.payload_bytes += report.payload_bytes;
  totals.corrected += report.corrected;
  frame_durations.add(produced - start);
  status.frame_took(produced - start);
  return true;
}

void Host::Impl::make_snapshot() {
  source->snapshot(snapshot);
  transfer.start(config.epoch, {}, source->frame(), snapshot, joins.ready(), now_ns);
  joins.served(roster, now_ns);
  ++totals.snapshots;
}

HostTotals Host::Impl::totals_now() const {
  HostTotals now = totals;
  now.snapshot_bytes = transfer.bytes();
  now.reply_bytes = outbox.traffic().replies;
  now.input_bytes = outbox.traffic().scheduled_inputs;
  now.suspended_ms = static_cast<std::uint64_t>(suspended_ns / kMillisecond);
  now.refused_inputs += inputs.refused();
  now.refused_messages += port->dropped();
  now.demotions = roster.demotions();
  now.clients_seen = roster.seen();
  now.frame_ms_p50 = frame_durations.quantile_ms(0.5);
  now.frame_ms_p99 = frame_durations.quantile_ms(0.99);
  return now;
}

void Host::Impl::publish_status() {
  if (!status.due(now_ns)) return;
  status.publish(totals_now(),
                 {.frame = source->frame(),
                  .bodies = source->agreed().alive_count(),
                  .at_rest = source->agreed().rest_count(),
                  .participants = roster.counted(),
                  .observers = roster.watching(),
                  .window = roster.window(),
                  .threshold_m = threshold_m(),
                  .codec = layout().codec,
                  .predictor = layout().predictor},
                 now_ns);
}

void Host::Impl::plan_wake() {
  wake_ns = now_ns + kLongestWakeNs;
  const auto at = [this](std::int64_t ns) { wake_ns = std::min(wake_ns, ns); };
  if (state == State::kClaiming) at(*first_poll_ns + config.claim_ns);
  if (state == State::kRunning && waiting == Waiting::kNothing) at(pacing.deadline_ns());
  if (waiting == Waiting::kQueue) at(now_ns + kMillisecond);
  if (waiting == Waiting::kParticipants) {
    if (const auto left = roster.patience_ns(moment())) {
      at(std::max(now_ns, pacing.suspended_from_ns()) + *left + kMillisecond);
    }
  }
  if (const auto due = joins.due_ns(transfer, now_ns))
    at(*due > now_ns ? *due : std::max(*due, frame_awaited_until_ns()));
  for (const auto& [id, account] : roster.accounts()) {
    const bool unmatched = account.present && account.phase == transport::Phase::kJoining;
    if (unmatched || account.reply.schedule.changed()) at(now_ns + kShortWakeNs);
  }
  wake_ns = std::max(wake_ns, now_ns);
}

Result<std::unique_ptr<Host>> Host::create(HostConfig config, engine::Simulation& simulation,
                                           transport::ServerPort& port) {
  if (auto good = check(config, simulation); !good) return tl::unexpected(good.error());
  const auto drive = to_drive(config.stream.lattice, simulation.gravity(), simulation.damping_per_s());
  if (!drive) return tl::unexpected(drive.error());
  auto stream = Stream::create(config.stream, {.bodies = simulation.bodies(),
                                               .drive = *drive,
                                               .epoch = config.epoch,
                                               .frame = config.start_frame,
                                               .frame_rate_hz = config.frame_rate_hz});
  if (!stream) return tl::unexpected(stream.error());
  auto source = std::make_unique<LiveSource>(config, simulation, std::move(*stream));
  LiveSource* const live = source.get();
  return create(std::move(config), std::move(source), port).map([live](std::unique_ptr<Host> host) {
    host->impl_->live = live;
    return host;
  });
}

Result<std::unique_ptr<Host>> Host::create(ServiceConfig config, std::unique_ptr<FrameSource> source,
                                           transport::ServerPort& port) {
  if (auto good = check(config); !good) return tl::unexpected(good.error());
  if (auto good = transport::check_announcement(source->session()); !good)
    return tl::unexpected(good.error());
  return std::unique_ptr<Host>(new Host(std::make_unique<Impl>(std::move(config), std::move(source), port)));
}

Host::Host(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Host::~Host() = default;

bool Host::poll(std::int64_t now_ns, std::int64_t wall_ns) {
  impl_->now_ns = now_ns;
  impl_->wall_ns = wall_ns;
  return impl_->poll();
}

std::int64_t Host::next_wake_ns() const { return impl_->wake_ns; }
Host::State Host::state() const { return impl_->state; }
const std::optional<Error>& Host::error() const { return impl_->error; }
const FrameReport& Host::report() const { return impl_->report; }
Outbox& Host::outbox() { return impl_->outbox; }
Result<Frame> Host::inject(const engine::Input& input) {
  if (impl_->live == nullptr) return fail(ErrorCode::kUnsupported, "nothing is simulated here");
  return impl_->live->inject(input, impl_->outbox);
}
Result<void> Host::set_parameters(const StreamParameters& parameters) {
  if (impl_->live == nullptr) return fail(ErrorCode::kUnsupported, "nothing is simulated here");
  return impl_->live->stream().set_parameters(parameters);
}
const StreamParameters& Host::parameters() const { return impl_->source->parameters(); }
double Host::threshold_m() const { return impl_->threshold_m(); }
const transport::SessionMessage& Host::session() const { return impl_->source->session(); }
Frame Host::frame() const { return impl_->source->frame(); }
const tandem::State& Host::agreed() const { return impl_->source->agreed(); }
std::uint64_t Host::hash() const { return impl_->report.hash; }
std::uint32_t Host::window() const { return impl_->roster.window(); }
std::uint32_t Host::participants() const { return impl_->roster.counted(); }
std::uint32_t Host::observers() const { return impl_->roster.watching(); }

HostTotals Host::totals() const { return impl_->totals_now(); }

std::vector<std::string> Host::take_notices() { return impl_->roster.notices().take(); }

}  // namespace tandem::host
