#include "services/host/inputs.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sdk/transport/limits.hpp"

namespace tandem::host {
namespace {

using transport::Reason;

void remember(InputAccount& account, const transport::ReplyEntry& entry, std::int64_t now_ns) {
  if (account.outcomes.size() == transport::kReplyRing) account.outcomes.erase(account.outcomes.begin());
  account.outcomes.push_back({entry, now_ns});
}

bool remembers(const InputAccount& account, std::uint64_t number) {
  return std::ranges::any_of(account.outcomes,
                             [number](const Outcome& outcome) { return outcome.entry.number == number; });
}

bool well_formed(const transport::InputMessage& input) {
  return input.values.size() <= transport::kMaxInputValues &&
         input.bytes.size() <= transport::kMaxInputBytes &&
         std::ranges::all_of(input.values, [](double value) { return std::isfinite(value); });
}

// A client that was handed a snapshot and sends input plays already, whichever topic is faster.
bool may_play(const Account& account) {
  return account.phase == transport::Phase::kPlaying ||
         (account.join.served && account.join.served_attempt == account.attempt);
}

}  // namespace

Reason InputDesk::handle(Account& account, const transport::InputMessage& input, std::int64_t now_ns) {
  account.reply.outcomes_due = true;
  if (input.epoch != epoch_) {
    // Its number belongs to another epoch's count, so it must not enter this one's outcomes.
    ++refused_;
    account.reply.once = Reason::kStaleEpoch;
    return Reason::kStaleEpoch;
  }
  transport::ReplyEntry entry{.number = input.number, .frame = 0, .code = 0};
  if (input.number <= account.inputs.highest) {
    // The first outcome of a number is the one that counts; the reply tells it again.
    ++refused_;
    entry.code = static_cast<std::uint32_t>(Reason::kDuplicate);
    if (!remembers(account.inputs, input.number)) remember(account.inputs, entry, now_ns);
    return Reason::kDuplicate;
  }
  const Reason reason = decide(account, input, now_ns, entry.frame);
  if (reason != Reason::kNone) ++refused_;
  entry.code = static_cast<std::uint32_t>(reason);
  account.inputs.highest = input.number;
  remember(account.inputs, entry, now_ns);
  return reason;
}

Reason InputDesk::decide(Account& account, const transport::InputMessage& input, std::int64_t now_ns,
                         Frame& acts_on) {
  if (!account.inputs.rate.take(now_ns)) return Reason::kRateLimited;
  if (!may_play(account)) return Reason::kNotPlaying;
  if (account.demoted) return Reason::kDemoted;
  if (account.role() == transport::Role::kObserver) return Reason::kObserver;
  if (!well_formed(input)) return Reason::kInvalid;
  return accept({.kind = input.kind, .values = input.values, .bytes = input.bytes},
                {input.client, input.number}, acts_on);
}

Reason InputDesk::accept(const engine::Input& input, const Source& source, Frame& acts_on) {
  const engine::Classification effect = simulation_->classify(input);
  switch (effect.effect) {
    case engine::Classification::Effect::kScheduled:
      return schedule(input, effect, source, acts_on);
    case engine::Classification::Effect::kImmediate:
      if (immediate_.size() >= kMostImmediate) return Reason::kRateLimited;
      immediate_.push_back(input);
      acts_on = next_frame();
      return Reason::kNone;
    case engine::Classification::Effect::kRefused:
      break;
  }
  return Reason::kInvalid;
}

Reason InputDesk::schedule(const engine::Input& input, const engine::Classification& effect,
                           const Source& source, Frame& acts_on) {
  const auto drive = to_drive(stream_->config().lattice, effect.gravity, effect.damping_per_s);
  if (!drive) return Reason::kInvalid;
  // s + A: no client can have simulated it, as none is further than A beyond delta s - 1.
  const Frame frame = next_frame() + stream_->config().layout.lead;
  if (scheduling_frame_ != frame) scheduled_now_ = 0;
  if (scheduled_now_ >= kMostScheduledPerFrame || !outbox_->has_control_room()) return Reason::kRateLimited;
  const std::uint64_t number = stream_->last_input() + 1;
  if (!stream_->schedule({.number = number, .frame = frame, .drive = *drive})) return Reason::kRateLimited;
  scheduling_frame_ = frame;
  ++scheduled_now_;
  scheduled_.push_back({frame, input});
  acts_on = frame;
  const bool queued = outbox_->push(transport::ScheduledInputMessage{
      .epoch = epoch_,
      .number = number,
      .frame = frame,
      .source_client = source.client,
      .source_number = source.number,
      .kind = static_cast<std::uint32_t>(transport::ScheduledKind::kDrive),
      .values = {drive->gravity[0], drive->gravity[1], drive->gravity[2], drive->damping}});
  return queued ? Reason::kNone : Reason::kRateLimited;
}

Result<Frame> InputDesk::inject(const engine::Input& input) {
  Frame acts_on = 0;
  switch (accept(input, {}, acts_on)) {
    case Reason::kNone:
      return acts_on;
    case Reason::kInvalid:
      return fail(ErrorCode::kInvalidArgument, "the simulation refuses this input");
    default:
      return fail(ErrorCode::kCapacity, "too many inputs at once");
  }
}

void InputDesk::apply(Frame s) {
  const auto later = std::ranges::find_if(scheduled_, [s](const Waiting& w) { return w.frame > s; });
  for (auto it = scheduled_.begin(); it != later; ++it) simulation_->apply(it->input);
  scheduled_.erase(scheduled_.begin(), later);
  for (const engine::Input& input : immediate_) simulation_->apply(input);
  immediate_.clear();
}

}  // namespace tandem::host
