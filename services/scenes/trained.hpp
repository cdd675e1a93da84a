#pragma once
// What `tandem bench train` learnt about a scene, kept in a file beside it.

#include <cstdint>
#include <string>
#include <vector>

#include "tandem/result.hpp"

namespace tandem::scenes {

/// Ranges and code lengths of the paper's codecs, for one number of bodies and one error threshold.
struct TrainedTable {
  std::uint32_t bodies = 0;
  double threshold_m = 0;
  double position_range_m = 0;
  double velocity_range_m_per_s = 0;
  std::vector<std::uint8_t> position_code_lengths;  ///< bits by symbol
  std::vector<std::uint8_t> velocity_code_lengths;
  // Of scenes whose bodies turn.
  double turn_range_rad = 0;
  double spin_range_rad_per_s = 0;
  std::vector<std::uint8_t> turn_code_lengths{};
  std::vector<std::uint8_t> spin_code_lengths{};
  bool operator==(const TrainedTable&) const = default;
};

/// The table for exactly this size and threshold (to a millionth), or nullptr.
[[nodiscard]] const TrainedTable* find_table(const std::vector<TrainedTable>& tables, std::uint32_t bodies,
                                             double threshold_m);
/// The table whose threshold, and among those whose size, is nearest by ratio; nullptr when there is none.
[[nodiscard]] const TrainedTable* nearest_table(const std::vector<TrainedTable>& tables, std::uint32_t bodies,
                                                double threshold_m);

/// NAME.trained.textproto for NAME.textproto.
[[nodiscard]] std::string trained_path(const std::string& scene_path);
/// Tables beside a scene; none when there is no such file. Errors: kIo, kMalformed with file, line and field.
[[nodiscard]] Result<std::vector<TrainedTable>> load_trained(const std::string& scene_path);
/// Puts `table` in the place of the one for the same size and threshold, or behind the others, and replaces
/// the file in one go. Errors: kIo, kMalformed when the file there cannot be read.
[[nodiscard]] Result<void> save_trained(const std::string& scene_path, const TrainedTable& table);

}  // namespace tandem::scenes
