#include "services/host/clients/inputs.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/wire/limits.hpp"

namespace tandem::host {
namespace {

using transport::Reason;

bool well_formed(const transport::InputMessage& input) {
  return input.values.size() <= transport::kMaxInputValues &&
         input.bytes.size() <= transport::kMaxInputBytes &&
         std::ranges::all_of(input.values, [](double value) { return std::isfinite(value); });
}

// A client that was sent a snapshot and sends input plays already, whichever topic is faster.
bool may_play(const Account& account) {
  return account.phase == transport::Phase::kPlaying || was_served(account);
}

}  // namespace

Reason InputDesk::handle(Account& account, Peer& peer, const transport::InputMessage& input,
                         std::int64_t now_ns) {
  account.reply.schedule.on_outcome();
  if (input.epoch != epoch_) {
    // Its number belongs to another epoch's count, so it must not enter this one's outcomes.
    refused_.add(Reason::kStaleEpoch);
    account.reply.once = Reason::kStaleEpoch;
    return Reason::kStaleEpoch;
  }
  transport::ReplyEntry entry{.number = input.number, .frame = 0, .code = 0};
  if (input.number <= account.inputs.highest) {
    // The first outcome of a number counts; the reply repeats it.
    refused_.add(Reason::kDuplicate);
    entry.code = static_cast<std::uint32_t>(Reason::kDuplicate);
    const bool undecided = std::ranges::binary_search(account.inputs.undecided, input.number);
    if (!undecided && !account.inputs.outcomes.has(input.number)) account.inputs.outcomes.add(entry, now_ns);
    return Reason::kDuplicate;
  }
  InputVerdict verdict = decide(account, peer, input, now_ns);
  if (verdict.fate == InputVerdict::Fate::kLater) {
    TANDEM_ASSERT(account.inputs.undecided.empty() || account.inputs.undecided.back() < input.number);
    account.inputs.highest = input.number;
    account.inputs.undecided.push_back(input.number);
    return Reason::kNone;
  }
  if (verdict.reason != Reason::kNone) refused_.add(verdict.reason);
  journal_->decided(input, account.from, verdict);
  entry.frame = verdict.acts_on;
  entry.code = static_cast<std::uint32_t>(verdict.reason);
  account.inputs.highest = input.number;
  account.inputs.outcomes.add(entry, now_ns, std::move(verdict.text));
  return verdict.reason;
}

InputVerdict InputDesk::decide(Account& account, Peer& peer, const transport::InputMessage& input,
                               std::int64_t now_ns) {
  if (!account.inputs.rate.take(now_ns)) return {Reason::kRateLimited};
  if (!may_play(account)) return {Reason::kNotPlaying};
  if (account.demoted) return {Reason::kDemoted};
  if (account.role() == transport::Role::kObserver) return {Reason::kObserver};
  if (!well_formed(input)) return {Reason::kInvalid};
  // As many as a reply can list.
  if (account.inputs.undecided.size() >= transport::kReplyRing) return {Reason::kRateLimited};
  return source_->accept(input, {now_ns, &peer.inputs}, *outbox_);
}

void InputDesk::settle(Roster& roster, InputVerdict&& later, std::int64_t now_ns) {
  const auto found = roster.accounts().find(later.claim.sender);
  if (found == roster.accounts().end()) return;
  Account& account = found->second;
  if (std::erase(account.inputs.undecided, later.claim.number) == 0) return;
  account.reply.schedule.on_outcome();
  if (later.fate != InputVerdict::Fate::kDecided) return;
  if (later.reason != Reason::kNone) refused_.add(later.reason);
  account.inputs.outcomes.add({.number = later.claim.number,
                               .frame = later.acts_on,
                               .code = static_cast<std::uint32_t>(later.reason)},
                              now_ns, std::move(later.text));
}

Result<Frame> InputDesk::inject(const engine::Input& input, Frame next, std::int64_t now_ns) {
  const transport::InputMessage own{.kind = input.kind, .values = input.values, .bytes = input.bytes};
  const InputVerdict verdict = source_->accept(own, {}, *outbox_);
  switch (verdict.reason) {
    case Reason::kNone:
      journal_->decided(own, {}, verdict);
      journal_->write(next, now_ns);
      return verdict.acts_on;
    case Reason::kInvalid:
      return fail(ErrorCode::kInvalidArgument,
                  "the simulation refuses this input" + (verdict.text.empty() ? "" : ": " + verdict.text));
    case Reason::kRecording:
      return fail(ErrorCode::kUnsupported, "nothing is simulated here");
    default:
      return fail(ErrorCode::kCapacity, "too many inputs at once");
  }
}

}  // namespace tandem::host
