#pragma once
// What --help, --print-config, manuals and errors say of each field of the configuration (idl/server.proto).

#include <string>
#include <string_view>
#include <vector>

namespace tandem::daemon {

/// A field. Every field of ServerConfig has a line in settings().
struct Setting {
  std::string field;
  std::string help;       ///< one sentence without its full stop, or several
  std::string takes;      ///< the allowed values
  std::string otherwise;  ///< what holds without it; may be empty
  std::string example;    ///< a value as a file has it; the one that holds without it where that has a value
};

/// In the order of --help.
[[nodiscard]] const std::vector<Setting>& settings();
/// Null for an unknown field.
[[nodiscard]] const Setting* find_setting(std::string_view field);
/// "Maximum number of clients: 1 to 65536 [256]".
[[nodiscard]] std::string text_of(const Setting& setting);
/// The flag that sets the field, with its dashes.
[[nodiscard]] std::string flag_of(std::string_view field);

}  // namespace tandem::daemon
