#include "services/host/clients/replies.hpp"

#include <algorithm>
#include <utility>

namespace tandem::host {
namespace {

using transport::Reason;

Reason standing_reason(const Account& account) {
  if (account.reply.once != Reason::kNone) return account.reply.once;
  return account.demoted ? Reason::kDemoted : Reason::kNone;
}

}  // namespace

// Returns false while there is no room: a client's old writer has to end before its next one is opened.
bool ReplyDesk::close_forgotten(Roster& roster) {
  auto& forgotten = roster.forgotten();
  while (!forgotten.empty()) {
    if (!outbox_->push(CloseClient{forgotten.back()})) return false;
    forgotten.pop_back();
  }
  return true;
}

void ReplyDesk::send_due(Roster& roster, std::int64_t now_ns, std::int64_t wall_ns) {
  if (!close_forgotten(roster)) return;
  for (auto& [id, account] : roster.accounts()) {
    ReplyAccount& reply = account.reply;
    if (!account.present || !reply.schedule.due(account.role(), now_ns)) continue;
    if (!account.open && !outbox_->push(OpenClient{id})) return;
    account.open = true;
    transport::ReplyMessage message{.client = id,
                                    .epoch = epoch_,
                                    .role = account.role(),
                                    .phase = account.phase,
                                    .reason = static_cast<std::uint32_t>(standing_reason(account)),
                                    .needed_kbit_s = reply.needed_kbit_s,
                                    .highest_input = account.inputs.decided(),
                                    .client_clock_ns = account.clock_ns,
                                    .server_time_ns = wall_ns,
                                    .entries = {},
                                    .texts = {}};
    account.inputs.outcomes.tell(message, now_ns);
    if (!outbox_->push(std::move(message))) return;
    reply.schedule.sent(account.role(), now_ns);
    reply.once = Reason::kNone;
    reply.needed_kbit_s = 0;
  }
}

void ReplyDesk::refuse(transport::ClientId client, Reason reason, std::int64_t now_ns, std::int64_t wall_ns,
                       std::uint32_t needed_kbit_s) {
  auto stranger = std::ranges::find(strangers_, client, &Stranger::client);
  if (stranger == strangers_.end()) stranger = std::ranges::min_element(strangers_, {}, &Stranger::last_ns);
  const bool answered = stranger->client == client && stranger->last_ns != INT64_MIN;
  if (answered && now_ns - stranger->last_ns < kStrangerNs) return;
  if (!strangers_rate_.take(now_ns)) return;
  *stranger = {client, now_ns};
  transport::ReplyMessage reply;
  reply.client = client;
  reply.epoch = epoch_;
  reply.reason = static_cast<std::uint32_t>(reason);
  reply.needed_kbit_s = needed_kbit_s;
  reply.server_time_ns = wall_ns;
  // Without room the stranger asks again and is answered then.
  if (!outbox_->push(std::move(reply))) stranger->last_ns = INT64_MIN;
}

}  // namespace tandem::host
