#pragma once

#include <atomic>

#include "services/gateway/options.hpp"

namespace tandem::gateway {

/// Serves until `stop`. Returns the exit code; says on stderr what went wrong.
[[nodiscard]] int run(const Options& options, const std::atomic<bool>& stop);

}  // namespace tandem::gateway
