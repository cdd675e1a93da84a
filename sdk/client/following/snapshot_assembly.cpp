#include "sdk/client/following/snapshot_assembly.hpp"

#include <utility>

namespace tandem::client {

SnapshotAssembly::Outcome SnapshotAssembly::add(transport::SnapshotMessage&& part) {
  if (!within_limits(part, limits_)) {
    clear();
    return Outcome::kRefused;
  }
  if (part.frame == rejected_) return Outcome::kIgnored;
  const Outcome outcome = parcels_.add(std::move(part));
  const bool too_short = parcels_.complete() && parcels_.held_bytes() != parcels_.head().total_bytes;
  if (outcome != Outcome::kRefused && !too_short) return outcome;
  clear();
  return Outcome::kRefused;
}

void SnapshotAssembly::clear() { parcels_.clear(); }

void SnapshotAssembly::reject() {
  if (!parcels_.empty()) rejected_ = parcels_.frame();
  clear();
}

}  // namespace tandem::client
