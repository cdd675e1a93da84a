#pragma once
// Whether a host can be made of a configuration.

#include "services/host/frames/configuration.hpp"
#include "tandem/result.hpp"
#include "tandem/simulation.hpp"

namespace tandem::host {

/// Errors: kInvalidArgument, with what must be.
[[nodiscard]] Result<void> check(const ServiceConfig& config);
[[nodiscard]] Result<void> check(const HostConfig& config, const engine::Simulation& simulation);

}  // namespace tandem::host
