#pragma once
// Readers of one form each; topology.cpp finds out which one a text has.

#include <optional>
#include <string_view>

#include "services/adapters/imd/topology.hpp"

namespace tandem::imd {

[[nodiscard]] Result<Topology> parse_lammps(std::string_view text, std::optional<double> radius);
[[nodiscard]] Result<Topology> parse_gro(std::string_view text, std::optional<double> radius);
[[nodiscard]] Result<Topology> parse_pdb(std::string_view text, std::optional<double> radius);
[[nodiscard]] Result<Topology> parse_xyz(std::string_view text, std::optional<double> radius);
/// Lines of our own.
[[nodiscard]] Result<Topology> parse_table(std::string_view text, std::optional<double> radius);

}  // namespace tandem::imd
