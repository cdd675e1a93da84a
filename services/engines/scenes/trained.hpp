#pragma once
// Tables that `bench_lab train` has learned about a scene, kept in a file next to the scene.

#include <cstdint>
#include <string>
#include <vector>

#include "services/host/planning/trained_table.hpp"
#include "tandem/result.hpp"

namespace tandem::scenes {

using planning::TrainedTable;

/// The table for exactly this size and threshold (to a millionth), or nullptr.
[[nodiscard]] const TrainedTable* find_table(const std::vector<TrainedTable>& tables, std::uint32_t bodies,
                                             double threshold_m);
/// NAME.trained.textproto for NAME.textproto.
[[nodiscard]] std::string trained_path(const std::string& scene_path);
/// Loads the tables next to a scene; empty if there is no such file. Errors: kIo, kMalformed with file, line
/// and field.
[[nodiscard]] Result<std::vector<TrainedTable>> load_trained(const std::string& scene_path);

}  // namespace tandem::scenes
