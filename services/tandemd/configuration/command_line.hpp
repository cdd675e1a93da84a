#pragma once
// The flags of tandemd.

#include <functional>
#include <optional>
#include <string>

#include "services/tandemd/configuration/options.hpp"

namespace tandem::daemon {

/// The result of the command line: options to run with, or an exit code after --help, --version or a usage
/// error, the text of which is already printed.
struct CommandLine {
  std::optional<DaemonOptions> options;
  int exit_code = 0;
  std::string why = {};  ///< of a usage error: its first line
  /// Reads the configuration file again, and says what changed since; empty without --config.
  std::function<Result<Changes>()> reread = {};
};
[[nodiscard]] CommandLine parse_command_line(int argc, const char* const* argv);

/// What --engine-fd names, also in a command line that is refused; -1: nothing.
[[nodiscard]] int inherited_engine(int argc, const char* const* argv);

}  // namespace tandem::daemon
