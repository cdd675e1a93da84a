#pragma once
// Prints values of a table that may be missing.

#include <fmt/format.h>

#include <optional>
#include <string>

namespace tandem::lab {

/// "-" for a missing value.
inline std::string rounded(const std::optional<double>& value, int digits) {
  return value ? fmt::format("{:.{}f}", *value, digits) : "-";
}

}  // namespace tandem::lab
