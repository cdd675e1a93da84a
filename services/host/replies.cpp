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

}  // namespace

void ReplyDesk::send_due(std::map<transport::ClientId, Account>& accounts, std::int64_t now_ns,
                         std::int64_t wall_ns) {
  for (auto& [id, account] : accounts) {
    ReplyAccount& reply = account.reply;
    const bool change = reply.due && elapsed(reply.last_ns, now_ns, kChangeNs);
    const bool echo = reply.clock_moved && elapsed(reply.last_ns, now_ns, kEchoNs);
    if (!account.present || !(change || echo)) continue;
    const bool queued =
        outbox_->push(transport::ReplyMessage{.client = id,
                                              .epoch = epoch_,
                                              .role = account.role(),
                                              .phase = account.phase,
                                              .reason = static_cast<std::uint32_t>(standing_reason(account)),
                                              .highest_input = account.inputs.highest,
                                              .client_clock_ns = account.clock_ns,
                                              .server_time_ns = wall_ns,
                                              .entries = account.inputs.outcomes});
    if (!queued) return;
    reply = {.due = false, .clock_moved = false, .once = Reason::kNone, .last_ns = now_ns};
  }
}

void ReplyDesk::refuse(transport::ClientId client, Reason reason, std::int64_t now_ns, std::int64_t wall_ns) {
  auto stranger = std::ranges::find(strangers_, client, &Stranger::client);
  if (stranger == strangers_.end()) stranger = std::ranges::min_element(strangers_, {}, &Stranger::last_ns);
  if (stranger->client == client && !elapsed(stranger->last_ns, now_ns, kEchoNs)) return;
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
