#pragma once
// The subcommands of `tandem`, one file each.

#include <functional>

#include "services/commandline/commandline.hpp"

namespace tandem::tool {

/// What the chosen subcommand does. Returns the process's exit code: 0 done, 1 failed. Usage errors (2) are
/// services/commandline's: a subcommand says what its values must be, and refuses what is left from its
/// callback.
using Run = std::function<int()>;

/// Each adds one subcommand to `app`; when the command line chooses it, its callback sets `run`.
void add_join(commandline::Command app, Run& run);
void add_record(commandline::Command app, Run& run);
void add_replay(commandline::Command app, Run& run);
/// Of evaluation; services/lab defines them, where it is a part of the build.
void add_bench(commandline::Command app, Run& run);
void add_export(commandline::Command app, Run& run);
void add_top(commandline::Command app, Run& run);
void add_doctor(commandline::Command app, Run& run);

}  // namespace tandem::tool
