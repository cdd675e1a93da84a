#pragma once
// Tables that `bench_lab train` has learned about a world.

#include <cstdint>
#include <vector>

namespace tandem::planning {

/// Ranges and code lengths of the thesis's codecs, for one number of bodies and one error threshold.
struct TrainedTable {
  std::uint32_t bodies = 0;
  double threshold_m = 0;
  double position_range_m = 0;
  double velocity_range_m_per_s = 0;
  std::vector<std::uint8_t> position_code_lengths;  ///< bits by symbol
  std::vector<std::uint8_t> velocity_code_lengths;
  // Only for worlds whose bodies turn.
  double turn_range_rad = 0;
  double spin_range_rad_per_s = 0;
  std::vector<std::uint8_t> turn_code_lengths{};
  std::vector<std::uint8_t> spin_code_lengths{};
  bool operator==(const TrainedTable&) const = default;
};

/// The table with the nearest threshold, and among those the one with the nearest size, both by ratio;
/// nullptr if there is none.
[[nodiscard]] const TrainedTable* nearest_table(const std::vector<TrainedTable>& tables, std::uint32_t bodies,
                                                double threshold_m);

}  // namespace tandem::planning
