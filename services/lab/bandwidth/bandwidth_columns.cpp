#include "services/lab/bandwidth/bandwidth_columns.hpp"

#include <fmt/format.h>

#include <string>
#include <string_view>
#include <vector>

#include "services/program/json/json.hpp"

namespace tandem::lab {
namespace {

using Row = BandwidthRow;

/// The rows that have a value in a column; the others have null, nothing or "-" there.
enum class Rows : std::uint8_t {
  kNone,  // the column is not in this output
  kAll,
  kMeasured,  // all but peers that this build lacks
  kOurs,      // all but peers
};
using enum Rows;

bool is_among(const Row& row, Rows rows) {
  switch (rows) {
    case kNone:
      return false;
    case kAll:
      return true;
    case kMeasured:
      return row.missing.empty();
    case kOurs:
      return !row.predictor.empty();
  }
  return false;
}

struct Column {
  std::string_view name;  // in JSON
  Json (*value)(const Row& row);
  Rows json = kNone, table = kNone;
  std::string_view title = {};  // in the table
  int width = 0;                // in the table; below 0: flush left
  int digits = 0;               // behind the point, in the table
};

template <auto kField>
Json field(const Row& row) {
  return row.*kField;
}

Json decay(const Row& row) { return row.parameters.step.decay / 65536.0; }
Json velocity_gain(const Row& row) { return row.parameters.codec.velocity_gain / 32768.0; }
Json acceleration_gain(const Row& row) { return row.parameters.codec.acceleration_gain / 65536.0; }
Json missing(const Row& row) { return row.missing.empty() ? Json(nullptr) : Json(row.missing); }

constexpr Column kColumns[] = {
    {"scene", field<&Row::scene>, kAll, kAll, "scene", -12},
    {"number", field<&Row::number>, kAll},
    {"bodies", field<&Row::bodies>, kAll, kAll, "bodies", 7},
    {"codec", field<&Row::codec>, kAll, kAll, "codec", -10},
    {"predictor", field<&Row::predictor>, kAll, kOurs, "predictor", -9},
    {"decay", decay, kOurs},
    {"velocity_gain", velocity_gain, kOurs},
    {"acceleration_gain", acceleration_gain, kOurs},
    {"threads", field<&Row::threads>, kAll},
    {"seed", field<&Row::seed>, kAll},
    {"frames", field<&Row::frames>, kAll},
    {"dt_s", field<&Row::dt_s>, kAll},
    {"lattice_unit", field<&Row::lattice_unit>, kAll},
    {"mbit_per_s", field<&Row::mbit_per_s>, kMeasured, kMeasured, "Mbit/s", 8, 3},
    {"wire_mbit_per_s", field<&Row::wire_mbit_per_s>, kMeasured, kMeasured, "wire", 8, 3},
    {"ideal_mbit_per_s", field<&Row::ideal_mbit_per_s>, kAll},
    {"bound_mbit_per_s", field<&Row::bound_mbit_per_s>, kAll, kMeasured, "bound", 7, 3},
    {"max_error", field<&Row::max_error>, kMeasured, kMeasured, "max err", 9, 5},
    {"rms_error", field<&Row::rms_error>, kMeasured, kMeasured, "rms err", 9, 5},
    {"threshold", field<&Row::threshold>, kAll, kMeasured, "threshold", 9, 5},
    {"max_surface_error", field<&Row::max_surface_error>, kOurs, kOurs, "max surf", 9, 5},
    {"rms_surface_error", field<&Row::rms_surface_error>, kOurs, kOurs, "rms surf", 9, 5},
    {"max_snap", field<&Row::max_snap>, kOurs},
    {"rms_snap", field<&Row::rms_snap>, kOurs, kOurs, "rms snap", 9, 5},
    {"corrected_per_frame", field<&Row::corrected_per_frame>, kOurs, kOurs, "corrected", 9, 1},
    {"at_rest_per_frame", field<&Row::at_rest_per_frame>, kOurs, kOurs, "at rest", 8, 1},
    {"snapshot_bytes_per_body", field<&Row::snapshot_bytes_per_body>, kOurs, kOurs, "snapshot", 8, 2},
    {"colliding_per_frame", field<&Row::colliding_per_frame>, kAll, kOurs, "colliding", 9},
    {"step_ms", field<&Row::step_ms>, kAll, kOurs, "step ms", 8, 3},
    {"predict_ms", field<&Row::predict_ms>, kOurs, kOurs, "predict", 8, 3},
    {"encode_ms", field<&Row::encode_ms>, kOurs, kOurs, "encode", 8, 3},
    {"decode_ms", field<&Row::decode_ms>, kOurs, kOurs, "decode", 8, 3},
    {"apply_ms", field<&Row::apply_ms>, kOurs, kOurs, "apply", 8, 3},
    {"missing", missing, kAll},
};

Json value_of(const Column& column, Rows rows, const Row& row) {
  return is_among(row, rows) ? column.value(row) : Json(nullptr);
}

/// Fractions have `digits` digits behind the point.
std::string text_of(const Json& value, int digits) {
  if (value.is_text()) return value.text();
  return value.is_real() ? fmt::format("{:.{}f}", value.number(), digits) : value.dump();
}

std::string padded(std::string_view text, int width) {
  return width < 0 ? fmt::format("{:<{}}", text, -width) : fmt::format("{:>{}}", text, width);
}

/// The cells of a row, up to the last one that it has.
std::vector<std::string> cells_of(const Row& row) {
  std::vector<std::string> cells;
  std::size_t had = 0;
  for (const Column& column : kColumns) {
    if (column.table == kNone) continue;
    const Json value = value_of(column, column.table, row);
    cells.push_back(padded(value.is_null() ? "-" : text_of(value, column.digits), column.width));
    if (is_among(row, column.table)) had = cells.size();
  }
  cells.resize(had);
  return cells;
}

}  // namespace

std::string to_json(std::span<const BandwidthRow> rows, bool series) {
  Json list = Json::array();
  for (const Row& row : rows) {
    Json& object = list.push_back(Json::object());
    for (const Column& column : kColumns) {
      object[column.name] = value_of(column, column.json, row);
    }
    if (!series) continue;
    for (const std::uint32_t bytes : row.bytes) object["payload_bytes"].push_back(bytes);
    for (const std::uint32_t colliding : row.colliding) object["colliding"].push_back(colliding);
  }
  return Json{{"rows", list}}.dump();
}

std::string to_table(std::span<const BandwidthRow> rows) {
  std::vector<std::string> titles;
  for (const Column& column : kColumns) {
    if (column.table != kNone) titles.push_back(padded(column.title, column.width));
  }
  std::string text = fmt::format("{}\n", fmt::join(titles, " "));
  for (const Row& row : rows) {
    text += fmt::format("{}", fmt::join(cells_of(row), " "));
    if (!row.missing.empty()) text += fmt::format(" not in this build: {} was missing", row.missing);
    text += '\n';
  }
  return text;
}

}  // namespace tandem::lab
