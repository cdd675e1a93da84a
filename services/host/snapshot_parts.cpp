#include "services/host/snapshot_parts.hpp"

#include <algorithm>
#include <utility>

namespace tandem::host {

void SnapshotParts::start(Epoch epoch, StreamId stream, Frame frame, std::span<const std::byte> bytes) {
  snapshot_.assign(bytes.begin(), bytes.end());
  head_ = {};
  head_.epoch = epoch;
  head_.stream = stream;
  head_.frame = frame;
  head_.parts = static_cast<std::uint32_t>((bytes.size() + kPartBytes - 1) / kPartBytes);
  head_.total_bytes = static_cast<std::uint32_t>(bytes.size());
  parts_.assign(head_.parts, {.due = true, .sent_ns = {}});
}

void SnapshotParts::missing(const transport::AckMessage& ack) {
  const bool of_this = ack.phase == transport::Phase::kJoining && ack.stream == head_.stream &&
                       ack.snapshot_frame == head_.frame && ack.snapshot_parts == parts_.size();
  if (!of_this) return;
  for (std::size_t i = 0; i + 1 < ack.missing.size(); i += 2) {
    const std::size_t first = std::min<std::size_t>(ack.missing[i], parts_.size());
    const std::size_t count = std::min<std::size_t>(ack.missing[i + 1], parts_.size() - first);
    for (std::size_t part = first; part < first + count; ++part) parts_[part].due = true;
  }
}

void SnapshotParts::send(std::int64_t now_ns) {
  const auto out = static_cast<std::size_t>(
      std::ranges::count_if(parts_, [now_ns](const Part& part) { return part.sent_lately(now_ns); }));
  std::size_t room = out < kMostAtOnce ? kMostAtOnce - out : 0;
  for (std::size_t i = 0; i < parts_.size() && room > 0; ++i) {
    Part& part = parts_[i];
    if (!part.due) continue;
    if (part.sent_lately(now_ns)) {
      part.due = false;  // it may be on its way: whoever lacks it then says so again
      continue;
    }
    const auto cut = std::span(snapshot_).subspan(i * kPartBytes);
    transport::SnapshotMessage message = head_;
    message.part = static_cast<std::uint32_t>(i);
    message.bytes.assign(cut.begin(),
                         cut.begin() + static_cast<std::ptrdiff_t>(std::min(cut.size(), kPartBytes)));
    const std::size_t size = message.bytes.size();
    if (!outbox_->push(std::move(message))) return;
    bytes_ += size;
    part = {.due = false, .sent_ns = now_ns};
    --room;
  }
}

void SnapshotParts::forget() {
  snapshot_.clear();
  parts_.clear();
}

}  // namespace tandem::host
