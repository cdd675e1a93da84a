#pragma once
// The log of commands that run for long.

#include <string>

#include "services/program/logging/log.hpp"

namespace tandem::tool {

/// From now on spdlog's functions write the log of `program`, and what Cyclone DDS has to say is a part of
/// it. Call it before other threads are started, once.
void begin_log(const std::string& program, const logging::LogOptions& options, const std::string& session);

}  // namespace tandem::tool
