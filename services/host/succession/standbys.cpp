#include "services/host/succession/standbys.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/wire/parcels.hpp"

namespace tandem::host {
namespace {

constexpr std::int64_t kLookNs = kSecond / 10;
constexpr std::int64_t kTellFullNs = 10 * kSecond;
constexpr std::int64_t kReadyNs = kSecond;  // how recently a ready server was heard

std::string name_of(const Standbys::Candidate& server) {
  return fmt::format("server {:016x} of rank {}", server.id, server.rank);
}

transport::CheckpointMessage cut(const checkpoint::Encoded& checkpoint, std::size_t part) {
  transport::CheckpointMessage message;
  message.epoch = checkpoint.moment.epoch;
  message.frame = checkpoint.moment.frame;
  message.journal = checkpoint.journal;
  transport::cut_part(checkpoint.bytes, Standbys::kPartBytes, part, message);
  return message;
}

}  // namespace

void Standbys::heard(const transport::Received<transport::StandbyMessage>& received, Notices& notices,
                     std::int64_t now_ns) {
  const transport::StandbyMessage& message = received.message;
  if (message.epoch != epoch_ || message.protocol_version != transport::kProtocolVersion) return;
  auto known = servers_.find(message.standby);
  if (known == servers_.end()) {
    if (!has_seat(received, notices, now_ns)) return;
    Server server;
    server.id = message.standby;
    server.from = received.from;
    known = servers_.emplace(message.standby, std::move(server)).first;
    const bool queued = outbox_->push(OpenStandby{message.standby});
    TANDEM_ASSERT(queued && servers_.size() <= kMaxServers);
  }
  Server& server = known->second;
  if (server.from != received.from) return;
  server.rank = message.rank;
  server.heard_ns = now_ns;
  server.journal = message.journal;
  // It cannot hold what it was not sent.
  if (message.holds_frame <= server.offered) server.holds_frame = message.holds_frame;
  if (server.holds_frame > 0) {
    std::erase(successors_, server.from);
    successors_.push_back(server.from);
    if (successors_.size() > kMaxSuccessors) successors_.erase(successors_.begin());
  }
  if (server.holds_frame > 0 && !std::exchange(server.told, true))
    notices.add(fmt::format("{} stands by, from frame {} on", name_of(server), server.holds_frame), now_ns);
  if (!server.sending) return;
  Sending& sending = *server.sending;
  const Frame frame = sending.checkpoint->moment.frame;
  if (message.part_frame == frame && message.part_count == sending.passage.parts()) {
    sending.passage.acknowledged(message.missing, now_ns);
    next_ns_ = now_ns;
  }
  if (server.holds_frame >= frame) server.sending.reset();
}

// One server a participant, so that none can take all seats.
bool Standbys::has_seat(const transport::Received<transport::StandbyMessage>& received, Notices& notices,
                        std::int64_t now_ns) {
  const bool has_one =
      std::ranges::any_of(servers_, [&](const auto& entry) { return entry.second.from == received.from; });
  if (has_one || !outbox_->has_control_room()) return false;
  if (servers_.size() < kMaxServers) return true;
  if (now_ns - told_full_ns_ >= kTellFullNs) {
    told_full_ns_ = now_ns;
    notices.add(fmt::format("{} servers stand by, so server {:016x} is not served", kMaxServers,
                            received.message.standby),
                now_ns);
  }
  return false;
}

void Standbys::look(transport::ServerPort& port, Notices& notices, std::int64_t now_ns) {
  if (now_ns - looked_ns_ < kLookNs) return;
  looked_ns_ = now_ns;
  for (auto it = servers_.begin(); it != servers_.end();) {
    Server& server = it->second;
    if (now_ns - server.heard_ns >= kSilentNs && outbox_->has_control_room()) {
      static_cast<void>(outbox_->push(CloseStandby{server.id}));
      if (server.told) notices.add(fmt::format("{} stands by no longer", name_of(server)), now_ns);
      it = servers_.erase(it);
      continue;
    }
    if (!server.follows) server.follows = port.follows(server.from, server.id);
    ++it;
  }
}

bool Standbys::any() const {
  return std::ranges::any_of(servers_, [](const auto& entry) { return entry.second.follows; });
}

void Standbys::offer(const std::shared_ptr<const checkpoint::Encoded>& checkpoint, std::int64_t now_ns) {
  TANDEM_ASSERT(checkpoint->moment.epoch == epoch_);
  const std::size_t size = checkpoint->bytes.size();
  if (size == 0 || size > transport::kMaxCheckpointBytes) return;
  for (auto& [id, server] : servers_) {
    if (!server.follows || server.holds_frame >= checkpoint->moment.frame) continue;
    // A link that is too thin for one checkpoint in each interval gets them more seldom.
    if (server.sending && !server.sending->passage.complete() && !server.sending->passage.exhausted())
      continue;
    if (server.sending && server.sending->checkpoint == checkpoint) continue;
    server.offered = checkpoint->moment.frame;
    server.sending.emplace(Sending{checkpoint, accounts::Passage(size, kPartBytes, now_ns)});
    next_ns_ = now_ns;
  }
}

void Standbys::send(std::int64_t now_ns) {
  if (now_ns < next_ns_) return;
  next_ns_ = INT64_MAX;
  for (auto& [id, server] : servers_) {
    if (!server.sending || server.sending->passage.exhausted()) continue;
    if (!serve(server, now_ns)) return;
    next_ns_ = std::min(next_ns_, server.sending->passage.next_ns());
  }
}

bool Standbys::serve(Server& server, std::int64_t now_ns) {
  Sending& sending = *server.sending;
  while (true) {
    if (!outbox_->has_checkpoint_room()) {
      next_ns_ = now_ns + kMillisecond;
      return false;
    }
    const auto part = sending.passage.next(now_ns);
    if (!part) return true;
    bytes_ += sending.passage.size_of(*part);
    const bool queued = outbox_->push(CheckpointPart{server.id, cut(*sending.checkpoint, *part)});
    TANDEM_ASSERT(queued);
  }
}

const Standbys::Candidate* Standbys::first_ready(std::int64_t now_ns) const {
  const Candidate* first = nullptr;
  for (const auto& [id, server] : servers_) {
    const bool ready = server.follows && server.holds_frame > 0 && now_ns - server.heard_ns < kReadyNs;
    if (ready && (first == nullptr || server.rank < first->rank)) first = &server;
  }
  return first;
}

const Standbys::Candidate* Standbys::find(transport::ClientId id) const {
  const auto known = servers_.find(id);
  return known == servers_.end() ? nullptr : &known->second;
}

}  // namespace tandem::host
