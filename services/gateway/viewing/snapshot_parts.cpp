#include "services/gateway/viewing/snapshot_parts.hpp"

#include <algorithm>
#include <utility>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/wire/parcels.hpp"

namespace tandem::gateway {

SnapshotParts::SnapshotParts(const following::FollowedWorld::Cut& cut, Epoch epoch,
                             std::vector<OutgoingPtr> inputs_before)
    : frame(cut.frame),
      bytes(cut.bytes.size()),
      part_bytes(std::clamp((bytes + kMaxParts - 1) / kMaxParts, kLeastPartBytes, transport::kPartBytes)),
      inputs(std::move(inputs_before)) {
  TANDEM_ASSERT(bytes > 0 && bytes <= transport::kMaxSnapshotBytes);
  transport::SnapshotMessage part;
  part.epoch = epoch;
  part.stream = cut.stream;
  part.frame = cut.frame;
  for (std::size_t i = 0; i < transport::part_count(bytes, part_bytes); ++i) {
    transport::cut_part(cut.bytes, part_bytes, i, part);
    parts.push_back(make_outgoing(part));
  }
}

bool SnapshotPassage::has_next() const {
  if (!snapshot_) return false;
  if (inputs_sent_ < snapshot_->inputs.size()) return true;
  return !window_.is_full(snapshot_->part_bytes);
}

OutgoingPtr SnapshotPassage::next(std::int64_t now_ns) {
  TANDEM_ASSERT(has_next());
  if (inputs_sent_ < snapshot_->inputs.size()) return snapshot_->inputs[inputs_sent_++];
  OutgoingPtr part = snapshot_->parts[sent_.size()];
  sent_.push_back(window_.sent(snapshot_->part_bytes, now_ns));
  if (sent_.size() == snapshot_->parts.size()) snapshot_.reset();
  return part;
}

void SnapshotPassage::acknowledged(const transport::AckMessage& ack, std::int64_t now_ns) {
  if (!snapshot_ || ack.snapshot_frame != snapshot_->frame || ack.snapshot_parts != snapshot_->parts.size())
    return;
  const std::size_t held =
      std::min<std::size_t>(ack.missing.empty() ? sent_.size() : ack.missing.front(), sent_.size());
  if (held <= arrived_) return;
  window_.arrived((held - arrived_) * snapshot_->part_bytes, sent_[held - 1], now_ns);
  arrived_ = held;
  progress_ns_ = now_ns;
}

}  // namespace tandem::gateway
