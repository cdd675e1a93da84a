#pragma once
// Runs one session from start to end, with given options.

#include "services/program/process/signal_watch.hpp"
#include "services/tandemd/configuration/options.hpp"

namespace tandem::daemon {

/// Loads the scene, joins the domain, serves until a signal, the duration or a conflict, prints the report,
/// and leaves the domain. Returns the exit code: 0 done, 1 failed, 2 options that make no session.
[[nodiscard]] int run_daemon(DaemonOptions options, SignalWatch& signals);

}  // namespace tandem::daemon
