#pragma once
// tandemd --standby, until it takes over.

#include <atomic>

#include "sdk/wire/port.hpp"
#include "services/host/frames/configuration.hpp"
#include "services/host/keeping/keeping.hpp"
#include "services/tandemd/configuration/options.hpp"
#include "services/tandemd/metrics.hpp"
#include "services/tandemd/service.hpp"
#include "tandem/simulation.hpp"

namespace tandem::daemon {

/// Stands by for the session's live server until that one is gone or hands over. Then `simulation` holds the
/// world, and `config` says how the session continues. Returns false if it was stopped before. Errors: those
/// of the port and of the folder of checkpoints; kTransport, if it needs another network address; and kIo, if
/// there is a Simulation::failure().
[[nodiscard]] Result<bool> stand_by(DaemonOptions& options, engine::Simulation& simulation,
                                    transport::ServerPort& port, host::HostConfig& config,
                                    host::Keeping& keeping, Service& service, Metrics& metrics,
                                    const std::atomic<bool>& stop);

}  // namespace tandem::daemon
