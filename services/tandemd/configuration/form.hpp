#pragma once

#include "services/program/configuration/form.hpp"

namespace tandem::daemon {

/// tandemd's options: the fields of idl/server.proto.
[[nodiscard]] const configuration::Form& form();

}  // namespace tandem::daemon
