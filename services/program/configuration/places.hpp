#pragma once
// Where settings come from, so that an error can say what to change.

#include <map>
#include <string>
#include <string_view>

#include "tandem/result.hpp"

namespace tandem::configuration {

/// Where the settings in force stand that come from a file. Empty without a file.
struct Places {
  std::string file;
  std::map<std::string, std::string> of_field;       ///< "FILE:LINE" by field, and by "stream:NAME"
  std::map<std::string, std::string> field_of_flag;  ///< of those fields, by flag
};

/// Names file, line and field in an error that begins with the flag of a field that comes from a file, as in
/// "--client-limit: must be 1 to 65536". Other errors stay as they are.
[[nodiscard]] Error placed(const Places& places, Error error);

/// The same for an error that does not name its flag. With an empty `field`, the field is the error's first
/// word; if it is none, the error names the file alone.
[[nodiscard]] Error placed(const Places& places, std::string_view field, const Error& error);

/// The flag of a field that has no other name: its name with dashes.
[[nodiscard]] std::string usual_flag(std::string_view field);

}  // namespace tandem::configuration
