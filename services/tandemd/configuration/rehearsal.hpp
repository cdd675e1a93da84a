#pragma once

#include "services/tandemd/configuration/options.hpp"
#include "tandem/result.hpp"

namespace tandem::daemon {

/// Checks the identity for DDS Security, if one is given: of what can be checked without its purpose. Errors:
/// kIo, kInvalidArgument, naming the field.
[[nodiscard]] Result<void> check_identity(const Options& options);

/// Checks that the scene is there and can be read. Errors: kIo, kMalformed, naming the field.
[[nodiscard]] Result<void> check_scene(const Options& options);

/// Does what a start does before it opens anything: checks the identity, reads the scene, plans the session,
/// makes the simulation. Errors: those of a start that exits with 2, naming the field.
[[nodiscard]] Result<void> rehearse(const Options& options);

}  // namespace tandem::daemon
