#include "services/host/streams/position_error.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::host {

PositionError position_error(const State& target, const State& agreed, Frame frame) {
  const Slot capacity = std::min(target.capacity(), agreed.capacity());
  const Slot stride = std::max<Slot>((capacity + kMaxCompared - 1) / kMaxCompared, 1);
  double sum = 0, largest = 0;
  std::uint32_t compared = 0;
  for (Slot slot = static_cast<Slot>(frame % stride); slot < capacity; slot += stride) {
    if (target.alive()[slot] == 0 || agreed.alive()[slot] == 0) continue;
    double square = 0;
    for (std::size_t axis = 0; axis < kPositionChannels; ++axis) {
      const double apart = static_cast<double>(target.p(axis)[slot]) - agreed.p(axis)[slot];
      square += apart * apart;
    }
    sum += square;
    largest = std::max(largest, square);
    ++compared;
  }
  if (compared == 0) return {};
  return {.rms = std::sqrt(sum / compared), .largest = std::sqrt(largest)};
}

}  // namespace tandem::host
