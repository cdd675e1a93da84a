#pragma once
// The log of commands that run for long: its options, as tandemd and tandem-gateway have them, and its start.

#include <string>

#include "services/program/commandline/commandline.hpp"
#include "services/program/logging/log.hpp"

namespace tandem::tool {

/// Adds --log-format and --log-level. `options` outlives `command`.
void add_log_options(commandline::Command command, logging::Options& options);

/// From now on spdlog's functions write the log of `program`, and what Cyclone DDS has to say is a part of
/// it. Call it before other threads are started, once.
void begin_log(const std::string& program, const logging::Options& options, const std::string& session);

}  // namespace tandem::tool
