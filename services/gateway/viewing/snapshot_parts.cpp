#include "services/gateway/viewing/snapshot_parts.hpp"

#include <algorithm>
#include <utility>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/wire/parcels.hpp"

namespace tandem::gateway {
namespace {

// What a part takes on the network besides its bytes: fields and headers, and the viewer's acknowledgement.
constexpr double kOtherBytes = 400;

}  // namespace

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

bool SnapshotPassage::has_next(std::int64_t now_ns) const {
  if (!snapshot_) return false;
  if (inputs_sent_ < snapshot_->inputs.size()) return true;
  return !window_.is_full(snapshot_->part_bytes) && window_.within_limit(now_ns);
}

std::int64_t SnapshotPassage::next_ns() const {
  const bool waits = snapshot_ && !window_.is_full(snapshot_->part_bytes);
  return waits ? window_.next_ns() : INT64_MAX;
}

void SnapshotPassage::limit(std::uint32_t cap_kbit_s, double deltas_bytes_per_s) {
  if (!snapshot_) return;
  window_.limit(accounts::limit_under_cap(cap_kbit_s, deltas_bytes_per_s,
                                          static_cast<double>(snapshot_->part_bytes), kOtherBytes));
}

OutgoingPtr SnapshotPassage::next(std::int64_t now_ns) {
  TANDEM_ASSERT(has_next(now_ns));
  window_.look(now_ns);
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
