#include "sdk/client/following/snapshot_assembly.hpp"

#include <algorithm>
#include <utility>

#include "sdk/wire/limits.hpp"

namespace tandem::client {

SnapshotAssembly::Outcome SnapshotAssembly::add(transport::SnapshotMessage&& part) {
  const bool malformed = part.parts == 0 || part.parts > transport::kMaxSnapshotParts ||
                         part.parts > part.total_bytes || part.part >= part.parts || part.bytes.empty() ||
                         part.bytes.size() > part.total_bytes || part.total_bytes > most_bytes_;
  if (malformed) {
    clear();
    return Outcome::kRefused;
  }
  if (part.frame == rejected_) return Outcome::kIgnored;
  if (!held_.empty() && part.frame < head_.frame) return Outcome::kIgnored;
  if (held_.empty() || part.frame > head_.frame) {
    clear();
    bytes_.resize(part.parts);
    held_.resize(part.parts);
    head_ = {.epoch = part.epoch,
             .stream = part.stream,
             .frame = part.frame,
             .total_bytes = part.total_bytes,
             .bytes = {}};
  }
  if (part.parts != held_.size() || part.total_bytes != head_.total_bytes || held_[part.part]) {
    return Outcome::kIgnored;
  }
  held_bytes_ += part.bytes.size();
  held_[part.part] = true;
  bytes_[part.part] = std::move(part.bytes);
  ++held_parts_;
  const bool complete = held_parts_ == held_.size();
  if (held_bytes_ > head_.total_bytes || (complete && held_bytes_ != head_.total_bytes)) {
    clear();
    return Outcome::kRefused;
  }
  return Outcome::kStored;
}

std::optional<transport::SnapshotMessage> SnapshotAssembly::take() {
  if (held_.empty() || held_parts_ < held_.size() || taken_) return std::nullopt;
  transport::SnapshotMessage whole = head_;
  whole.bytes.reserve(head_.total_bytes);
  for (transport::Bytes& part : bytes_) {
    whole.bytes.insert(whole.bytes.end(), part.begin(), part.end());
    part = {};
  }
  taken_ = true;
  return whole;
}

void SnapshotAssembly::clear() {
  head_ = {};
  bytes_.clear();
  held_.clear();
  held_bytes_ = held_parts_ = 0;
  taken_ = false;
}

void SnapshotAssembly::reject() {
  if (!held_.empty()) rejected_ = head_.frame;
  clear();
}

std::vector<std::uint32_t> SnapshotAssembly::missing() const {
  std::vector<std::uint32_t> runs;
  auto at = held_.begin();
  while (runs.size() < 2 * transport::kMaxMissingRuns) {
    const auto first = std::find(at, held_.end(), false);
    if (first == held_.end()) break;
    at = std::find(first, held_.end(), true);
    runs.push_back(static_cast<std::uint32_t>(first - held_.begin()));
    runs.push_back(static_cast<std::uint32_t>(at - first));
  }
  return runs;
}

}  // namespace tandem::client
