#pragma once
// One session from start to end: what tandemd does once it knows its options.

#include <atomic>

#include "services/tandemd/options.hpp"

namespace tandem::daemon {

/// Loads the scene, joins the domain, serves until `stop`, the duration or a conflict, and prints the report.
/// Returns the exit code: 0 done, 1 failed, 2 options that make no session.
[[nodiscard]] int run_daemon(const Options& options, const std::atomic<bool>& stop);

}  // namespace tandem::daemon
