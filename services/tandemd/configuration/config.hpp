#pragma once
// tandemd's configuration (idl/server.proto), which comes from a file (config_file.hpp) and from flags.

#include <string>

#include "server.pb.h"
#include "services/tandemd/configuration/options.hpp"
#include "services/tandemd/configuration/places.hpp"
#include "tandem/result.hpp"

namespace tandem::daemon {

/// Merges flags and file. Flags win, and settings from the file that conflict with a flag are dropped.
[[nodiscard]] idl::ServerConfig merge(const idl::ServerConfig& flags, idl::ServerConfig file);

/// Reads the value of --stream: NAME:ITEM,ITEM..., in which an item is key=value (planning::kStreamOptions)
/// or only a predictor. Errors: kInvalidArgument.
[[nodiscard]] Result<idl::Stream> parse_stream(const std::string& text);

/// Checks all that needs no scene. `places` says which settings come from a file. Errors: kInvalidArgument,
/// which names the flag, or file, line and field, and the allowed values.
[[nodiscard]] Result<Options> check_config(const idl::ServerConfig& config, const Places& places = {});

}  // namespace tandem::daemon
