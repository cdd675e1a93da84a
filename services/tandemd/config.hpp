#pragma once
// tandemd's configuration (idl/server.proto): a file says one part of it, flags another.

#include <string>

#include "server.pb.h"
#include "services/tandemd/options.hpp"
#include "tandem/result.hpp"

namespace tandem::daemon {

/// Reads a configuration file. Errors: kIo; kMalformed naming file, line and field.
[[nodiscard]] Result<idl::ServerConfig> load_config(const std::string& path);

/// What flags say wins over what the file says; and what a flag excludes goes with it.
[[nodiscard]] idl::ServerConfig merge(const idl::ServerConfig& flags, idl::ServerConfig file);

/// Reads what --stream says: NAME:ITEM,ITEM..., where an item is key=value (planning::kStreamOptions), or a
/// predictor alone. Errors:
/// kInvalidArgument.
[[nodiscard]] Result<idl::Stream> parse_stream(const std::string& text);

/// Checks what needs no scene. Errors: kInvalidArgument naming the flag and what it takes.
[[nodiscard]] Result<Options> check_config(const idl::ServerConfig& config);

}  // namespace tandem::daemon
