#include "services/host/planning/trained_table.hpp"

#include <algorithm>
#include <utility>

namespace tandem::planning {
namespace {

// The ratio of two sizes, at least 1; 1 if they are equal.
double ratio(double a, double b) { return a > b ? a / b : b / a; }

}  // namespace

const TrainedTable* nearest_table(const std::vector<TrainedTable>& tables, std::uint32_t bodies,
                                  double threshold_m) {
  const auto distance = [&](const TrainedTable& table) {
    return std::pair(ratio(table.threshold_m, threshold_m), ratio(table.bodies, bodies));
  };
  const auto found = std::min_element(
      tables.begin(), tables.end(),
      [&](const TrainedTable& a, const TrainedTable& b) { return distance(a) < distance(b); });
  return found == tables.end() ? nullptr : &*found;
}

}  // namespace tandem::planning
