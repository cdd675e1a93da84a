#pragma once
// tandem-relay --to http DIR: follows a session and writes it into a folder for an audience.

#include "services/program/process/signal_watch.hpp"
#include "services/relay/options.hpp"

namespace tandem::relay {

/// Until it is told to stop. Returns the exit code: 1 if it could not begin, or the folder could not be
/// written.
int run_audience(const RelayOptions& options, SignalWatch& signals);

}  // namespace tandem::relay
