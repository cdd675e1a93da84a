#include "services/host/snapshot_transfer.hpp"

#include <algorithm>
#include <utility>

#include "sdk/transport/limits.hpp"
#include "sdk/transport/units.hpp"

namespace tandem::host {
namespace {

// A part that has not arrived while one sent more than this after it has is lost.
constexpr std::int64_t kReorderNs = 20 * kMillisecond;

}  // namespace

void SnapshotTransfer::start(Epoch epoch, StreamId stream, Frame frame, std::span<const std::byte> bytes,
                             std::span<const transport::ClientId> receivers, std::int64_t now_ns) {
  snapshot_.assign(bytes.begin(), bytes.end());
  part_bytes_ =
      std::clamp((bytes.size() + kMostParts - 1) / kMostParts, kLeastPartBytes, transport::kPartBytes);
  head_ = {};
  head_.epoch = epoch;
  head_.stream = stream;
  head_.frame = frame;
  head_.parts = static_cast<std::uint32_t>((bytes.size() + part_bytes_ - 1) / part_bytes_);
  head_.total_bytes = static_cast<std::uint32_t>(bytes.size());
  parts_.assign(head_.parts, {});
  receivers_.clear();
  for (const transport::ClientId client : receivers) admit(client, now_ns);
  window_ = {};
  started_ns_ = now_ns;
  overtaken_ns_ = INT64_MIN;
}

void SnapshotTransfer::end() {
  parts_.clear();
  receivers_.clear();
}

void SnapshotTransfer::admit(transport::ClientId client, std::int64_t now_ns) {
  receivers_[client] = {.holds = std::vector<bool>(parts_.size()), .heard_ns = now_ns, .progress_ns = now_ns};
  for (Part& part : parts_) ++part.lacking;
}

void SnapshotTransfer::dismiss(transport::ClientId client) {
  const auto receiver = receivers_.find(client);
  if (receiver == receivers_.end()) return;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    if (!receiver->second.holds[i]) --parts_[i].lacking;
  }
  receivers_.erase(receiver);
}

void SnapshotTransfer::acknowledged(const transport::AckMessage& ack, std::int64_t now_ns) {
  const bool of_this = !parts_.empty() && ack.phase == transport::Phase::kJoining &&
                       ack.stream == head_.stream && ack.snapshot_frame == head_.frame &&
                       ack.snapshot_parts == parts_.size();
  auto receiver = receivers_.find(ack.client);
  if (!of_this) {
    // Held parts of it and holds them no more: it cannot use this snapshot.
    const bool gave_up = receiver != receivers_.end() && std::ranges::count(receiver->second.holds, true) > 0;
    if (gave_up) dismiss(ack.client);
    return;
  }
  if (receiver == receivers_.end()) {
    admit(ack.client, now_ns);
    receiver = receivers_.find(ack.client);
  }
  receiver->second.heard_ns = now_ns;
  // Where all runs there is room for are used, nothing is said of what lies behind them.
  const bool cut_short = ack.missing.size() >= 2 * transport::kMaxMissingRuns;
  std::size_t told = cut_short ? 0 : parts_.size();
  std::vector<bool> lacks(parts_.size());
  for (std::size_t i = 0; i + 1 < ack.missing.size(); i += 2) {
    const std::size_t first = std::min<std::size_t>(ack.missing[i], parts_.size());
    const std::size_t end = first + std::min<std::size_t>(ack.missing[i + 1], parts_.size() - first);
    std::fill(lacks.begin() + static_cast<std::ptrdiff_t>(first),
              lacks.begin() + static_cast<std::ptrdiff_t>(end), true);
    told = std::max(told, end);
  }
  for (std::size_t part = 0; part < told; ++part) {
    if (lacks[part] || receiver->second.holds[part]) continue;
    receiver->second.holds[part] = true;
    receiver->second.progress_ns = now_ns;
    received(part, now_ns);
  }
}

void SnapshotTransfer::received(std::size_t part, std::int64_t now_ns) {
  Part& p = parts_[part];
  if (--p.lacking != 0 || !p.sent_ns || p.again) return;
  window_.arrived(now_ns - *p.sent_ns, now_ns);
  overtaken_ns_ = std::max(overtaken_ns_, *p.sent_ns - kReorderNs);
}

void SnapshotTransfer::send(const std::map<transport::ClientId, Account>& accounts, std::int64_t now_ns) {
  for (auto it = receivers_.begin(); it != receivers_.end();) {
    const transport::ClientId client = (it++)->first;
    const auto account = accounts.find(client);
    if (account == accounts.end() || joined_stream(account->second) != head_.stream.id) dismiss(client);
  }
  if (receivers_.empty()) return;
  std::size_t flying = 0;
  std::size_t bytes = in_flight(now_ns, flying);
  for (std::size_t i = 0; i < parts_.size() && flying < kMostInFlight; ++i) {
    if (parts_[i].lacking == 0 || on_its_way(parts_[i], now_ns)) continue;
    if (bytes > 0 && bytes + size_of(i) > window_.bytes()) return;
    if (parts_[i].sent_ns) window_.lost(now_ns);
    if (!queue(i, now_ns)) return;
    bytes += size_of(i);
    ++flying;
  }
}

bool SnapshotTransfer::on_its_way(const Part& part, std::int64_t now_ns) const {
  return part.sent_ns && *part.sent_ns >= overtaken_ns_ && now_ns - *part.sent_ns < window_.patience_ns();
}

std::size_t SnapshotTransfer::in_flight(std::int64_t now_ns, std::size_t& parts) const {
  std::size_t bytes = 0;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    if (parts_[i].lacking == 0 || !on_its_way(parts_[i], now_ns)) continue;
    bytes += size_of(i);
    ++parts;
  }
  return bytes;
}

bool SnapshotTransfer::queue(std::size_t part, std::int64_t now_ns) {
  const auto cut = std::span(snapshot_).subspan(part * part_bytes_, size_of(part));
  transport::SnapshotMessage message = head_;
  message.part = static_cast<std::uint32_t>(part);
  message.bytes.assign(cut.begin(), cut.end());
  if (!outbox_->push(std::move(message))) return false;
  bytes_ += cut.size();
  parts_[part].again = parts_[part].sent_ns.has_value();
  parts_[part].sent_ns = now_ns;
  return true;
}

std::size_t SnapshotTransfer::size_of(std::size_t part) const {
  return std::min(part_bytes_, snapshot_.size() - part * part_bytes_);
}

bool SnapshotTransfer::serves(transport::ClientId client, std::int64_t now_ns) const {
  const auto receiver = receivers_.find(client);
  return receiver != receivers_.end() && now_ns - receiver->second.heard_ns < kStalledNs;
}

bool SnapshotTransfer::busy(std::int64_t now_ns) const {
  if (now_ns - started_ns_ >= kLongestNs) return false;
  return std::ranges::any_of(
      receivers_, [&](const auto& entry) { return now_ns - entry.second.progress_ns < kStalledNs; });
}

}  // namespace tandem::host
