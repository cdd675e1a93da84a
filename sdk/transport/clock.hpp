#pragma once
// The clocks of a running process. Only what drives the rules reads them; the rules themselves are told the
// time.

#include <chrono>
#include <cstdint>

namespace tandem::transport {

/// Never goes back.
[[nodiscard]] inline std::int64_t steady_ns() {
  const auto since = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(since).count();
}

/// Time of day, since 1970.
[[nodiscard]] inline std::int64_t wall_ns() {
  const auto since = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(since).count();
}

}  // namespace tandem::transport
