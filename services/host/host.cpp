#include "services/host/host.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "sdk/statistics/duration_histogram.hpp"
#include "services/host/claim.hpp"
#include "services/host/inputs.hpp"
#include "services/host/joins.hpp"
#include "services/host/mbit.hpp"
#include "services/host/mirror.hpp"
#include "services/host/pacing.hpp"
#include "services/host/replies.hpp"
#include "services/host/roster.hpp"
#include "services/host/window.hpp"

namespace tandem::host {
namespace {

using transport::Reason;

constexpr std::int64_t kLongestWakeNs = 50 * kMillisecond;
constexpr std::int64_t kShortWakeNs = 10 * kMillisecond;
constexpr std::int64_t kLookNs = kSecond / 4;  // between looks for rivals and for dead clients
// A pause of the server itself (a debugger, a busy machine) must not be charged to its clients.
constexpr std::int64_t kLongestChargeNs = 2 * kLongestWakeNs;
constexpr std::size_t kMostNotices = 256;  // until somebody takes them
constexpr double kRawBytesPerBody = 24;

Result<void> check(const HostConfig& config, const engine::Simulation& simulation) {
  if (auto named = transport::check_session_name(config.session); !named) return named;
  const auto refuse = [](std::string message) {
    return fail(ErrorCode::kInvalidArgument, std::move(message));
  };
  if (!(config.frame_rate_hz >= 1 && config.frame_rate_hz <= 1000))
    return refuse("frame rate must lie in 1..1000 Hz");
  if (config.layout.lead > 1) return refuse("lead must be 0 or 1");
  if (config.window_ceiling < 1 || config.window_ceiling > 64)
    return refuse("window ceiling must lie in 1..64");
  if (config.window && (*config.window < 1 || *config.window > config.window_ceiling)) {
    return refuse(fmt::format("window must lie in 1..{}", config.window_ceiling));
  }
  if (config.client_limit == 0 || config.participant_limit == 0)
    return refuse("client limits must be positive");
  if (config.types.size() != config.layout.type_count)
    return refuse(fmt::format("{} body types, {} described", config.layout.type_count, config.types.size()));
  if (config.quality && !valid_goal(*config.quality, config.layout.parameters)) {
    return refuse("automatic quality: the threshold must lie between its smallest and its largest");
  }
  if (config.quality && config.budget < least_budget(*config.quality, config.frame_rate_hz)) {
    return refuse(fmt::format(
        "a budget of {} bytes a frame is too tight for a target of {} Mbit/s, which needs at least {} bytes",
        config.budget, config.quality->target_mbit_per_s,
        least_budget(*config.quality, config.frame_rate_hz)));
  }
  if (config.epoch == 0) return refuse("epoch must not be 0");
  const std::uint32_t capacity = simulation.capacity();
  if (capacity != config.layout.capacity)
    return refuse(fmt::format("{} slots for a simulation of {}", config.layout.capacity, capacity));
  const engine::Bodies bodies = simulation.bodies();
  bool whole = bodies.alive.size() == capacity && bodies.type.size() == capacity;
  for (const auto& column : bodies.position) whole = whole && column.size() == capacity;
  for (const auto& column : bodies.velocity) whole = whole && column.size() == capacity;
  if (!whole) return refuse("the simulation's body columns are not of its capacity");
  return {};
}

transport::SessionMessage session_message(const HostConfig& config, const ServerTimeline& timeline) {
  transport::SessionMessage session;
  session.session = config.session;
  session.epoch = config.epoch;
  session.layout = config.layout;
  session.frame_rate_hz = config.frame_rate_hz;
  session.lattice_unit = config.lattice.unit;
  session.window_ceiling = config.window_ceiling;
  session.max_delta_bytes = static_cast<std::uint32_t>(timeline.payload_bound());
  session.max_snapshot_bytes = static_cast<std::uint32_t>(timeline.snapshot_bound());
  session.client_cost_ns = config.client_cost_ns;
  session.scene = config.scene;
  session.scene_description = config.scene_description;
  session.types = config.types;
  session.layout_hash = transport::layout_hash(session);
  return session;
}

}  // namespace

struct Host::Impl {
  Impl(HostConfig configuration, engine::Simulation& full, transport::ServerPort& endpoints,
       ServerTimeline server, const Drive& drive)
      : config(std::move(configuration)),
        simulation(&full),
        port(&endpoints),
        timeline(std::move(server)),
        mirror(config.lattice, full.capacity(), config.layout.type_count),
        outbox(config.outbox),
        roster({.epoch = config.epoch,
                .client_limit = config.client_limit,
                .participant_limit = config.participant_limit,
                .stall_timeout_ns = config.stall_timeout_ns,
                .fixed_window = config.window,
                .window_ceiling = config.window_ceiling}),
        inputs({.epoch = config.epoch, .lead = config.layout.lead, .lattice = config.lattice}, full, timeline,
               outbox),
        replies(config.epoch, outbox),
        claim(config.epoch, endpoints.self()),
        pacing(config.frame_rate_hz, config.free_rate),
        session(session_message(config, timeline)),
        parameters(config.layout.parameters) {
    mirror.start(full.bodies());
    timeline.start(config.start_frame, mirror.target(), drive);
    timeline.set_clock(config.clock_ns);
    if (config.quality) {
      const StepRule steps = step_rule(config.layout.codec, !config.layout.codec_tables.empty());
      quality.emplace(*config.quality, steps, parameters, full.capacity(), config.frame_rate_hz);
      if (steps != StepRule::kLeave) timeline.set_statistics(&quality->statistics());
    }
    if (config.gains) {
      gains.emplace(*config.gains, full.capacity(), parameters);
      timeline.set_evidence(&gains->evidence());
    }
    bodies = mirror.target().alive_count();
    report.frame = config.start_frame;
    report.hash = timeline.hash();
  }

  // --- What the rules see ---
  [[nodiscard]] Roster::Now moment() const {
    const Frame unwritten = outbox.unwritten_frames();
    return {.ns = now_ns,
            .frame = timeline.frame(),
            .written = timeline.frame() - std::min(timeline.frame(), unwritten),
            .period_ns = pacing.period_ns()};
  }
  [[nodiscard]] std::int64_t clock() const { return config.clock_ns == nullptr ? 0 : config.clock_ns(); }

  // --- One poll, in this order ---
  bool poll();
  void claim_name();
  void charge_waiting();
  void receive();
  void look_around();
  bool advance_if_due();
  void serve_joiners();
  void publish_status();
  void plan_wake();

  void digest(const transport::Received<transport::AckMessage>& ack);
  void digest(const transport::Received<transport::InputMessage>& input);
  void produce_frame();
  bool choose_quality(const ServerTimeline::FrameResult& result);
  void publish(const ServerTimeline::FrameResult& result, std::int64_t published_wall_ns);
  void note_foreigner(transport::ClientId client);

  enum class Waiting : std::uint8_t { kNothing, kParticipants, kQueue };

  HostConfig config;
  engine::Simulation* simulation;
  transport::ServerPort* port;
  ServerTimeline timeline;
  Mirror mirror;
  Outbox outbox;
  Roster roster;
  InputDesk inputs;
  JoinDesk joins;
  ReplyDesk replies;
  Claim claim;
  Pacing pacing;
  PublishTimes times;
  std::optional<QualityControl> quality;
  std::optional<GainControl> gains;
  transport::SessionMessage session;
  CodecParameters parameters;  // in force

  State state = State::kClaiming;
  std::optional<Error> error;
  std::int64_t now_ns = 0, wall_ns = 0, last_poll_ns = 0, wake_ns = 0;
  std::optional<std::int64_t> first_poll_ns;
  std::int64_t last_look_ns = 0, next_status_ns = 0, last_foreign_note_ns = INT64_MIN;
  Waiting waiting = Waiting::kNothing;  // what the due frame waits for, since the last poll
  Frame written_then = 0;               // at the last poll
  bool held = false;                    // the due frame had to wait
  bool stalled = false;                 // and was counted as a stall
  std::int64_t suspended_ns = 0;

  FrameReport report;
  HostTotals totals;
  DurationHistogram frame_durations, second_durations;
  HostTotals second_totals;  // at the last status
  std::int64_t second_ns = 0;
  std::uint32_t bodies = 0;
  std::vector<std::byte> snapshot;
  std::vector<std::string> notices;
  std::vector<transport::Received<transport::AckMessage>> acks;
  std::vector<transport::Received<transport::InputMessage>> input_samples;
};

bool Host::Impl::poll() {
  if (!first_poll_ns) {
    first_poll_ns = now_ns;
    second_ns = now_ns;
  }
  bool produced = false;
  if (state == State::kClaiming) claim_name();
  if (state == State::kWaiting || state == State::kRunning) {
    charge_waiting();
    receive();
    look_around();
    roster.refresh(moment());
    produced = advance_if_due();
    serve_joiners();
    replies.send_due(roster.accounts(), now_ns, wall_ns);
    publish_status();
  }
  last_poll_ns = now_ns;
  plan_wake();
  return produced;
}

void Host::Impl::claim_name() {
  error = claim.check(*port, false);
  if (error) {
    state = State::kRefused;
    return;
  }
  if (now_ns - *first_poll_ns < config.claim_ns || !outbox.push(session)) return;
  state = State::kWaiting;
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
  const Reason reason = roster.acknowledge(ack.message, ack.from, times, moment());
  if (reason == Reason::kNone) return;
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

void Host::Impl::note_foreigner(transport::ClientId client) {
  if (last_foreign_note_ns != INT64_MIN && now_ns - last_foreign_note_ns < kSecond) return;
  last_foreign_note_ns = now_ns;
  if (notices.size() >= kMostNotices) return;
  notices.push_back(fmt::format("client {} is used by a second participant: refused", client_name(client)));
}

void Host::Impl::look_around() {
  // More often while somebody is waited for: he may be gone.
  if (now_ns - last_look_ns < (waiting == Waiting::kParticipants ? kLongestWakeNs : kLookNs)) return;
  last_look_ns = now_ns;
  roster.look_for_dead(*port, moment());
  error = claim.check(*port, true);
  if (error) state = State::kRefused;
}

bool Host::Impl::advance_if_due() {
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
  produce_frame();
  return true;
}

void Host::Impl::produce_frame() {
  roster.frame_starts(moment());
  const std::int64_t start = clock();
  inputs.apply(timeline.frame() + 1);
  simulation->step();
  const std::int64_t stepped = clock();
  mirror.update(simulation->bodies(), simulation->events());
  for (const LifecycleRecord& record : mirror.lifecycle()) {
    if (record.kind == LifecycleKind::kSpawn) ++bodies;
    if (record.kind == LifecycleKind::kDespawn) --bodies;
  }
  const auto result = timeline.advance(mirror.target(), mirror.lifecycle(), config.budget);
  const std::int64_t applied = clock();
  publish(result, wall_ns + (applied - start));
  times.published(result.frame, now_ns);
  const bool coarser = quality && choose_quality(result);
  const bool steered = gains && gains->after_frame(parameters);
  if (coarser || steered) timeline.set_parameters(parameters);
  report = {.frame = result.frame,
            .hash = result.hash,
            .payload_bytes = result.payload.size(),
            .corrected = result.corrected,
            .frame_ms = static_cast<double>(applied - start) * 1e-6,
            .step_ms = static_cast<double>(stepped - start) * 1e-6};
  ++totals.frames;
  totals.payload_bytes += report.payload_bytes;
  totals.corrected += report.corrected;
  frame_durations.add_ms(report.frame_ms);
  second_durations.add_ms(report.frame_ms);
}

bool Host::Impl::choose_quality(const ServerTimeline::FrameResult& result) {
  const bool before = quality->out_of_reach();
  const bool changed = quality->after_frame(result.payload.size(), result.corrected, parameters);
  if (quality->out_of_reach() != before && notices.size() < kMostNotices) {
    const double target = config.quality->target_mbit_per_s;
    notices.push_back(before
                          ? fmt::format("the target of {} Mbit/s is kept again", target)
                          : fmt::format("the target of {} Mbit/s is exceeded even at the largest threshold, "
                                        "{:.3g} m",
                                        target, config.quality->largest_threshold * config.lattice.unit));
  }
  return changed;
}

void Host::Impl::publish(const ServerTimeline::FrameResult& result, std::int64_t published_wall_ns) {
  const std::size_t size = result.payload.size();
  const std::size_t parts = std::max<std::size_t>((size + kPartBytes - 1) / kPartBytes, 1);
  for (std::size_t part = 0; part < parts; ++part) {
    const auto bytes =
        result.payload.subspan(part * kPartBytes, std::min(kPartBytes, size - part * kPartBytes));
    transport::DeltaMessage delta;
    delta.epoch = config.epoch;
    delta.frame = result.frame;
    delta.part = static_cast<std::uint32_t>(part);
    delta.parts = static_cast<std::uint32_t>(parts);
    delta.last_input = result.last_input;
    delta.server_time_ns = published_wall_ns;
    delta.hash = result.hash;
    delta.payload.assign(bytes.begin(), bytes.end());
    // There is room: it was made sure of before the frame started, and this thread is the only producer.
    static_cast<void>(outbox.push(std::move(delta)));
  }
}

void Host::Impl::serve_joiners() {
  if (joins.due(roster.accounts(), *port, now_ns) && outbox.has_snapshot_room()) {
    timeline.snapshot(snapshot);
    transport::SnapshotMessage message;
    message.slot = static_cast<std::uint32_t>(timeline.frame() % 4);
    message.epoch = config.epoch;
    message.frame = timeline.frame();
    message.bytes = snapshot;
    if (outbox.push(std::move(message))) {
      joins.served(roster.accounts(), now_ns);
      ++totals.snapshots;
    }
  }
  if (joins.dispose_due(roster.accounts()) && outbox.push(DisposeSnapshots{})) joins.disposed();
}

void Host::Impl::publish_status() {
  if (now_ns < next_status_ns) return;
  next_status_ns = now_ns + kSecond;
  const double elapsed_s = std::max(static_cast<double>(now_ns - second_ns) * 1e-9, 1e-9);
  const auto frames = static_cast<double>(totals.frames - second_totals.frames);
  const double per_frame = frames > 0 ? 1 / frames : 0;
  transport::ServerStatusMessage status;
  status.session = config.session;
  status.epoch = config.epoch;
  status.frame = timeline.frame();
  status.uptime_s = static_cast<double>(now_ns - *first_poll_ns) * 1e-9;
  status.frame_rate_hz = frames / elapsed_s;
  status.mbit_per_s =
      static_cast<double>(totals.payload_bytes - second_totals.payload_bytes) * 8 / kBitsPerMbit / elapsed_s;
  status.raw_mbit_per_s = bodies * kRawBytesPerBody * 8 * status.frame_rate_hz / kBitsPerMbit;
  status.frame_ms_p50 = second_durations.quantile_ms(0.5);
  status.frame_ms_p99 = second_durations.quantile_ms(0.99);
  status.corrected_per_frame = static_cast<double>(totals.corrected - second_totals.corrected) * per_frame;
  status.bodies = bodies;
  status.participants = roster.counted();
  status.observers = roster.watching();
  status.window = roster.window();
  status.payload_bytes = totals.payload_bytes;
  status.stalls = totals.stalls;
  status.suspended_ms = static_cast<std::uint64_t>(suspended_ns / kMillisecond);
  status.refused_inputs = totals.refused_inputs + inputs.refused();
  status.refused_messages = totals.refused_messages + port->dropped();
  status.snapshots = totals.snapshots;
  status.queue_high_water = static_cast<std::uint32_t>(outbox.high_water());
  // Best effort: without room this second's figures are lost.
  if (!outbox.push(std::move(status))) return;
  second_totals = totals;
  second_ns = now_ns;
  second_durations.clear();
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
  if (const auto due = joins.due_ns()) at(*due);
  for (const auto& [id, account] : roster.accounts()) {
    const bool unmatched = account.present && account.phase == transport::Phase::kJoining;
    if (unmatched || account.reply.due) at(now_ns + kShortWakeNs);
  }
  wake_ns = std::max(wake_ns, now_ns);
}

Result<std::unique_ptr<Host>> Host::create(HostConfig config, engine::Simulation& simulation,
                                           transport::ServerPort& port) {
  if (auto good = check(config, simulation); !good) return tl::unexpected(good.error());
  auto drive = to_drive(config.lattice, simulation.gravity(), simulation.damping_per_s());
  if (!drive) return tl::unexpected(drive.error());
  auto timeline = ServerTimeline::create(config.layout, config.epoch, {.run_blocks = config.run_blocks});
  if (!timeline) return tl::unexpected(timeline.error());
  auto impl = std::make_unique<Impl>(std::move(config), simulation, port, std::move(*timeline), *drive);
  return std::unique_ptr<Host>(new Host(std::move(impl)));
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
Result<Frame> Host::inject(const engine::Input& input) { return impl_->inputs.inject(input); }
Result<void> Host::set_parameters(const CodecParameters& parameters) {
  if (!valid_parameters(parameters)) return fail(ErrorCode::kInvalidArgument, "parameters out of range");
  if (impl_->quality) return fail(ErrorCode::kInvalidArgument, "automatic quality decides the parameters");
  impl_->parameters = parameters;
  impl_->timeline.set_parameters(parameters);
  return {};
}
const CodecParameters& Host::parameters() const { return impl_->parameters; }
double Host::threshold_m() const { return impl_->parameters.threshold * impl_->config.lattice.unit; }
const transport::SessionMessage& Host::session() const { return impl_->session; }
Frame Host::frame() const { return impl_->timeline.frame(); }
const tandem::State& Host::agreed() const { return impl_->timeline.state(); }
std::uint64_t Host::hash() const { return impl_->report.hash; }
std::uint32_t Host::window() const { return impl_->roster.window(); }
std::uint32_t Host::participants() const { return impl_->roster.counted(); }
std::uint32_t Host::observers() const { return impl_->roster.watching(); }

HostTotals Host::totals() const {
  HostTotals totals = impl_->totals;
  totals.suspended_ms = static_cast<std::uint64_t>(impl_->suspended_ns / kMillisecond);
  totals.refused_inputs += impl_->inputs.refused();
  totals.refused_messages += impl_->port->dropped();
  totals.demotions = impl_->roster.demotions();
  totals.clients_seen = impl_->roster.seen();
  totals.frame_ms_p50 = impl_->frame_durations.quantile_ms(0.5);
  totals.frame_ms_p99 = impl_->frame_durations.quantile_ms(0.99);
  return totals;
}

std::vector<std::string> Host::take_notices() {
  std::vector<std::string> all = std::move(impl_->notices);
  impl_->notices.clear();
  auto& more = impl_->roster.notices();
  all.insert(all.end(), more.begin(), more.end());
  more.clear();
  return all;
}

}  // namespace tandem::host
