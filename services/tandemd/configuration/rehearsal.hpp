#pragma once

#include "services/tandemd/configuration/options.hpp"
#include "tandem/result.hpp"

namespace tandem::daemon {

/// Checks the identity for DDS Security, if one is given. Errors:
/// kIo, kInvalidArgument, naming the field.
[[nodiscard]] Result<void> check_identity(const DaemonOptions& options);

/// Checks that the scene is there and can be read. Errors: kIo, kMalformed, naming the field.
[[nodiscard]] Result<void> check_scene(const DaemonOptions& options);

/// Does what a start does, but opens, makes and locks nothing: checks the identity, what is named of this
/// machine (interfaces of the profile, folders, the address of metrics), reads the scene, plans the session,
/// makes the simulation. A port, a folder or a session that another server has is not looked at: this
/// configuration may be that one's. Errors: those of a start, naming the field.
[[nodiscard]] Result<void> rehearse(const DaemonOptions& options);

}  // namespace tandem::daemon
