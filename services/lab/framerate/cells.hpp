#pragma once
// How a value that may be missing looks in a table.

#include <fmt/format.h>

#include <optional>
#include <string>

namespace tandem::lab {

/// "-" where there is none.
inline std::string rounded(const std::optional<double>& value, int digits) {
  return value ? fmt::format("{:.{}f}", *value, digits) : "-";
}

}  // namespace tandem::lab
