#include "services/host/replies.hpp"

#include <algorithm>

namespace tandem::host {
namespace {

using transport::Reason;

Reason standing_reason(const Account& account) {
  if (account.reply.once != Reason::kNone) return account.reply.once;
  return account.demoted ? Reason::kDemoted : Reason::kNone;
}

bool elapsed(std::int64_t last_ns, std::int64_t now_ns, std::int64_t gap_ns) {
  return last_ns == INT64_MIN || now_ns - last_ns >= gap_ns;
}

std::vector<transport::ReplyEntry> told(const InputAccount& inputs, std::int64_t now_ns) {
  std::vector<transport::ReplyEntry> entries;
  for (const Outcome& outcome : inputs.outcomes) {
    if (now_ns - outcome.at_ns <= ReplyDesk::kToldNs) entries.push_back(outcome.entry);
  }
  return entries;
}

}  // namespace

// False while there is no room: a writer has to end before its client's next one is opened.
bool ReplyDesk::close_forgotten(Roster& roster) {
  auto& forgotten = roster.forgotten();
  while (!forgotten.empty()) {
    if (!outbox_->push(CloseReplies{forgotten.back()})) return false;
    forgotten.pop_back();
  }
  return true;
}

void ReplyDesk::send_due(Roster& roster, std::int64_t now_ns, std::int64_t wall_ns) {
  if (!close_forgotten(roster)) return;
  for (auto& [id, account] : roster.accounts()) {
    ReplyAccount& reply = account.reply;
    if (!account.present || !elapsed(reply.last_ns, now_ns, kChangeNs)) continue;
    const std::int64_t echo_ns = account.role() == transport::Role::kObserver ? 2 * kEchoNs : kEchoNs;
    const bool echo = reply.clock_moved && elapsed(reply.last_ns, now_ns, echo_ns);
    // Only a reply that goes out for nothing but outcomes spends of their rate.
    if (!reply.due && !echo && !(reply.outcomes_due && reply.outcomes.take(now_ns))) continue;
    if (!reply.open && !outbox_->push(OpenReplies{id})) return;
    reply.open = true;
    const bool queued =
        outbox_->push(transport::ReplyMessage{.client = id,
                                              .epoch = epoch_,
                                              .role = account.role(),
                                              .phase = account.phase,
                                              .reason = static_cast<std::uint32_t>(standing_reason(account)),
                                              .highest_input = account.inputs.highest,
                                              .client_clock_ns = account.clock_ns,
                                              .server_time_ns = wall_ns,
                                              .entries = told(account.inputs, now_ns)});
    if (!queued) return;
    reply.due = reply.outcomes_due = reply.clock_moved = false;
    reply.once = Reason::kNone;
    reply.last_ns = now_ns;
  }
}

void ReplyDesk::refuse(transport::ClientId client, Reason reason, std::int64_t now_ns, std::int64_t wall_ns) {
  auto stranger = std::ranges::find(strangers_, client, &Stranger::client);
  if (stranger == strangers_.end()) stranger = std::ranges::min_element(strangers_, {}, &Stranger::last_ns);
  if (stranger->client == client && !elapsed(stranger->last_ns, now_ns, kEchoNs)) return;
  if (!strangers_rate_.take(now_ns)) return;
  *stranger = {client, now_ns};
  transport::ReplyMessage reply;
  reply.client = client;
  reply.epoch = epoch_;
  reply.reason = static_cast<std::uint32_t>(reason);
  reply.server_time_ns = wall_ns;
  // Without room the stranger asks again and is answered then.
  if (!outbox_->push(std::move(reply))) stranger->last_ns = INT64_MIN;
}

}  // namespace tandem::host
