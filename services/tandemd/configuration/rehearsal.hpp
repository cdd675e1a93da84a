#pragma once

#include "services/tandemd/configuration/options.hpp"
#include "tandem/result.hpp"

namespace tandem::daemon {

/// Does what a start does before it opens anything: reads the scene, plans the session, makes the simulation.
/// Errors: those of a start that exits with 2, naming the field.
[[nodiscard]] Result<void> rehearse(const Options& options);

}  // namespace tandem::daemon
