#pragma once
// The file that `bench_lab train` writes and scenes::load_trained() reads.

#include <span>
#include <string>
#include <vector>

#include "services/engines/scenes/trained.hpp"

namespace tandem::lab {

[[nodiscard]] std::string trained_text(std::span<const scenes::TrainedTable> tables);
/// Puts `table` in the place of the one for as many bodies and the same threshold, or at the end.
void put(std::vector<scenes::TrainedTable>& tables, scenes::TrainedTable table);

}  // namespace tandem::lab
