#pragma once
// A relay with its threads: one that works, one that publishes, and one for each port that waits for what
// comes.

#include "services/program/process/signal_watch.hpp"
#include "services/relay/options.hpp"

namespace tandem::relay {

/// Passes the session on until it is stopped. Returns the exit code.
int run(const RelayOptions& options, SignalWatch& signals);

/// tandem-relay --to http DIR: writes the session into a folder for an audience, in one thread. Exit code 1:
/// it could not begin, or the folder could not be written.
int run_audience(const RelayOptions& options, SignalWatch& signals);

}  // namespace tandem::relay
