// Only this file converts the engine's floats to integers. It is separate so that it can be compiled for
// vector units. It does nothing but conversions, so results do not depend on that.
#include "services/host/streams/mirror.hpp"

namespace tandem::host {

void quantise_column(std::span<const float> in, double scale, std::int32_t limit, float off_bound,
                     std::span<std::int32_t> out, std::span<std::int32_t> off) {
  const std::size_t count = in.size();
  const float* __restrict x = in.data();
  std::int32_t* __restrict to = out.data();
  std::int32_t* __restrict bad = off.data();
  const auto bound = static_cast<float>(limit / scale);
  for (std::size_t i = 0; i < count; ++i) {
    const float magnitude = x[i] < 0 ? -x[i] : x[i];
    bad[i] |= magnitude <= off_bound ? 0 : 1;  // NaN fails the comparison
  }
  for (std::size_t i = 0; i < count; ++i) {
    // NaN becomes -bound here: converting it to an integer would be undefined.
    const float low = x[i] >= -bound ? x[i] : -bound;
    const float value = low <= bound ? low : bound;
    const double scaled = double{value} * scale;
    to[i] = static_cast<std::int32_t>(scaled + (scaled < 0 ? -0.5 : 0.5));
  }
  for (std::size_t i = 0; i < count; ++i) {
    const std::int32_t high = to[i] > limit ? limit : to[i];  // the last bit of a float may lie beyond
    to[i] = high < -limit ? -limit : high;
  }
}

}  // namespace tandem::host
