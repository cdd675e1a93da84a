#pragma once
// tandemd's configuration (idl/server.proto), which comes from a file and from flags.

#include <string>

#include "server.pb.h"
#include "services/tandemd/options.hpp"
#include "tandem/result.hpp"

namespace tandem::daemon {

/// Reads a configuration file. Errors: kIo; kMalformed naming file, line and field.
[[nodiscard]] Result<idl::ServerConfig> load_config(const std::string& path);

/// Merges flags and file. Flags win, and settings from the file that conflict with a flag are dropped.
[[nodiscard]] idl::ServerConfig merge(const idl::ServerConfig& flags, idl::ServerConfig file);

/// Reads the value of --stream: NAME:ITEM,ITEM..., in which an item is key=value (planning::kStreamOptions)
/// or only a predictor. Errors: kInvalidArgument.
[[nodiscard]] Result<idl::Stream> parse_stream(const std::string& text);

/// Checks all that needs no scene. Errors: kInvalidArgument, which names the flag and the values it takes.
[[nodiscard]] Result<Options> check_config(const idl::ServerConfig& config);

}  // namespace tandem::daemon
