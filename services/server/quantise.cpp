// The engine's floats become integers here and nowhere else. Kept in a file of its own so that it is compiled
// for vector units; nothing but conversions, so results do not depend on it.
#include "services/server/mirror.hpp"

namespace tandem::server {

void quantise_column(std::span<const float> in, double scale, double limit, double off_limit,
                     std::span<std::int32_t> out, std::span<std::int32_t> off) {
  const std::size_t count = in.size();
  const float* x = in.data();
  std::int32_t* to = out.data();
  std::int32_t* bad = off.data();
  for (std::size_t i = 0; i < count; ++i) {
    const double value = double{x[i]} * scale;
    const double magnitude = value < 0 ? -value : value;
    // Written so that NaN fails the comparison, and falls to -limit in the clamp instead of reaching the
    // conversion.
    bad[i] |= magnitude <= off_limit ? 0 : 1;
    const double low = value > -limit ? value : -limit;
    const double clamped = low < limit ? low : limit;
    to[i] = static_cast<std::int32_t>(clamped + (clamped < 0 ? -0.5 : 0.5));
  }
}

}  // namespace tandem::server
