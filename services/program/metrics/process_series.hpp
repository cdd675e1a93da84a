#pragma once
// What Prometheus' own libraries tell of every process, by the same names.

#include "services/program/metrics/page.hpp"

namespace tandem::metrics {

/// Adds processor time, memory, open files and start time of this process, as far as /proc tells them.
void describe_process(Page& page);

}  // namespace tandem::metrics
