#pragma once
// The clocks that a running client lives by.

#include <chrono>
#include <cstdint>

#include "sdk/client/client_core.hpp"

namespace tandem::client {

[[nodiscard]] inline std::int64_t steady_ns() {
  const auto since = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(since).count();
}

[[nodiscard]] inline Now now() {
  const auto wall = std::chrono::system_clock::now().time_since_epoch();
  return {steady_ns(), std::chrono::duration_cast<std::chrono::nanoseconds>(wall).count()};
}

}  // namespace tandem::client
