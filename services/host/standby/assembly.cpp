#include "services/host/standby/assembly.hpp"

#include <utility>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/wire/limits.hpp"

namespace tandem::standby {

void Assembly::clear() { *this = {}; }

std::optional<Assembly::Whole> Assembly::add(transport::CheckpointMessage&& part) {
  if (part.frame < frame_) return std::nullopt;
  if (part.frame > frame_) {
    clear();
    frame_ = part.frame;
    journal_ = part.journal;
    total_bytes_ = part.total_bytes;
    parts_.resize(part.parts);
  }
  if (part.parts != parts_.size() || part.total_bytes != total_bytes_ || part.journal != journal_)
    return std::nullopt;
  TANDEM_ASSERT(part.part < part.parts);  // within_limits()
  transport::Bytes& place = parts_[part.part];
  if (!place.empty() || held_bytes_ + part.bytes.size() > total_bytes_) return std::nullopt;
  held_bytes_ += part.bytes.size();
  place = std::move(part.bytes);
  if (++held_ < parts_.size()) return std::nullopt;
  Whole whole{frame_, journal_, {}};
  whole.bytes.reserve(held_bytes_);
  for (const transport::Bytes& bytes : parts_)
    whole.bytes.insert(whole.bytes.end(), bytes.begin(), bytes.end());
  clear();
  return whole;
}

std::vector<std::uint32_t> Assembly::missing() const {
  std::vector<std::uint32_t> runs;
  for (std::uint32_t part = 0; part < parts_.size(); ++part) {
    if (!parts_[part].empty()) continue;
    if (!runs.empty() && runs[runs.size() - 2] + runs.back() == part) {
      ++runs.back();
      continue;
    }
    if (runs.size() == 2 * transport::kMaxMissingRuns) break;
    runs.insert(runs.end(), {part, 1});
  }
  return runs;
}

}  // namespace tandem::standby
