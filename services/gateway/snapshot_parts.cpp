#include "services/gateway/snapshot_parts.hpp"

#include <algorithm>
#include <utility>

#include "sdk/transport/limits.hpp"

namespace tandem::gateway {

SnapshotParts::SnapshotParts(const World::Cut& cut, Epoch epoch, std::vector<OutgoingPtr> inputs_before)
    : frame(cut.frame),
      bytes(cut.bytes.size()),
      part_bytes(std::clamp((bytes + kMostParts - 1) / kMostParts, kLeastPartBytes, transport::kPartBytes)),
      inputs(std::move(inputs_before)) {
  transport::SnapshotMessage part;
  part.epoch = epoch;
  part.stream = cut.stream;
  part.frame = cut.frame;
  part.parts = static_cast<std::uint32_t>((bytes + part_bytes - 1) / part_bytes);
  part.total_bytes = static_cast<std::uint32_t>(bytes);
  for (; part.part < part.parts; ++part.part) {
    const std::size_t at = part.part * part_bytes;
    const auto piece = std::span(cut.bytes).subspan(at, std::min(part_bytes, bytes - at));
    part.bytes.assign(piece.begin(), piece.end());
    parts.push_back(make_outgoing(part));
  }
}

bool SnapshotPassage::has_next() const {
  if (!snapshot_) return false;
  if (inputs_sent_ < snapshot_->inputs.size()) return true;
  const std::size_t flying = (sent_ns_.size() - arrived_) * snapshot_->part_bytes;
  return flying == 0 || flying + snapshot_->part_bytes <= window_.bytes();
}

OutgoingPtr SnapshotPassage::next(std::int64_t now_ns) {
  if (inputs_sent_ < snapshot_->inputs.size()) return snapshot_->inputs[inputs_sent_++];
  OutgoingPtr part = snapshot_->parts[sent_ns_.size()];
  sent_ns_.push_back(now_ns);
  if (sent_ns_.size() == snapshot_->parts.size()) snapshot_.reset();
  return part;
}

void SnapshotPassage::acknowledged(const transport::AckMessage& ack, std::int64_t now_ns) {
  if (!snapshot_ || ack.snapshot_frame != snapshot_->frame || ack.snapshot_parts != snapshot_->parts.size())
    return;
  const std::size_t held = ack.missing.empty() ? sent_ns_.size() : ack.missing.front();
  for (; arrived_ < std::min(held, sent_ns_.size()); ++arrived_)
    window_.arrived(now_ns - sent_ns_[arrived_], now_ns);
}

}  // namespace tandem::gateway
