#include "services/lab/bandwidth/bandwidth_columns.hpp"

#include <fmt/format.h>

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "services/lab/measures/paper_numbers.hpp"
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
  kSteered,   // ours with gains
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
    case kSteered:
      return row.traits.reads_gains;
  }
  return false;
}

struct Column {
  std::string_view name;  // in JSON and CSV
  Json (*value)(const Row& row);
  Rows json = kNone, csv = kNone, table = kNone;
  std::string_view title = {};  // in the table
  int width = 0;                // in the table; below 0: flush left
  int digits = 0;               // behind the point, in the table
};

template <auto kField>
Json field(const Row& row) {
  return row.*kField;
}
template <auto kField>
Json optional_field(const Row& row) {
  return row.*kField;
}

Json decay(const Row& row) { return row.parameters.step.decay / 65536.0; }
Json velocity_gain(const Row& row) { return row.parameters.codec.velocity_gain / 32768.0; }
Json acceleration_gain(const Row& row) { return row.parameters.codec.acceleration_gain / 65536.0; }
Json paper_mbit(const Row& row) {
  return row.number ? Json(paper_mbit_per_s(*row.number, row.bodies, row.codec)) : Json(nullptr);
}
Json paper_colliding(const Row& row) {
  return row.number ? Json(paper_colliding_per_frame(*row.number, row.bodies)) : Json(nullptr);
}
Json missing(const Row& row) { return row.missing.empty() ? Json(nullptr) : Json(row.missing); }

constexpr Column kColumns[] = {
    {"scene", field<&Row::scene>, kAll, kAll, kAll, "scene", -12},
    {"number", optional_field<&Row::number>, kAll, kAll},
    {"bodies", field<&Row::bodies>, kAll, kAll, kAll, "bodies", 7},
    {"codec", field<&Row::codec>, kAll, kAll, kAll, "codec", -10},
    {"predictor", field<&Row::predictor>, kAll, kAll, kOurs, "predictor", -9},
    {"decay", decay, kOurs, kSteered},
    {"velocity_gain", velocity_gain, kOurs, kSteered},
    {"acceleration_gain", acceleration_gain, kOurs, kSteered},
    {"threads", field<&Row::threads>, kAll},
    {"seed", field<&Row::seed>, kAll, kAll},
    {"frames", field<&Row::frames>, kAll, kAll},
    {"dt_s", field<&Row::dt_s>, kAll},
    {"threshold", field<&Row::threshold>, kAll, kAll},
    {"lattice_unit", field<&Row::lattice_unit>, kAll},
    {"mbit_per_s", field<&Row::mbit_per_s>, kMeasured, kMeasured, kMeasured, "Mbit/s", 8, 3},
    {"paper_mbit_per_s", paper_mbit, kAll, kAll, kMeasured, "paper", 7, 2},
    {"ideal_mbit_per_s", optional_field<&Row::ideal_mbit_per_s>, kAll, kAll},
    {"bound_mbit_per_s", optional_field<&Row::bound_mbit_per_s>, kAll, kAll, kMeasured, "bound", 7, 3},
    {"max_error", field<&Row::max_error>, kMeasured, kMeasured, kMeasured, "max err", 9, 5},
    {"rms_error", field<&Row::rms_error>, kMeasured, kMeasured, kMeasured, "rms err", 9, 5},
    {"max_surface_error", optional_field<&Row::max_surface_error>, kOurs, kOurs},
    {"rms_surface_error", optional_field<&Row::rms_surface_error>, kOurs, kOurs},
    // The table has the threshold so that people can compare it with the errors.
    {"threshold", field<&Row::threshold>, kNone, kNone, kMeasured, "threshold", 9, 5},
    {"max_surface_error", optional_field<&Row::max_surface_error>, kNone, kNone, kOurs, "max surf", 9, 5},
    {"rms_surface_error", optional_field<&Row::rms_surface_error>, kNone, kNone, kOurs, "rms surf", 9, 5},
    {"max_snap", field<&Row::max_snap>, kOurs, kOurs},
    {"rms_snap", field<&Row::rms_snap>, kOurs, kOurs, kOurs, "rms snap", 9, 5},
    {"corrected_per_frame", field<&Row::corrected_per_frame>, kOurs, kOurs, kOurs, "corrected", 9, 1},
    {"at_rest_per_frame", field<&Row::at_rest_per_frame>, kOurs, kNone, kOurs, "at rest", 8, 1},
    {"snapshot_bytes_per_body", field<&Row::snapshot_bytes_per_body>, kOurs, kNone, kOurs, "snapshot", 8, 2},
    {"colliding_per_frame", optional_field<&Row::colliding_per_frame>, kAll, kAll, kOurs, "colliding", 9},
    {"paper_colliding_per_frame", paper_colliding, kAll, kNone, kOurs, "paper", 7},
    {"step_ms", field<&Row::step_ms>, kAll, kNone, kOurs, "step ms", 8, 3},
    {"predict_ms", field<&Row::predict_ms>, kOurs, kNone, kOurs, "predict", 8, 3},
    {"encode_ms", field<&Row::encode_ms>, kOurs, kNone, kOurs, "encode", 8, 3},
    {"decode_ms", field<&Row::decode_ms>, kOurs, kNone, kOurs, "decode", 8, 3},
    {"apply_ms", field<&Row::apply_ms>, kOurs, kNone, kOurs, "apply", 8, 3},
    {"missing", missing, kAll, kAll},
};

Json value_of(const Column& column, Rows rows, const Row& row) {
  return is_among(row, rows) ? column.value(row) : Json(nullptr);
}

/// Fractions have `digits` digits behind the point, or as many as needed.
std::string text_of(const Json& value, std::optional<int> digits) {
  if (value.is_text()) return value.text();
  if (!value.is_real()) return value.dump();
  return digits ? fmt::format("{:.{}f}", value.number(), *digits) : fmt::format("{}", value.number());
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

std::string to_json(std::span<const BandwidthRow> rows) {
  Json list = Json::array();
  for (const Row& row : rows) {
    Json& object = list.push_back(Json::object());
    for (const Column& column : kColumns) {
      if (column.json != kNone) object[column.name] = value_of(column, column.json, row);
    }
  }
  return Json{{"rows", list}}.dump();
}

std::string to_csv(std::span<const BandwidthRow> rows) {
  std::string text;
  const auto add_line = [&text](const auto& cell) {
    std::vector<std::string> cells;
    for (const Column& column : kColumns) {
      if (column.csv != kNone) cells.push_back(cell(column));
    }
    text += fmt::format("{}\n", fmt::join(cells, ","));
  };
  add_line([](const Column& column) { return std::string(column.name); });
  for (const Row& row : rows) {
    add_line([&row](const Column& column) {
      const Json value = value_of(column, column.csv, row);
      return value.is_null() ? std::string() : text_of(value, std::nullopt);
    });
  }
  return text;
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
