#pragma once
// The subcommands of `tandem`, one file each.

#include <functional>

#include "services/program/commandline/commandline.hpp"

namespace tandem::tool {

/// Runs the chosen subcommand. Returns the process's exit code: 0 done, 1 failed.
/// services/program/commandline handles usage errors (2): a subcommand declares what its values must be, and
/// refuses the remaining errors in its callback.
using Run = std::function<int()>;

/// Each adds one subcommand to `app`; when the command line chooses it, its callback sets `run`.
void add_join(commandline::Command app, Run& run);
void add_record(commandline::Command app, Run& run);
void add_replay(commandline::Command app, Run& run);
void add_checkpoint(commandline::Command app, Run& run);
void add_handover(commandline::Command app, Run& run);
void add_engine_check(commandline::Command app, Run& run);
/// Subcommands for evaluation; services/lab defines them if it is part of the build.
void add_bench(commandline::Command app, Run& run);
void add_export(commandline::Command app, Run& run);
void add_top(commandline::Command app, Run& run);
void add_doctor(commandline::Command app, Run& run);
/// Has subcommands of its own: pki/pki.hpp.
void add_pki(commandline::Command app, Run& run);

}  // namespace tandem::tool
