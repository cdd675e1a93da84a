#pragma once

#include "services/gateway/options.hpp"
#include "services/program/process/signal_watch.hpp"

namespace tandem::gateway {

/// Serves until a signal. Returns the exit code; says on stderr what went wrong.
[[nodiscard]] int run(const GatewayOptions& options, SignalWatch& signals);

}  // namespace tandem::gateway
