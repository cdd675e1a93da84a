#pragma once
// tandemd's configuration as a file: read with the places of its fields, and written with comments.

#include <string>

#include "server.pb.h"
#include "services/tandemd/configuration/places.hpp"
#include "tandem/result.hpp"

namespace tandem::daemon {

struct ConfigFile {
  idl::ServerConfig config;
  Places places;
};

/// Reads a configuration file: read_config_text() and parse_config().
[[nodiscard]] Result<ConfigFile> load_config(const std::string& path);
/// Errors: kIo.
[[nodiscard]] Result<std::string> read_config_text(const std::string& path);
/// `path` names the file in errors and places. Errors: kMalformed naming file, line and field, and what the
/// field takes.
[[nodiscard]] Result<ConfigFile> parse_config(const std::string& text, const std::string& path);

/// Leaves out what a flag sets.
[[nodiscard]] Places places_beside(const idl::ServerConfig& flags, Places places);

/// The configuration as a file with all fields, each with what it means and takes. What is not set is a
/// comment.
[[nodiscard]] std::string print_config(const idl::ServerConfig& config);

}  // namespace tandem::daemon
