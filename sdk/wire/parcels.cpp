#include "sdk/wire/parcels.hpp"

#include <array>

namespace tandem::transport {

std::vector<std::uint32_t> missing_runs(const std::vector<bool>& held) {
  std::array<std::uint32_t, 2 * kMaxMissingRuns> runs{};
  std::size_t end = 0;  // of the runs so far
  for (std::uint32_t part = 0; part < held.size(); ++part) {
    if (held[part]) continue;
    if (end == 0 || runs[end - 2] + runs[end - 1] != part) {
      if (end == runs.size()) break;
      runs[end] = part;
      end += 2;
    }
    ++runs[end - 1];
  }
  return {runs.begin(), runs.begin() + end};
}

}  // namespace tandem::transport
