#pragma once
// The command line of tandem-relay.

#include <optional>

#include "services/relay/options.hpp"

namespace tandem::relay {

struct CommandLine {
  std::optional<RelayOptions> options;  ///< empty: exit with `exit_code`
  int exit_code = 0;
};

/// Prints help, version and errors itself.
[[nodiscard]] CommandLine parse_command_line(int argc, const char* const* argv);

}  // namespace tandem::relay
