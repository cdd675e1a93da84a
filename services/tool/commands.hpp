#pragma once
// The subcommands of `tandem` for operators, one file each.

#include <CLI/CLI.hpp>
#include <functional>

namespace tandem::tool {

/// What the chosen subcommand does. Returns the process's exit code: 0 done, 1 failed. Usage errors (2) are
/// CLI11's: a subcommand checks its flags with validators and throws CLI::ValidationError from its callback.
using Run = std::function<int()>;

/// Each adds one subcommand to `app`; when the command line chooses it, its callback sets `run`.
void add_join(CLI::App& app, Run& run);
void add_record(CLI::App& app, Run& run);
void add_replay(CLI::App& app, Run& run);
void add_top(CLI::App& app, Run& run);
void add_doctor(CLI::App& app, Run& run);

}  // namespace tandem::tool
