#pragma once
// The metrics of tandem-gateway: --metrics.

#include <cstddef>
#include <string>

#include "services/gateway/counts.hpp"
#include "services/program/metrics/client_series.hpp"
#include "services/program/metrics/page.hpp"

namespace tandem::gateway {

/// Figures of a moment, as one thread hands them to the other.
struct FiguresNow {
  Counts counts;
  std::size_t viewers = 0;
  metrics::ClientNow client;
};

/// The page of such figures, apart from what metrics/ adds for every program.
void describe(metrics::Page& page, const std::string& session, const FiguresNow& figures);

}  // namespace tandem::gateway
