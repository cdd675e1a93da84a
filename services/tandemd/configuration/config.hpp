#pragma once
// tandemd's configuration (idl/server.proto), which comes from a file and from flags.

#include <string>

#include "server.pb.h"
#include "services/program/configuration/places.hpp"
#include "services/tandemd/configuration/options.hpp"
#include "tandem/result.hpp"

namespace tandem::daemon {

/// Drops settings from the file that conflict with a flag.
void displace(const idl::ServerConfig& flags, idl::ServerConfig& file);
/// Merges flags and file. Flags win, and displace.
[[nodiscard]] idl::ServerConfig merge(const idl::ServerConfig& flags, idl::ServerConfig file);

struct ConfigFile {
  idl::ServerConfig config;
  configuration::Places places;
};
/// Reads a file. Errors: kIo; kMalformed, naming file, line and field, and what the field takes.
[[nodiscard]] Result<ConfigFile> load_config(const std::string& path);
/// Reads its text.
[[nodiscard]] Result<ConfigFile> parse_config(const std::string& text, const std::string& path);

/// Reads the value of --stream: NAME:ITEM,ITEM..., in which an item is key=value (planning::kStreamOptions)
/// or only a predictor. Errors: kInvalidArgument.
[[nodiscard]] Result<idl::Stream> parse_stream(const std::string& text);

/// Checks all that needs no scene. `places` says which settings come from a file. Errors: kInvalidArgument,
/// which names the flag, or file, line and field, and the allowed values.
[[nodiscard]] Result<DaemonOptions> check_config(const idl::ServerConfig& config,
                                                 const configuration::Places& places = {});

}  // namespace tandem::daemon
