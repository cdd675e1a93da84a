#include "services/host/succession/standbys.hpp"

#include <fmt/format.h>

#include <utility>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/wire/parcels.hpp"

namespace tandem::host {
namespace {

constexpr std::int64_t kLookNs = kSecond / 10;
constexpr std::int64_t kTellFullNs = 10 * kSecond;
constexpr std::int64_t kReadyNs = kSecond;  // how recently a ready server was heard

std::string name_of(const Standbys::KnownStandby& standby) {
  return fmt::format("server {:016x} of rank {}", standby.id, standby.rank);
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
  auto known = standbys_.find(message.standby);
  if (known == standbys_.end()) {
    if (!has_seat(received, notices, now_ns)) return;
    Served standby;
    standby.id = message.standby;
    standby.from = received.from;
    known = standbys_.emplace(message.standby, std::move(standby)).first;
    const bool queued = outbox_->push(OpenStandby{message.standby});
    TANDEM_ASSERT(queued && standbys_.size() <= kMaxStandbys);
  }
  Served& standby = known->second;
  if (standby.from != received.from) return;
  standby.rank = message.rank;
  standby.heard_ns = now_ns;
  standby.journal = message.journal;
  // It cannot hold what it was not sent.
  if (message.holds_frame <= standby.offered) standby.holds_frame = message.holds_frame;
  if (standby.holds_frame > 0) {
    std::erase(stood_by_, standby.from);
    stood_by_.push_back(standby.from);
    if (stood_by_.size() > kMaxStoodBy) stood_by_.erase(stood_by_.begin());
  }
  if (standby.holds_frame > 0 && !std::exchange(standby.told, true))
    notices.add(fmt::format("{} stands by, from frame {} on", name_of(standby), standby.holds_frame), now_ns);
  if (!standby.sending) return;
  Sending& sending = *standby.sending;
  const Frame frame = sending.checkpoint->moment.frame;
  if (message.part_frame == frame && message.part_count == sending.passage.parts()) {
    sending.passage.acknowledged(message.missing, now_ns);
    next_ns_ = now_ns;
  }
  if (standby.holds_frame >= frame) standby.sending.reset();
}

// One server a participant, so that none can take all seats.
bool Standbys::has_seat(const transport::Received<transport::StandbyMessage>& received, Notices& notices,
                        std::int64_t now_ns) {
  const bool has_one =
      std::ranges::any_of(standbys_, [&](const auto& entry) { return entry.second.from == received.from; });
  if (has_one || !outbox_->has_control_room()) return false;
  if (standbys_.size() < kMaxStandbys) return true;
  if (now_ns - told_full_ns_ >= kTellFullNs) {
    told_full_ns_ = now_ns;
    notices.add(fmt::format("{} servers stand by, so server {:016x} is not served", kMaxStandbys,
                            received.message.standby),
                now_ns);
  }
  return false;
}

void Standbys::look(transport::ServerPort& port, Notices& notices, std::int64_t now_ns) {
  if (now_ns - looked_ns_ < kLookNs) return;
  looked_ns_ = now_ns;
  for (auto it = standbys_.begin(); it != standbys_.end();) {
    Served& standby = it->second;
    if (now_ns - standby.heard_ns >= kSilentNs && outbox_->has_control_room()) {
      static_cast<void>(outbox_->push(CloseStandby{standby.id}));
      if (standby.told) notices.add(fmt::format("{} stands by no longer", name_of(standby)), now_ns);
      it = standbys_.erase(it);
      continue;
    }
    if (!standby.follows) standby.follows = port.follows(standby.from, standby.id);
    ++it;
  }
}

bool Standbys::any() const {
  return std::ranges::any_of(standbys_, [](const auto& entry) { return entry.second.follows; });
}

void Standbys::offer(const std::shared_ptr<const checkpoint::Encoded>& checkpoint, std::int64_t now_ns) {
  TANDEM_ASSERT(checkpoint->moment.epoch == epoch_);
  const std::size_t size = checkpoint->bytes.size();
  if (size == 0 || size > transport::kMaxCheckpointBytes) return;
  for (auto& [id, standby] : standbys_) {
    if (!standby.follows || standby.holds_frame >= checkpoint->moment.frame) continue;
    // A link that is too thin for one checkpoint in each interval gets them more seldom.
    if (standby.sending && !standby.sending->passage.complete() && !standby.sending->passage.exhausted())
      continue;
    if (standby.sending && standby.sending->checkpoint == checkpoint) continue;
    standby.offered = checkpoint->moment.frame;
    standby.sending.emplace(Sending{checkpoint, accounts::Passage(size, kPartBytes, now_ns)});
    next_ns_ = now_ns;
  }
}

void Standbys::send(std::int64_t now_ns) {
  if (now_ns < next_ns_) return;
  next_ns_ = INT64_MAX;
  for (auto& [id, standby] : standbys_) {
    if (!standby.sending || standby.sending->passage.exhausted()) continue;
    if (!serve(standby, now_ns)) return;
    next_ns_ = std::min(next_ns_, standby.sending->passage.next_ns());
  }
}

bool Standbys::serve(Served& standby, std::int64_t now_ns) {
  Sending& sending = *standby.sending;
  while (true) {
    if (!outbox_->has_checkpoint_room()) {
      next_ns_ = now_ns + kMillisecond;
      return false;
    }
    const auto part = sending.passage.next(now_ns);
    if (!part) return true;
    bytes_ += sending.passage.size_of(*part);
    const bool queued = outbox_->push(CheckpointPart{standby.id, cut(*sending.checkpoint, *part)});
    TANDEM_ASSERT(queued);
  }
}

const Standbys::KnownStandby* Standbys::first_ready(std::int64_t now_ns) const {
  const KnownStandby* first = nullptr;
  for (const auto& [id, standby] : standbys_) {
    const bool ready = standby.follows && standby.holds_frame > 0 && now_ns - standby.heard_ns < kReadyNs;
    if (ready && (first == nullptr || standby.rank < first->rank)) first = &standby;
  }
  return first;
}

const Standbys::KnownStandby* Standbys::find(transport::ClientId id) const {
  const auto known = standbys_.find(id);
  return known == standbys_.end() ? nullptr : &known->second;
}

}  // namespace tandem::host
