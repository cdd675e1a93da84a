#include "tests/bench/lab/trained_text.hpp"

#include <fmt/format.h>

#include <cstddef>
#include <utility>

namespace tandem::lab {
namespace {

std::string text_of(const scenes::TrainedTable& table) {
  std::string text;
  const auto number = [&text](const char* name, double value) {
    if (value != 0) text += fmt::format("  {}: {}\n", name, value);
  };
  const auto lengths = [&text](const char* name, const std::vector<std::uint8_t>& values) {
    if (!values.empty()) text += fmt::format("  {}: [{}]\n", name, fmt::join(values, ", "));
  };
  number("bodies", table.bodies);
  number("threshold_m", table.threshold_m);
  number("position_range_m", table.position_range_m);
  number("velocity_range_m_per_s", table.velocity_range_m_per_s);
  lengths("position_code_lengths", table.position_code_lengths);
  lengths("velocity_code_lengths", table.velocity_code_lengths);
  number("turn_range_rad", table.turn_range_rad);
  number("spin_range_rad_per_s", table.spin_range_rad_per_s);
  lengths("turn_code_lengths", table.turn_code_lengths);
  lengths("spin_code_lengths", table.spin_code_lengths);
  return "tables {\n" + text + "}\n";
}

}  // namespace

std::string trained_text(std::span<const scenes::TrainedTable> tables) {
  std::string text = "# Written by `bench_lab train`.\n";
  for (const scenes::TrainedTable& table : tables) text += text_of(table);
  return text;
}

void put(std::vector<scenes::TrainedTable>& tables, scenes::TrainedTable table) {
  const scenes::TrainedTable* const old = scenes::find_table(tables, table.bodies, table.threshold_m);
  if (old == nullptr) return tables.push_back(std::move(table));
  tables[static_cast<std::size_t>(old - tables.data())] = std::move(table);
}

}  // namespace tandem::lab
