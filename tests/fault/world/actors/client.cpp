#include "tests/fault/world/actors/client.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tandem::world {
namespace {

constexpr std::int64_t kLooksNs = 50 * kMs;  // a thread that waits on DDS wakes for other things, too

const char* name_of(ClientPhase phase) {
  static constexpr const char* kNames[] = {"searches", "refuses the session", "joins", "plays"};
  return kNames[static_cast<std::size_t>(phase)];
}

}  // namespace

Client::Client(Stage& stage, std::string name, ClientSettings settings, const Service& server,
               std::uint64_t first_id)
    : Actor(stage, std::move(name)),
      settings_(std::move(settings)),
      server_(server),
      dice_(stage.settings.seed * 977 + first_id),
      next_id_(first_id) {}

Client::~Client() = default;

std::vector<transport::ParticipantId> Client::participants() const {
  if (!port_) return {};
  return {port_->self()};
}

void Client::on_start() {
  port_ = std::move(*stage_.network.make_client("default"));
  witness_ = std::make_unique<Witness>(stage_, name());
  client::CoreOptions options;
  options.session = "default";
  options.id = next_id_++;  // as the SDK draws another for each process
  options.role = settings_.role;
  options.lead = settings_.lead;
  options.prefer = settings_.prefer;
  core_ = std::make_unique<client::ClientCore>(std::move(options), *port_, witness_.get());
  witness_->watch(*core_);
  if (settings_.draws) core_->start_sampling();
  due_ns_ = 0;
  next_input_ns_ = steady_ns();
  next_draw_ns_ = steady_ns();
  told_phase_ = ClientPhase::kSearching;
}

void Client::drop() {
  core_.reset();
  witness_.reset();
  port_.reset();
  last_input_.reset();
}

void Client::on_crash(bool /*power_fails*/) { drop(); }
void Client::on_leave() { drop(); }

void Client::on_poll() {
  due_ns_ = std::min(core_->poll({steady_ns(), wall_ns()}), steady_ns() + kLooksNs);
  if (core_->phase() != told_phase_) {
    told_phase_ = core_->phase();
    if (told_phase_ == ClientPhase::kPlaying) stage_.known_ids[next_id_ - 1] = core_->session()->epoch;
    tell(name_of(told_phase_) + (told_phase_ == ClientPhase::kRefused ? ": " + core_->status().reason : ""));
  }
  // Damage on the way looks like a client that computes otherwise (STATES, "Joining again"); its user tries
  // again.
  if (told_phase_ == ClientPhase::kRefused && stage_.network.counts().damaged > 0) {
    drop();
    ended(stage_.now_ns + kSecond);
    return;
  }
  if (settings_.inputs_per_s > 0 && steady_ns() >= next_input_ns_) {
    next_input_ns_ =
        steady_ns() + static_cast<std::int64_t>(dice_.uniform(0.2, 1.8) * 1e9 / settings_.inputs_per_s);
    send_input();
  }
  if (settings_.draws && steady_ns() >= next_draw_ns_) {
    next_draw_ns_ = steady_ns() + 100 * kMs;
    draw();
  }
  if (const ClientTimeline* timeline = core_->timeline();
      timeline != nullptr && timeline->now() > timeline->applied() + core_->status().lead)
    blame("same state", "simulated beyond its lead, at frame " + std::to_string(timeline->now()));
}

void Client::send_input() {
  if (settings_.role != transport::Role::kParticipant || core_->phase() != ClientPhase::kPlaying) return;
  const double unique = stage_.unique();
  const std::uint64_t kind = dice_.below(10);
  const client::Now now{steady_ns(), wall_ns()};
  transport::InputKind what = transport::InputKind::kGravity;
  std::vector<double> values{unique};
  if (kind < 7) {
    values.insert(values.end(), {-9 + dice_.uniform(-3, 3), dice_.uniform(-3, 3)});
  } else if (kind < 9) {
    what = transport::InputKind::kPush;
    values.insert(values.end(), {0, 0, 1.5, dice_.uniform(-2, 2), dice_.uniform(0, 3), 0});
  } else if (dice_.chance(0.5)) {
    what = static_cast<transport::InputKind>(77);
  }
  const auto number = core_->send(what, values, {}, now);
  if (!number) return;
  witness_->sent(*number, unique, kind == 9);
  last_input_ = {.client = next_id_ - 1,
                 .epoch = core_->session()->epoch,
                 .number = *number,
                 .client_frame = core_->status().frame,
                 .kind = static_cast<std::uint32_t>(what),
                 .values = std::move(values),
                 .bytes = {}};
}

// What no client may do, and none does that has our SDK.
void Client::repeat() {
  if (up() && !paused() && last_input_) static_cast<void>(port_->write(*last_input_));
}

void Client::burst(std::uint32_t inputs) {
  if (!up() || paused()) return;
  for (std::uint32_t i = 0; i < inputs; ++i) send_input();
}

void Client::prefer(std::uint64_t salt) {
  static constexpr const char* kPreferences[] = {"auto", "bandwidth", "computing", "error", "stream1"};
  if (up() && !paused()) core_->prefer(kPreferences[salt % 5]);
}

void Client::draw() {
  const bool extrapolates = dice_.chance(0.5);
  if (!core_->sample(sample_, extrapolates ? SampleMode::kExtrapolate : SampleMode::kInterpolate,
                     {steady_ns(), wall_ns()}))
    return;
  for (std::size_t i = 0; i < sample_.positions.size(); ++i)
    if (sample_.alive[i / 3] != 0 && !std::isfinite(sample_.positions[i]))
      return blame("same state", "draws a body that is nowhere");
}

void Client::check() {
  if (!core_) return;
  const client::Statistics& figures = core_->statistics();
  if (figures.queue_high_water > 16384)
    blame("memory", std::to_string(figures.queue_high_water) + " deltas were buffered");
  // Whoever should get in does.
  const std::int64_t well_ns = std::min(well_for_ns(), server_.serves_for_ns());
  if (well_ns < Rules::kPlaysNs) return;
  const ClientStatus status = core_->status();
  const host::Host& host = *server_.host();
  if (status.phase != ClientPhase::kPlaying)
    return blame("getting in", std::string(name_of(status.phase)) + " for " + std::to_string(well_ns / kMs) +
                                   " ms without a fault (" + status.reason + "; attempt " +
                                   std::to_string(core_->join_attempt()) + ", " +
                                   std::to_string(figures.refused_messages) + " messages refused)");
  if (status.epoch != host.session().epoch)
    return blame("getting in", "plays epoch " + std::to_string(status.epoch));
  const auto behind = static_cast<Frame>(stage_.settings.frame_rate_hz);
  if (status.frame + behind < host.frame())
    return blame("getting in", "is at frame " + std::to_string(status.frame) + ", the server at " +
                                   std::to_string(host.frame()));
  const bool participates = settings_.role == transport::Role::kParticipant;
  // Where samples are lost, one that was demoted is behind for a moment in most 10 s, and stays an observer.
  if (well_ns > Rules::kPlaysNs + Rules::kReturnsNs && participates && stage_.settings.link.loss == 0 &&
      status.role != ClientRole::kParticipant)
    blame("getting in", "is no participant: " + status.reason);
}

void Client::check_end() {
  if (witness_) witness_->check_end();
}

void Witness::on_session(const transport::SessionMessage& session) {
  if (session.epoch == epoch_) return;
  const bool goes_on = session.continues_epoch != 0 && session.continues_epoch == epoch_;
  for (auto& [number, sent] : sent_) sent.unbroken = sent.unbroken && goes_on;
  epoch_ = session.epoch;
  next_ = 0;
}

// One that changes its stream while many deltas wait goes on from a later frame than it had.
void Witness::on_stream(const transport::StreamMessage& stream) {
  stream_ = stream.id.id;
  const ClientTimeline* timeline = core_->timeline();
  if (timeline == nullptr) {
    next_ = 0;
    return;
  }
  if (timeline->applied() + 1 < next_)
    blame("same state", "frame " + std::to_string(timeline->applied()) + " of another stream after frame " +
                            std::to_string(next_ - 1));
  next_ = timeline->applied() + 1;
  compare(stream_, timeline->applied(), timeline->hash());
}

// It acts on a frame that no client has simulated.
void Witness::on_scheduled(const transport::ScheduledInputMessage& input) {
  const ClientTimeline* timeline = core_->timeline();
  if (timeline == nullptr || input.epoch != epoch_ || input.number <= timeline->inputs_held()) return;
  if (input.frame <= timeline->now())
    blame("acts once", "scheduled input " + std::to_string(input.number) + " acts on frame " +
                           std::to_string(input.frame) + ", and frame " + std::to_string(timeline->now()) +
                           " is simulated");
}

void Witness::compare(std::uint32_t stream, Frame frame, std::uint64_t hash) {
  if (const std::string wrong = stage_.truth.hold(epoch_, stream, frame, hash); !wrong.empty())
    blame("same state", wrong);
}

void Witness::on_snapshot(const transport::SnapshotMessage& snapshot) {
  epoch_ = snapshot.epoch;
  stream_ = snapshot.stream.id;
  next_ = snapshot.frame + 1;
  const ClientTimeline* timeline = core_->timeline();
  if (timeline != nullptr && timeline->applied() == snapshot.frame)
    compare(stream_, snapshot.frame, timeline->hash());
}

void Witness::on_applied(Epoch epoch, const client::CompleteDelta& delta) {
  stage_.journal.fold(delta.hash);
  if (epoch != epoch_ || (next_ != 0 && delta.frame != next_))
    blame("same state", "frame " + std::to_string(delta.frame) + " after frame " + std::to_string(next_ - 1));
  next_ = delta.frame + 1;
  if (!stage_.truth.knows(epoch, stream_, delta.frame))
    blame("same state", "frame " + std::to_string(delta.frame) + " was never made");
  compare(stream_, delta.frame, delta.hash);
  if (core_->timeline() == nullptr || core_->timeline()->hash() != delta.hash)
    blame("same state", "holds another state at frame " + std::to_string(delta.frame));
}

void Witness::on_resync(client::ResyncReason reason) {
  next_ = 0;
  stage_.journal.add(stage_.now_ns, who_, std::string("joins again: ") + client::describe(reason));
}

void Witness::sent(std::uint64_t number, double value, bool never, bool shares) {
  Sent& input = sent_[number];
  input.value = value;
  input.never = never;
  input.shares = shares;
  input.at_ns = stage_.now_ns;
  input.epoch = epoch_;
}

void Witness::on_outcome(const client::InputOutcome& outcome) {
  using Kind = client::InputOutcome::Kind;
  const auto found = sent_.find(outcome.number);
  const std::string input = "input " + std::to_string(outcome.number);
  if (found == sent_.end()) return blame("acts once", input + " was never sent");
  Sent& sent = found->second;
  if (outcome.kind == Kind::kLost ? ++sent.lost > 1 : ++sent.times > 1)
    blame("acts once", input + " has two outcomes");
  sent.told = outcome;
  const auto acted = stage_.truth.acted(epoch_, sent.value);
  if (of_ == Of::kViewer && (sent.shares || outcome.kind == Kind::kLost)) return;
  if (outcome.kind == Kind::kActed) {
    if (!acted) return blame("acts once", input + " is said to have acted, and did not");
    if (*acted != outcome.frame)
      blame("acts once", input + " acted on frame " + std::to_string(*acted) + ", but its sender was told " +
                             std::to_string(outcome.frame));
    if (sent.never) blame("acts once", input + " is of no kind that can act");
  } else if (outcome.kind != Kind::kUnknown && acted) {
    blame("acts once",
          input + " acted on frame " + std::to_string(*acted) + ", but its sender was told it did not");
  }
}

void Witness::check_end() {
  using Kind = client::InputOutcome::Kind;
  if (core_->phase() != ClientPhase::kPlaying || epoch_ != stage_.live_epoch) return;
  for (const auto& [number, sent] : sent_) {
    const std::string input = "input " + std::to_string(number);
    const bool may_be_gone = stage_.network.counts().lost_for_good > 0;
    if (stage_.now_ns - sent.at_ns > 10 * kSecond && !sent.told && !may_be_gone) {
      blame("acts once", input + " of " + std::to_string(sent.at_ns / kMs) + " ms has no outcome");
      return;
    }
    if (!sent.told || !sent.unbroken) continue;
    const auto acted = stage_.truth.acted(epoch_, sent.value);
    if (sent.told->kind == Kind::kActed && acted != sent.told->frame)
      blame("acts once", input + " was told to have acted, and is not in this world");
    if ((sent.told->kind == Kind::kRefused || sent.told->kind == Kind::kLost) && acted)
      blame("acts once", input + " acted, but its sender was told otherwise");
  }
}

}  // namespace tandem::world
