#pragma once
// The subcommands of `tandem` for evaluation.

#include "services/tool/commands.hpp"

namespace tandem::lab {

using tool::Run;

/// As those in services/tool/commands.hpp.
void add_bench(commandline::Command app, Run& run);
void add_export(commandline::Command app, Run& run);

}  // namespace tandem::lab
