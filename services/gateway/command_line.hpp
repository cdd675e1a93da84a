#pragma once
// The command line of tandem-gateway.

#include <optional>

#include "services/gateway/options.hpp"

namespace tandem::gateway {

struct CommandLine {
  std::optional<GatewayOptions> options;  ///< empty: exit with `exit_code`
  int exit_code = 0;
};

/// Prints help, version and errors itself.
[[nodiscard]] CommandLine parse_command_line(int argc, const char* const* argv);

}  // namespace tandem::gateway
