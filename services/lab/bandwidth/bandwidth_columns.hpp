#pragma once
// How the rows of `tandem bench bandwidth` are written: one list of columns for JSON, CSV and people.

#include <span>
#include <string>

#include "services/lab/bandwidth/bandwidth.hpp"

namespace tandem::lab {

/// {"rows": [...]}, one line.
[[nodiscard]] std::string to_json(std::span<const BandwidthRow> rows);
/// A line of names, then a line for each row, in which missing values are empty.
[[nodiscard]] std::string to_csv(std::span<const BandwidthRow> rows);
/// A table for people, with the thesis's numbers next to the measured ones.
[[nodiscard]] std::string to_table(std::span<const BandwidthRow> rows);

}  // namespace tandem::lab
