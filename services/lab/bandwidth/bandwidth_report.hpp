#pragma once
// `tandem bench bandwidth --report`: writes the rows, and how rates change over time (figures 5.1 to 5.3).

#include <span>
#include <string>

#include "services/lab/bandwidth/bandwidth.hpp"
#include "tandem/result.hpp"

namespace tandem::lab {

/// Writes into `directory`, which is made if it is missing: rows.csv; for each scene and size
/// NAME-BODIES.csv (each frame's bodies in contact, and Mbit/s of every codec), .gnuplot and .svg; last
/// report.json. Files appear complete or not at all, and a report.json of an earlier run goes first, so that
/// with a report.json the report is whole. `rows` of one scene and size follow each other. Errors: kIo,
/// naming the file, or that gnuplot is missing.
[[nodiscard]] Result<void> write_report(const std::string& directory, std::span<const BandwidthRow> rows);

}  // namespace tandem::lab
