#pragma once
// Series of figures that have a table already: tandem/server_figures.hpp, tandem/client_figures.hpp.

#include <string>
#include <string_view>

#include "services/program/metrics/page.hpp"
#include "tandem/client_figures.hpp"
#include "tandem/server_figures.hpp"

namespace tandem::metrics {

/// A series that is made from a figure's name: its unit becomes a base unit, and its place is the name's end.
struct FigureSeries {
  std::string name;
  double scale = 1;  ///< of the figure's value
};
/// `prefix` "tandem_client_", `figure` "client_ms_p50", a state: "tandem_client_client_p50_seconds", 0.001.
[[nodiscard]] FigureSeries series_of(std::string_view prefix, std::string_view figure, bool is_count);

/// Adds all counts of a server, except those that it has in more detail: by stream, or by reason.
void describe(Page& page, const ServerCounts& counts);
/// Adds all figures of a client.
void describe(Page& page, const ClientFigures& figures);

}  // namespace tandem::metrics
