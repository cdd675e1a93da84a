#include "sdk/wire/parcels.hpp"

namespace tandem::transport {

std::vector<std::uint32_t> missing_runs(const std::vector<bool>& held) {
  std::vector<std::uint32_t> runs;
  auto at = held.begin();
  while (runs.size() < 2 * kMaxMissingRuns) {
    const auto first = std::find(at, held.end(), false);
    if (first == held.end()) break;
    at = std::find(first, held.end(), true);
    runs.push_back(static_cast<std::uint32_t>(first - held.begin()));
    runs.push_back(static_cast<std::uint32_t>(at - first));
  }
  return runs;
}

}  // namespace tandem::transport
