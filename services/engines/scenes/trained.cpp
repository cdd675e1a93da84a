#include "services/engines/scenes/trained.hpp"

#include <scene.pb.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "services/engines/scenes/text_file.hpp"
#include "services/program/protobuf_text/protobuf_text.hpp"

namespace tandem::scenes {
namespace {

namespace fs = std::filesystem;
constexpr int kMaxSymbols = 65536;
constexpr std::uint32_t kMaxCodeLength = 64;
constexpr double kSameThreshold = 1e-6;

bool same_threshold(double a, double b) { return std::fabs(a - b) <= kSameThreshold * std::fabs(b); }

std::vector<std::uint8_t> narrowed(const google::protobuf::RepeatedField<std::uint32_t>& lengths) {
  std::vector<std::uint8_t> result;
  result.reserve(static_cast<std::size_t>(lengths.size()));
  for (const std::uint32_t length : lengths) result.push_back(static_cast<std::uint8_t>(length));
  return result;
}

void check_lengths(const Node& node, const google::protobuf::RepeatedField<std::uint32_t>& lengths,
                   const std::string& field) {
  node.require(lengths.size() <= kMaxSymbols, field, "has too many entries");
  for (int i = 0; i < lengths.size(); ++i) {
    node.require(lengths[i] <= kMaxCodeLength, field, "must be at most 64 bits", i);
  }
}

void check_table(const Node& node, const idl::TrainedTable& table) {
  node.require_sane_numbers();
  node.require(table.bodies() > 0, "bodies", "must be above 0");
  node.require(table.threshold_m() > 0, "threshold_m", "must be above 0");
  node.require(table.position_range_m() >= 0, "position_range_m", "must not be negative");
  node.require(table.velocity_range_m_per_s() >= 0, "velocity_range_m_per_s", "must not be negative");
  check_lengths(node, table.position_code_lengths(), "position_code_lengths");
  check_lengths(node, table.velocity_code_lengths(), "velocity_code_lengths");
  node.require(table.turn_range_rad() >= 0, "turn_range_rad", "must not be negative");
  node.require(table.spin_range_rad_per_s() >= 0, "spin_range_rad_per_s", "must not be negative");
  check_lengths(node, table.turn_code_lengths(), "turn_code_lengths");
  check_lengths(node, table.spin_code_lengths(), "spin_code_lengths");
}

}  // namespace

const TrainedTable* find_table(const std::vector<TrainedTable>& tables, std::uint32_t bodies,
                               double threshold_m) {
  const auto found = std::find_if(tables.begin(), tables.end(), [&](const TrainedTable& table) {
    return table.bodies == bodies && same_threshold(table.threshold_m, threshold_m);
  });
  return found == tables.end() ? nullptr : &*found;
}

std::string trained_path(const std::string& scene_path) {
  return fs::path(scene_path).replace_extension(".trained.textproto").string();
}

Result<std::vector<TrainedTable>> load_trained(const std::string& scene_path) {
  const std::string path = trained_path(scene_path);
  std::vector<TrainedTable> tables;
  std::error_code ignored;
  if (!fs::exists(path, ignored)) return tables;

  idl::TrainedTables file;
  google::protobuf::TextFormat::ParseInfoTree lines;
  if (auto read = protobuf_text::read_file(path, file, lines); !read) return tl::unexpected(read.error());
  Findings findings{path, {}};
  const Node root(file, &lines, "", 1, findings);
  for (int i = 0; i < file.tables_size(); ++i) {
    const idl::TrainedTable& table = file.tables(i);
    check_table(root.child("tables", i), table);
    tables.push_back({table.bodies(), table.threshold_m(), table.position_range_m(),
                      table.velocity_range_m_per_s(), narrowed(table.position_code_lengths()),
                      narrowed(table.velocity_code_lengths()), table.turn_range_rad(),
                      table.spin_range_rad_per_s(), narrowed(table.turn_code_lengths()),
                      narrowed(table.spin_code_lengths())});
  }
  if (findings.first) return tl::unexpected(*findings.first);
  return tables;
}

}  // namespace tandem::scenes
