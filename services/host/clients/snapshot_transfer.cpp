#include "services/host/clients/snapshot_transfer.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include "sdk/transport/limits.hpp"

namespace tandem::host {
namespace {

// DDS repairs its losses. If nothing is heard for two round trips and a little, a part is sent again, so that
// a link that comes back is found soon.
constexpr std::int64_t kProbeNs = kSecond / 4;
constexpr std::int64_t kFirstProbeNs = kSecond;  // maximum
constexpr std::int64_t kMostProbeNs = 2 * kSecond;
// After this time without an arrival the rate of the link is measured anew.
constexpr std::int64_t kForgetRateNs = 2 * kSecond;
// DDS repeats a part no longer than this, the lifespan of the writer.
constexpr std::int64_t kRepeatedNs = 3 * kSecond / 10;
// Maximum number of bytes sent to a receiver, in multiples of the snapshot's size.
constexpr std::size_t kMostTimes = 4;
constexpr std::size_t kSlackBytes = 64U << 10U;
// Maximum number of parts queued for one receiver at a time, so that many receivers take turns.
constexpr int kTurn = 16;

static_assert((transport::kMaxSnapshotBytes + SnapshotTransfer::kPartBytes - 1) /
                  SnapshotTransfer::kPartBytes <=
              transport::kMaxSnapshotParts);

// Returns for each part whether the acknowledgement says that it is held. An acknowledgement with the maximum
// number of runs says nothing about the parts after the last run.
std::vector<bool> held_parts(const transport::AckMessage& ack, std::size_t parts) {
  std::vector<bool> held(parts, true);
  std::size_t told = 0;
  for (std::size_t i = 0; i + 1 < ack.missing.size(); i += 2) {
    const std::size_t first = std::min<std::size_t>(ack.missing[i], parts);
    const std::size_t end = first + std::min<std::size_t>(ack.missing[i + 1], parts - first);
    std::fill(held.begin() + static_cast<std::ptrdiff_t>(first),
              held.begin() + static_cast<std::ptrdiff_t>(end), false);
    told = std::max(told, end);
  }
  if (ack.missing.size() >= 2 * transport::kMaxMissingRuns)
    std::fill(held.begin() + static_cast<std::ptrdiff_t>(told), held.end(), false);
  return held;
}

std::shared_ptr<const Snapshot> make_snapshot(Epoch epoch, StreamId stream, Frame frame,
                                              std::span<const std::byte> bytes) {
  auto snapshot = std::make_shared<Snapshot>();
  snapshot->bytes.assign(bytes.begin(), bytes.end());
  snapshot->head.epoch = epoch;
  snapshot->head.stream = stream;
  snapshot->head.frame = frame;
  snapshot->head.parts = static_cast<std::uint32_t>((bytes.size() + SnapshotTransfer::kPartBytes - 1) /
                                                    SnapshotTransfer::kPartBytes);
  snapshot->head.total_bytes = static_cast<std::uint32_t>(bytes.size());
  return snapshot;
}

}  // namespace

std::size_t Snapshot::size_of(std::size_t part) const {
  return std::min(SnapshotTransfer::kPartBytes, bytes.size() - part * SnapshotTransfer::kPartBytes);
}

transport::SnapshotMessage Snapshot::cut(std::size_t part) const {
  const auto piece = std::span(bytes).subspan(part * SnapshotTransfer::kPartBytes, size_of(part));
  transport::SnapshotMessage message = head;
  message.part = static_cast<std::uint32_t>(part);
  message.bytes.assign(piece.begin(), piece.end());
  return message;
}

Passage::Passage(std::shared_ptr<const Snapshot> snapshot, std::int64_t now_ns)
    : snapshot_(std::move(snapshot)),
      holds_(snapshot_->head.parts),
      began_ns_(now_ns),
      heard_ns_(now_ns),
      progress_ns_(now_ns),
      probed_ns_(now_ns) {}

bool Passage::names(const transport::AckMessage& ack) const {
  return ack.phase == transport::Phase::kJoining && ack.stream == snapshot_->head.stream &&
         ack.snapshot_frame == snapshot_->head.frame && ack.snapshot_parts == holds_.size();
}

bool Passage::acknowledged(const transport::AckMessage& ack, std::int64_t now_ns) {
  if (!names(ack)) {
    // A receiver that held parts of this snapshot and no longer names it cannot use it.
    return progress_ns_ == began_ns_;
  }
  heard_ns_ = now_ns;
  take_back(ack);
  arrived(held_parts(ack, holds_.size()), now_ns);
  return true;
}

// A receiver that was sent damaged bytes drops all that it holds, and may hold the next part that comes.
void Passage::take_back(const transport::AckMessage& ack) {
  for (std::size_t i = 0; i + 1 < ack.missing.size(); i += 2) {
    const std::size_t first = std::min<std::size_t>(ack.missing[i], holds_.size());
    const std::size_t end = first + std::min<std::size_t>(ack.missing[i + 1], holds_.size() - first);
    for (std::size_t part = first; part < end; ++part) {
      if (!holds_[part]) continue;
      holds_[part] = false;
      again_.push_back(part);
    }
  }
}

// DDS delivers in the order of sending. A part that left before one that arrived, and has not arrived itself,
// is lost.
void Passage::arrived(const std::vector<bool>& held, std::int64_t now_ns) {
  std::size_t bytes = 0;
  std::size_t settled = 0;  // entries up to the last one that arrived
  std::vector<bool> is_new(holds_.size()), counts(flying_.size());
  const auto given_up = [now_ns](const Flying& entry) { return now_ns - entry.sent.at_ns >= kRepeatedNs; };
  for (std::size_t i = 0; i < flying_.size(); ++i) {
    const Flying& entry = flying_[i];
    if (!held[entry.part]) continue;
    const bool is_first = !holds_[entry.part];
    if (is_first) {
      holds_[entry.part] = is_new[entry.part] = counts[i] = true;
      bytes += entry.sent.bytes;
    }
    // A part that was sent twice counts as arrived by the last copy for which there was time, if DDS has
    // given up all that left before that copy.
    const bool by_copy = !is_first && is_new[entry.part] && given_up(flying_[i - 1]) &&
                         now_ns - entry.sent.at_ns >= window_.least_ns();
    if (is_first || by_copy) settled = i + 1;
  }
  std::erase_if(again_, [this, &held](std::size_t part) {  // the part was on its way after all
    if (held[part]) holds_[part] = true;
    return held[part];
  });
  if (settled == 0) return;
  progress_ns_ = probed_ns_ = now_ns;
  probes_ = 0;
  window_.arrived(bytes, flying_[settled - 1].sent, now_ns);
  for (std::size_t i = 0; i < settled; ++i) {
    if (!counts[i]) window_.lost(flying_[i].sent);
    if (!holds_[flying_[i].part]) again_.push_back(flying_[i].part);
  }
  flying_.erase(flying_.begin(), flying_.begin() + static_cast<std::ptrdiff_t>(settled));
  std::erase_if(flying_, [this](const Flying& entry) {  // sent twice
    if (holds_[entry.part]) window_.lost(entry.sent);
    return holds_[entry.part];
  });
}

std::optional<std::size_t> Passage::wanted() {
  while (!again_.empty() && holds_[again_.front()]) again_.pop_front();
  if (!again_.empty()) return again_.front();
  if (unsent_ < holds_.size()) return unsent_;
  return std::nullopt;
}

std::optional<std::size_t> Passage::next(std::int64_t now_ns) {
  window_.look(now_ns);
  if (const auto part = wanted()) {
    if (window_.admits(snapshot_->size_of(*part), now_ns)) {
      if (*part == unsent_) {
        ++unsent_;
      } else {
        again_.pop_front();
      }
      return send(*part, now_ns);
    }
  }
  if (flying_.empty() || now_ns < probe_ns()) return std::nullopt;
  probed_ns_ = now_ns;
  ++probes_;
  if (now_ns - progress_ns_ >= kForgetRateNs) window_.start_over();
  return send(flying_.front().part, now_ns);
}

std::size_t Passage::send(std::size_t part, std::int64_t now_ns) {
  const std::size_t size = snapshot_->size_of(part);
  flying_.push_back({part, window_.sent(size, now_ns)});
  sent_bytes_ += size;
  return part;
}

std::int64_t Passage::probe_ns() const {
  const std::int64_t patience_ns = std::clamp(2 * window_.least_ns() + kSecond / 10, kProbeNs, kFirstProbeNs);
  return probed_ns_ + std::min(patience_ns << std::min(probes_, 3), kMostProbeNs);
}

std::int64_t Passage::next_ns() const {
  const bool waits = !again_.empty() || unsent_ < holds_.size();
  const std::int64_t probe = flying_.empty() ? INT64_MAX : probe_ns();
  if (!waits || window_.is_full(SnapshotTransfer::kPartBytes)) return probe;
  return std::min(probe, window_.next_ns());
}

bool Passage::exhausted() const { return sent_bytes_ > kMostTimes * snapshot_->bytes.size() + kSlackBytes; }

void SnapshotTransfer::start(Epoch epoch, StreamId stream, Frame frame, std::span<const std::byte> bytes,
                             std::span<const transport::ClientId> receivers, std::int64_t now_ns) {
  // A frame is cut only once while it does not advance, because receivers distinguish snapshots by their
  // frame. Inputs that came since reach them by the topic of inputs.
  const bool is_same = latest_ && latest_->head.epoch == epoch && latest_->head.stream == stream &&
                       latest_->head.frame == frame;
  if (!is_same) latest_ = make_snapshot(epoch, stream, frame, bytes);
  largest_ = std::max(largest_, latest_->bytes.size());
  if (held_count_and_bytes(true, now_ns).second + latest_->bytes.size() > kMostHeldBytes)
    std::erase_if(passages_, [&](const auto& entry) { return stalled(entry.second, now_ns); });
  for (const transport::ClientId client : receivers)
    passages_.insert_or_assign(client, Passage(latest_, now_ns));
  next_ns_ = now_ns;
}

void SnapshotTransfer::acknowledged(const transport::AckMessage& ack, std::int64_t now_ns) {
  const auto passage = passages_.find(ack.client);
  if (passage == passages_.end()) return;
  if (!passage->second.acknowledged(ack, now_ns)) {
    passages_.erase(passage);
    return;
  }
  next_ns_ = now_ns;
}

void SnapshotTransfer::send(const std::map<transport::ClientId, Account>& accounts, std::int64_t now_ns) {
  std::erase_if(passages_, [&](const auto& entry) {
    const auto account = accounts.find(entry.first);
    const bool joins = account != accounts.end() &&
                       joined_stream(account->second) == entry.second.snapshot()->head.stream.id;
    return !joins || entry.second.exhausted();
  });
  next_ns_ = INT64_MAX;
  if (passages_.empty()) return;
  // Serves receivers in turns: the one after the last served comes first.
  auto next = passages_.upper_bound(last_served_);
  std::size_t satisfied = 0;  // receivers in a row that were satisfied in this round
  while (satisfied < passages_.size()) {
    if (next == passages_.end()) next = passages_.begin();
    const std::uint64_t before = bytes_;
    const bool goes_on = serve(next->first, next->second, now_ns);
    if (bytes_ != before) last_served_ = next->first;
    if (!goes_on) return;
    satisfied = bytes_ == before ? satisfied + 1 : 0;
    ++next;
  }
  for (const auto& [client, passage] : passages_) next_ns_ = std::min(next_ns_, passage.next_ns());
}

bool SnapshotTransfer::serve(transport::ClientId client, Passage& passage, std::int64_t now_ns) {
  for (int i = 0; i < kTurn; ++i) {
    if (!outbox_->has_snapshot_room()) {
      next_ns_ = now_ns + kMillisecond;
      return false;
    }
    const auto part = passage.next(now_ns);
    if (!part) break;
    static_cast<void>(outbox_->push(SnapshotPart{client, passage.snapshot()->cut(*part)}));
    bytes_ += passage.snapshot()->size_of(*part);
  }
  return true;
}

bool SnapshotTransfer::serves(transport::ClientId client, std::int64_t now_ns) const {
  const auto passage = passages_.find(client);
  return passage != passages_.end() &&
         now_ns - passage->second.heard_ns() < accounts::kHostTransfers.stalled_ns;
}

bool SnapshotTransfer::stalled(const Passage& passage, std::int64_t now_ns) {
  return now_ns - passage.progress_ns() >= accounts::kHostTransfers.stalled_ns ||
         now_ns - passage.began_ns() >= accounts::kHostTransfers.longest_ns;
}

std::pair<std::size_t, std::size_t> SnapshotTransfer::held_count_and_bytes(bool all,
                                                                           std::int64_t now_ns) const {
  std::set<const Snapshot*> held;
  std::size_t bytes = 0;
  for (const auto& [client, passage] : passages_) {
    if ((all || !stalled(passage, now_ns)) && held.insert(passage.snapshot().get()).second)
      bytes += passage.snapshot()->bytes.size();
  }
  return {held.size(), bytes};
}

bool SnapshotTransfer::full(std::int64_t now_ns) const {
  const auto [count, bytes] = held_count_and_bytes(false, now_ns);
  return count >= 2 && bytes + largest_ > kMostHeldBytes;
}

}  // namespace tandem::host
