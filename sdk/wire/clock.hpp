#pragma once
// The clocks of a running process. Only the code that drives the rules reads them; the rules get the time as
// an argument.

#include <chrono>
#include <cstdint>

namespace tandem::transport {

/// A clock that never goes back.
[[nodiscard]] inline std::int64_t steady_ns() {
  const auto since = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(since).count();
}

/// The time of day, since 1970.
[[nodiscard]] inline std::int64_t wall_ns() {
  const auto since = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(since).count();
}

/// The same in seconds.
[[nodiscard]] inline std::int64_t wall_s() { return wall_ns() / 1'000'000'000; }

}  // namespace tandem::transport
