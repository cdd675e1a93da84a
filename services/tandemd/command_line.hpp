#pragma once
// The flags of tandemd.

#include <optional>

#include "services/tandemd/options.hpp"

namespace tandem::daemon {

/// The result of the command line: options to run with, or the exit code of --help, --version or a usage
/// error, whose text was printed.
struct CommandLine {
  std::optional<Options> options;
  int exit_code = 0;
};
[[nodiscard]] CommandLine parse_command_line(int argc, const char* const* argv);

}  // namespace tandem::daemon
