#pragma once
// A chart with two logarithmic axes, as SVG.

#include <string>
#include <utility>
#include <vector>

#include "tandem/result.hpp"

namespace tandem::lab {

struct ChartLine {
  std::string name;
  std::vector<std::pair<double, double>> points;  ///< ascending x; those that are not above 0 are left out
};

/// The slope of the line through the points, both axes logarithmic, by least squares; 0 below two points.
[[nodiscard]] double log_slope(const std::vector<std::pair<double, double>>& points);

/// Writes the chart to `path`. Errors: kIo.
[[nodiscard]] Result<void> draw_chart(const std::string& path, const std::string& title,
                                      const std::string& x_name, const std::string& y_name,
                                      const std::vector<ChartLine>& lines);

}  // namespace tandem::lab
