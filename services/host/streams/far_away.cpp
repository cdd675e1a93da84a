#include "services/host/streams/far_away.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace tandem::host {

std::string origin_hint(const engine::Bodies& bodies, double extent) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::array<double, 3> low{kInfinity, kInfinity, kInfinity}, high{-kInfinity, -kInfinity, -kInfinity};
  for (std::size_t s = 0; s < bodies.alive.size(); ++s) {
    if (bodies.alive[s] == 0) continue;
    bool beyond = false;
    for (std::size_t i = 0; i < low.size(); ++i) {
      const double p = double{bodies.position[i][s]};
      beyond = beyond || std::abs(p) > extent;
      low[i] = std::min(low[i], p);
      high[i] = std::max(high[i], p);
    }
    if (!beyond) return {};  // also one that is not a number
  }
  std::array<double, 3> middle{};
  for (std::size_t i = 0; i < low.size(); ++i) {
    if (!(high[i] - low[i] <= 2 * extent)) return {};
    middle[i] = std::round((low[i] + high[i]) / 2);
  }
  return fmt::format(
      "; all are around ({:.0f}, {:.0f}, {:.0f}): subtract such an origin from all positions, before they become float32",
      middle[0], middle[1], middle[2]);
}

}  // namespace tandem::host
