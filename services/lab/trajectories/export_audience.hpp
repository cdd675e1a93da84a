#pragma once
// Exports a recording of a session as files for an audience (services/follow/audience).

#include <atomic>
#include <string>

#include "tandem/result.hpp"

namespace tandem::lab {

/// Writes all runs of an MCAP recording into `folder`, as `tandem record --to http` would have. Says on
/// stderr where the recording is cut short. Errors: kIo (also: `stop` was set; the folder then has no
/// manifest of it), kConflict (another process writes there), kMalformed, kUnsupported, kMismatch.
[[nodiscard]] Result<void> export_audience(const std::string& recording, const std::string& folder,
                                           const std::atomic<bool>& stop);

}  // namespace tandem::lab
