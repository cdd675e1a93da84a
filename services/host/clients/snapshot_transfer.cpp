#include "services/host/clients/snapshot_transfer.hpp"

#include <algorithm>
#include <set>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/wire/parcels.hpp"

namespace tandem::host {
namespace {

// Maximum number of parts queued for one receiver at a time, so that many receivers take turns.
constexpr int kTurn = 16;
// What a part takes on the network besides its bytes: fields and headers, and the receiver's acknowledgement.
constexpr double kOtherBytes = 450;

static_assert(transport::part_count(transport::kMaxSnapshotBytes, SnapshotTransfer::kPartBytes) <=
              transport::kMaxSnapshotParts);

std::shared_ptr<const Snapshot> make_snapshot(Epoch epoch, StreamId stream, Frame frame,
                                              std::span<const std::byte> bytes) {
  auto snapshot = std::make_shared<Snapshot>();
  snapshot->bytes.assign(bytes.begin(), bytes.end());
  snapshot->head.epoch = epoch;
  snapshot->head.stream = stream;
  snapshot->head.frame = frame;
  return snapshot;
}

}  // namespace

transport::SnapshotMessage Snapshot::cut(std::size_t part) const {
  transport::SnapshotMessage message = head;
  transport::cut_part(bytes, SnapshotTransfer::kPartBytes, part, message);
  return message;
}

void SnapshotTransfer::start(Epoch epoch, StreamId stream, Frame frame, std::span<const std::byte> bytes,
                             std::span<const transport::ClientId> receivers, std::int64_t now_ns) {
  // A frame is cut only once while it does not advance, because receivers distinguish snapshots by their
  // frame. Inputs that came since reach them by the topic of inputs.
  const bool is_same = latest_ && latest_->head.epoch == epoch && latest_->head.stream == stream &&
                       latest_->head.frame == frame;
  if (!is_same) latest_ = make_snapshot(epoch, stream, frame, bytes);
  largest_ = std::max(largest_, latest_->bytes.size());
  if (held_count_and_bytes(true, now_ns).second + latest_->bytes.size() > kMaxHeldBytes)
    std::erase_if(receivers_, [&](const auto& entry) { return stalled(entry.second.passage, now_ns); });
  for (const transport::ClientId client : receivers) {
    receivers_.insert_or_assign(
        client, Receiver{latest_, accounts::Passage(latest_->bytes.size(), kPartBytes, now_ns)});
  }
  next_ns_ = now_ns;
}

bool SnapshotTransfer::names(const Receiver& receiver, const transport::AckMessage& ack) {
  return ack.phase == transport::Phase::kJoining && ack.stream == receiver.snapshot->head.stream &&
         ack.snapshot_frame == receiver.snapshot->head.frame &&
         ack.snapshot_parts == receiver.passage.parts();
}

void SnapshotTransfer::acknowledged(const transport::AckMessage& ack, std::int64_t now_ns) {
  const auto found = receivers_.find(ack.client);
  if (found == receivers_.end()) return;
  accounts::Passage& passage = found->second.passage;
  if (names(found->second, ack)) {
    passage.acknowledged(ack.missing, now_ns);
  } else if (passage.progress_ns() != passage.began_ns()) {
    // A receiver that held parts of this snapshot and no longer names it cannot use it.
    receivers_.erase(found);
    return;
  }
  next_ns_ = now_ns;
}

void SnapshotTransfer::send(const std::map<transport::ClientId, Account>& accounts, double deltas_bytes_per_s,
                            std::int64_t now_ns) {
  std::erase_if(receivers_, [&](const auto& entry) {
    const auto account = accounts.find(entry.first);
    const bool joins =
        account != accounts.end() && joined_stream(account->second) == entry.second.snapshot->head.stream.id;
    return !joins || entry.second.passage.exhausted();
  });
  next_ns_ = INT64_MAX;
  if (receivers_.empty()) return;
  for (auto& [client, receiver] : receivers_) {
    receiver.passage.limit(accounts::limit_under_cap(accounts.at(client).cap_kbit_s, deltas_bytes_per_s,
                                                     kPartBytes, kOtherBytes));
  }
  // Serves receivers in turns: the one after the last served comes first.
  auto next = receivers_.upper_bound(last_served_);
  std::size_t satisfied = 0;  // receivers in a row that were satisfied in this round
  while (satisfied < receivers_.size()) {
    if (next == receivers_.end()) next = receivers_.begin();
    const std::uint64_t before = bytes_;
    const bool goes_on = serve(next->first, next->second, now_ns);
    if (bytes_ != before) last_served_ = next->first;
    if (!goes_on) return;
    satisfied = bytes_ == before ? satisfied + 1 : 0;
    ++next;
  }
  for (const auto& [client, receiver] : receivers_) next_ns_ = std::min(next_ns_, receiver.passage.next_ns());
}

bool SnapshotTransfer::serve(transport::ClientId client, Receiver& receiver, std::int64_t now_ns) {
  for (int i = 0; i < kTurn; ++i) {
    if (!outbox_->has_snapshot_room()) {
      next_ns_ = now_ns + kMillisecond;
      return false;
    }
    const auto part = receiver.passage.next(now_ns);
    if (!part) break;
    const bool queued = outbox_->push(SnapshotPart{client, receiver.snapshot->cut(*part)});
    TANDEM_ASSERT(queued);  // there is room, and no other thread pushes
    bytes_ += receiver.passage.size_of(*part);
  }
  return true;
}

bool SnapshotTransfer::serves(transport::ClientId client, std::int64_t now_ns) const {
  const auto receiver = receivers_.find(client);
  return receiver != receivers_.end() &&
         now_ns - receiver->second.passage.heard_ns() < accounts::kHostTransfers.stalled_ns;
}

bool SnapshotTransfer::stalled(const accounts::Passage& passage, std::int64_t now_ns) {
  return now_ns - passage.progress_ns() >= accounts::kHostTransfers.stalled_ns ||
         now_ns - passage.began_ns() >= accounts::kHostTransfers.longest_ns;
}

std::pair<std::size_t, std::size_t> SnapshotTransfer::held_count_and_bytes(bool all,
                                                                           std::int64_t now_ns) const {
  std::set<const Snapshot*> held;
  std::size_t bytes = 0;
  for (const auto& [client, receiver] : receivers_) {
    if ((all || !stalled(receiver.passage, now_ns)) && held.insert(receiver.snapshot.get()).second)
      bytes += receiver.snapshot->bytes.size();
  }
  return {held.size(), bytes};
}

bool SnapshotTransfer::full(std::int64_t now_ns) const {
  const auto [count, bytes] = held_count_and_bytes(false, now_ns);
  return count >= 2 && bytes + largest_ > kMaxHeldBytes;
}

}  // namespace tandem::host
