#pragma once
// What is known, for scripts.

#include <string>

#include "services/tool/top/model/overview.hpp"

namespace tandem::top {

/// {"sessions": [...], "clients": [...]} in one line, with the fields of the status topics, of all who are
/// alive. A session has the sums over its streams, and "streams" with the fields of each.
[[nodiscard]] std::string to_json(const Overview& overview, Moment now);

}  // namespace tandem::top
