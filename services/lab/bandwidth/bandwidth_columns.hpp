#pragma once
// How the rows of `tandem bench bandwidth` are written: one list of columns for JSON and people.

#include <span>
#include <string>

#include "services/lab/bandwidth/bandwidth.hpp"

namespace tandem::lab {

/// {"rows": [...]}, one line. `series`: each row also has the payload and the bodies in contact of every
/// frame.
[[nodiscard]] std::string to_json(std::span<const BandwidthRow> rows, bool series = false);
/// A table for people.
[[nodiscard]] std::string to_table(std::span<const BandwidthRow> rows);

}  // namespace tandem::lab
