#include "services/lab/trajectories/trajectory.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <stdexcept>

namespace tandem::lab {
namespace {

static_assert(std::endian::native == std::endian::little, "npy rows are written as they lie in memory");

constexpr std::string_view kMagic{"\x93NUMPY\x01\x00", 8};
// Fixed, so that the header can be written before the number of rows is known.
constexpr std::size_t kHeaderBytes = 128;
constexpr std::size_t kMaxShapes = 4096;
constexpr double kNormSlack = 1e-3;
// First column in a body's row of: w, x, y, z, then the angular velocity.
constexpr std::size_t kOrientation = 6;
constexpr std::size_t kTurning = 10;
// numpy writes 118; std::regex recurses for every character, so a long header would end the stack.
constexpr std::size_t kMaxHeaderBytes = 4096;
// Rows are read and checked a frame at a time; a frame count beyond this is a broken header.
constexpr std::uint64_t kMaxRows = 1U << 24U;
// Maximum of the numbers in the sidecar; a larger one is a mistake.
constexpr double kMaxNumber = 1e9;

std::string header(std::uint64_t rows, std::uint32_t bodies, std::size_t channels) {
  std::string text(kMagic);
  const auto length = static_cast<std::uint16_t>(kHeaderBytes - kMagic.size() - 2);
  text += static_cast<char>(length & 0xffU);
  text += static_cast<char>(length >> 8U);
  text += fmt::format("{{'descr': '<f4', 'fortran_order': False, 'shape': ({}, {}, {}), }}", rows, bodies,
                      channels);
  text.resize(kHeaderBytes - 1, ' ');
  return text + '\n';
}

std::span<const std::byte> bytes_of(const std::string& text) { return std::as_bytes(std::span(text)); }

Result<double> positive(const nlohmann::json& json, const std::string& path, const char* key,
                        bool zero_allowed) {
  const auto found = json.find(key);
  if (found == json.end() || !found->is_number()) {
    return fail(ErrorCode::kMalformed, fmt::format("{}: expected a number \"{}\"", path, key));
  }
  const auto value = found->get<double>();
  if (!(value >= 0 && value <= kMaxNumber) || (value == 0 && !zero_allowed)) {
    return fail(ErrorCode::kMalformed,
                fmt::format("{}: \"{}\" is {:g}; expected a number {} 0 and at most {:g}", path, key, value,
                            zero_allowed ? ">=" : ">", kMaxNumber));
  }
  return value;
}

Result<std::vector<engine::Vec3>> gravity_rows(const nlohmann::json& json, const std::string& path,
                                               std::uint64_t rows) {
  const auto found = json.find("gravity");
  if (found == json.end() || !found->is_array() || found->size() != rows) {
    return fail(ErrorCode::kMalformed,
                fmt::format("{}: expected \"gravity\", an array with an [x, y, z] for each of the {} rows",
                            path, rows));
  }
  std::vector<engine::Vec3> gravity;
  gravity.reserve(found->size());
  for (const auto& entry : *found) {
    engine::Vec3 g{};
    bool good = entry.is_array() && entry.size() == g.size();
    for (std::size_t i = 0; good && i < g.size(); ++i) {
      good = entry[i].is_number();
      if (good) g[i] = entry[i].get<double>();
      good = good && std::isfinite(g[i]);
    }
    if (!good) {
      return fail(ErrorCode::kMalformed,
                  fmt::format("{}: \"gravity\" entry {} is {}; expected three finite numbers", path,
                              gravity.size(), entry.dump()));
    }
    gravity.push_back(g);
  }
  return gravity;
}

Result<std::string> scene_reference(const nlohmann::json& json, const std::string& path) {
  const auto found = json.find("scene");
  if (found == json.end()) return std::string();
  if (!found->is_string() || found->get_ref<const std::string&>().empty()) {
    return fail(ErrorCode::kMalformed,
                fmt::format("{}: \"scene\" is {}; expected the name of a scene, or the path of a .textproto "
                            "file from this file's folder",
                            path, found->dump()));
  }
  const auto& reference = found->get_ref<const std::string&>();
  const bool is_name = reference.find('/') == std::string::npos && !reference.ends_with(".textproto");
  return is_name ? reference : (std::filesystem::path(path).parent_path() / reference).string();
}

/// A number, or a list: then every radius becomes a sphere.
Result<void> read_radius(const nlohmann::json& json, const std::string& path, std::uint32_t bodies,
                         TrajectoryInfo& info) {
  const auto found = json.find("radius");
  if (found == json.end() || !found->is_array()) {
    return positive(json, path, "radius", false).map([&info](double radius) { info.radius = radius; });
  }
  const auto good = [](const nlohmann::json& entry) {
    return entry.is_number() && entry.get<double>() > 0 && entry.get<double>() <= kMaxNumber;
  };
  if (found->size() != bodies || !std::ranges::all_of(*found, good)) {
    return fail(
        ErrorCode::kMalformed,
        fmt::format("{}: expected \"radius\" to be a number, or a list of {} numbers > 0", path, bodies));
  }
  std::map<float, std::uint16_t> known;
  for (const auto& entry : *found) {
    const auto radius = entry.get<float>();
    const auto [place, is_new] = known.try_emplace(radius, static_cast<std::uint16_t>(info.shapes.size()));
    if (is_new) info.shapes.push_back({engine::Shape::Kind::kSphere, radius, {}});
    if (info.shapes.size() > kMaxShapes) {
      return fail(ErrorCode::kMalformed,
                  fmt::format("{}: \"radius\" has too many different numbers; expected at most {}", path,
                              kMaxShapes));
    }
    info.shape_of.push_back(place->second);
  }
  info.radius = static_cast<double>(known.begin()->first);
  return {};
}

Result<engine::Shape> shape_of(const nlohmann::json& json) {
  const auto refuse = [&json] {
    return fail(ErrorCode::kInvalidArgument, fmt::format("{} has no \"shape\" and \"values\"", json.dump()));
  };
  if (!json.is_object() || !json.contains("shape") || !json["shape"].is_string() ||
      !json.contains("values") || !json["values"].is_array()) {
    return refuse();
  }
  auto kind = engine::shape_kind(json["shape"].get<std::string>());
  if (!kind) return tl::unexpected(kind.error());
  engine::Shape shape{*kind, 0, {}};
  for (const auto& value : json["values"]) {
    if (!value.is_number()) return refuse();
    shape.values.push_back(value.get<float>());
  }
  if (*kind == engine::Shape::Kind::kSphere) {
    if (shape.values.size() != 1) return refuse();
    shape.radius = shape.values[0];
    shape.values.clear();
  }
  return engine::check(shape).map([&shape] { return std::move(shape); });
}

Result<void> read_shapes(const nlohmann::json& json, const std::string& path, std::uint32_t bodies,
                         TrajectoryInfo& info) {
  const auto shapes = json.find("shapes");
  if (shapes == json.end()) return {};
  const auto refuse = [&path](const std::string& expected) {
    return fail(ErrorCode::kMalformed, fmt::format("{}: expected {}", path, expected));
  };
  if (!shapes->is_array() || shapes->empty() || shapes->size() > kMaxShapes)
    return refuse(fmt::format("\"shapes\", a list of 1 to {} objects", kMaxShapes));
  info.shapes.clear();
  info.shape_of.clear();
  for (const auto& entry : *shapes) {
    auto shape = shape_of(entry);
    if (!shape) {
      return refuse(fmt::format("good \"shapes\"; entry {}: {}", info.shapes.size(), shape.error().message));
    }
    info.shapes.push_back(std::move(*shape));
  }
  const auto of = json.find("shape_of");
  const auto good = [&info](const nlohmann::json& entry) {
    return entry.is_number_unsigned() && entry.get<std::uint64_t>() < info.shapes.size();
  };
  if (of == json.end() || !of->is_array() || of->size() != bodies || !std::ranges::all_of(*of, good))
    return refuse(fmt::format("\"shape_of\", a list of {} places in \"shapes\", from 0", bodies));
  info.shape_of = of->get<std::vector<std::uint16_t>>();
  return {};
}

nlohmann::ordered_json to_json(const engine::Shape& shape) {
  constexpr std::array<const char*, 5> kNames{"sphere", "box", "capsule", "cylinder", "hull"};
  const bool sphere = shape.kind == engine::Shape::Kind::kSphere;
  return {{"shape", kNames[static_cast<std::size_t>(shape.kind) - 1]},
          {"values", sphere ? std::vector<float>{shape.radius} : shape.values}};
}

Result<TrajectoryInfo> read_info(const std::string& path, std::uint64_t rows, std::uint32_t bodies) {
  std::ifstream file(path);
  if (!file)
    return fail(ErrorCode::kIo,
                fmt::format("{}: cannot read; expected the JSON file that describes the trajectory", path));
  const nlohmann::json json = nlohmann::json::parse(file, nullptr, false);
  if (!json.is_object())
    return fail(ErrorCode::kMalformed, fmt::format("{}: expected one JSON object", path));
  TrajectoryInfo info;
  const struct {
    const char* key;
    double* value;
    bool zero_allowed;
  } numbers[] = {{"dt_s", &info.dt_s, false},
                 {"damping_per_s", &info.damping_per_s, true},
                 {"threshold", &info.threshold, false}};
  for (const auto& number : numbers) {
    auto value = positive(json, path, number.key, number.zero_allowed);
    if (!value) return tl::unexpected(value.error());
    *number.value = *value;
  }
  if (auto read = read_radius(json, path, bodies, info); !read) return tl::unexpected(read.error());
  if (auto read = read_shapes(json, path, bodies, info); !read) return tl::unexpected(read.error());
  auto gravity = gravity_rows(json, path, rows);
  if (!gravity) return tl::unexpected(gravity.error());
  info.gravity = std::move(*gravity);
  auto scene = scene_reference(json, path);
  if (!scene) return tl::unexpected(scene.error());
  info.scene = std::move(*scene);
  return info;
}

}  // namespace

Result<std::string> sidecar_path(const std::string& npy) {
  constexpr std::string_view kSuffix = ".npy";
  if (npy.size() <= kSuffix.size() ||
      npy.compare(npy.size() - kSuffix.size(), kSuffix.size(), kSuffix) != 0) {
    return fail(ErrorCode::kInvalidArgument, fmt::format("{}: expected a file name that ends in .npy", npy));
  }
  return npy.substr(0, npy.size() - kSuffix.size()) + ".json";
}

TrajectoryWriter::TrajectoryWriter(recording::OutputFile npy, recording::OutputFile sidecar,
                                   std::uint32_t bodies, std::size_t channels)
    : npy_(std::move(npy)),
      sidecar_(std::move(sidecar)),
      bodies_(bodies),
      channels_(channels),
      row_(bodies * channels) {}

Result<TrajectoryWriter> TrajectoryWriter::create(const std::string& npy, std::uint32_t bodies,
                                                  std::size_t channels) {
  auto sidecar_name = sidecar_path(npy);
  if (!sidecar_name) return tl::unexpected(sidecar_name.error());
  auto rows = recording::OutputFile::create(npy, recording::Existing::kReplaced);
  if (!rows) return tl::unexpected(rows.error());
  auto sidecar = recording::OutputFile::create(*sidecar_name, recording::Existing::kReplaced);
  if (!sidecar) return tl::unexpected(sidecar.error());
  if (auto written = rows->write(bytes_of(header(0, bodies, channels))); !written)
    return tl::unexpected(written.error());
  return TrajectoryWriter(std::move(*rows), std::move(*sidecar), bodies, channels);
}

Result<void> TrajectoryWriter::append(const engine::Bodies& bodies) {
  for (std::size_t i = 0; i < bodies_; ++i) {
    const bool alive = bodies.alive[i] != 0;
    const std::span<float> row = std::span(row_).subspan(channels_ * i, channels_);
    std::ranges::fill(row, 0.0F);
    if (channels_ == kRigidChannels) row[kOrientation] = 1;
    if (!alive) continue;
    for (std::size_t channel = 0; channel < 3; ++channel) {
      row[channel] = bodies.position[channel][i];
      row[3 + channel] = bodies.velocity[channel][i];
      if (channels_ != kRigidChannels) continue;
      row[kOrientation + 1 + channel] = bodies.orientation[channel][i];
      row[kTurning + channel] = bodies.angular_velocity[channel][i];
    }
    if (channels_ == kRigidChannels) row[kOrientation] = bodies.orientation[3][i];
  }
  ++rows_;
  return npy_.write(std::as_bytes(std::span(row_)));
}

Result<void> TrajectoryWriter::finish(const TrajectoryInfo& info) {
  nlohmann::ordered_json json{{"dt_s", info.dt_s},
                              {"damping_per_s", info.damping_per_s},
                              {"radius", info.radius},
                              {"threshold", info.threshold}};
  if (!info.scene.empty()) json["scene"] = info.scene;
  if (!info.shapes.empty()) {
    json["shapes"] = nlohmann::ordered_json::array();
    for (const engine::Shape& shape : info.shapes) json["shapes"].push_back(to_json(shape));
    json["shape_of"] = info.shape_of;
  }
  json["gravity"] = info.gravity;
  return npy_.rewrite_start(bytes_of(header(rows_, bodies_, channels_)))
      .and_then([&] { return sidecar_.write(bytes_of(json.dump() + '\n')); })
      .and_then([&] { return npy_.sync(); })
      .and_then([&] { return sidecar_.commit(); })
      .and_then([&] { return npy_.commit(); });
}

Result<std::unique_ptr<RecordedTrajectory>> RecordedTrajectory::open(const std::string& npy) {
  auto sidecar = sidecar_path(npy);
  if (!sidecar) return tl::unexpected(sidecar.error());
  std::unique_ptr<RecordedTrajectory> trajectory(new RecordedTrajectory);
  if (auto opened = trajectory->open_npy(npy); !opened) return tl::unexpected(opened.error());
  auto info = read_info(*sidecar, trajectory->rows_, trajectory->bodies_);
  if (!info) return tl::unexpected(info.error());
  trajectory->info_ = std::move(*info);
  if (!trajectory->info_.shape_of.empty()) trajectory->type_ = trajectory->info_.shape_of;
  if (auto checked = trajectory->check_rows(); !checked) return tl::unexpected(checked.error());
  if (!trajectory->read_row(0)) return fail(ErrorCode::kIo, npy + ": cannot read any more");
  return trajectory;
}

Result<void> RecordedTrajectory::open_npy(const std::string& path) {
  const auto malformed = [&](const std::string& found) {
    return fail(
        ErrorCode::kMalformed,
        fmt::format(
            "{}: {}; expected a .npy file of little-endian float32 with shape (frames + 1, bodies, 6) or "
            "(frames + 1, bodies, 13)",
            path, found));
  };
  path_ = path;
  file_.open(path, std::ios::binary);
  if (!file_) return fail(ErrorCode::kIo, fmt::format("{}: cannot read", path));
  file_.seekg(0, std::ios::end);
  const std::streamoff file_bytes = file_.tellg();
  file_.seekg(0);
  unsigned char start[12] = {};
  file_.read(static_cast<char*>(static_cast<void*>(start)), 10);
  if (!file_ || std::memcmp(start, kMagic.data(), 6) != 0) return malformed("not a .npy file");
  std::size_t length = start[8] + 256U * start[9];
  if (start[6] > 1) {  // versions 2 and 3: four bytes of length
    file_.read(static_cast<char*>(static_cast<void*>(start + 10)), 2);
    length += 65536U * start[10] + 16777216U * start[11];
  }
  if (!file_ || length > kMaxHeaderBytes) return malformed("the header is cut off or too long");
  std::string text(length, ' ');
  file_.read(text.data(), static_cast<std::streamsize>(length));
  if (!file_) return malformed("the header is cut off");
  data_offset_ = file_.tellg();

  static const std::regex type_pattern(R"('descr'\s*:\s*'([^']*)')");
  static const std::regex order_pattern(R"('fortran_order'\s*:\s*False)");
  static const std::regex shape_pattern(R"('shape'\s*:\s*\(([^)]*)\))");
  static const std::regex size_pattern(R"(\s*(\d{1,9})\s*,\s*(\d{1,9})\s*,\s*(6|13)\s*,?\s*)");
  std::smatch match;
  if (!std::regex_search(text, match, type_pattern) || match[1] != "<f4") {
    return malformed(match.empty() ? "no single 'descr'" : fmt::format("the type is '{}'", match[1].str()));
  }
  if (!std::regex_search(text, order_pattern)) return malformed("the order is Fortran's");
  if (!std::regex_search(text, match, shape_pattern)) return malformed("no 'shape'");
  const std::string shape = match[1];
  if (!std::regex_match(shape, match, size_pattern)) {
    return malformed(fmt::format("the shape is ({})", shape));
  }
  rows_ = std::stoull(match[1]);
  const std::uint64_t bodies = std::stoull(match[2]);
  if (rows_ < 2 || rows_ > kMaxRows || bodies == 0 || bodies > engine::kMaxBodies) {
    return malformed(fmt::format("the shape is ({}), outside 2..{} rows and 1..{} bodies", shape, kMaxRows,
                                 engine::kMaxBodies));
  }
  bodies_ = static_cast<std::uint32_t>(bodies);
  channels_ = std::stoull(match[3]);
  const std::uint64_t expected = rows_ * bodies * channels_ * sizeof(float);
  const auto found = static_cast<std::uint64_t>(file_bytes - data_offset_);
  if (found != expected) {
    return malformed(fmt::format("{} bytes of data, where shape ({}) needs {}", found, shape, expected));
  }
  interleaved_.resize(bodies_ * channels_);
  for (std::size_t channel = 0; channel < channels_; ++channel) columns_[channel].resize(bodies_);
  alive_.assign(bodies_, 1);
  type_.assign(bodies_, 0);
  return {};
}

Result<void> RecordedTrajectory::check_rows() {
  for (std::uint64_t row = 0; row < rows_; ++row) {
    if (!read_row(row)) return fail(ErrorCode::kIo, fmt::format("{}: cannot read row {}", path_, row));
    for (std::size_t i = 0; i < interleaved_.size(); ++i) {
      if (!std::isfinite(interleaved_[i])) {
        return fail(ErrorCode::kMalformed,
                    fmt::format("{}: frame {}, body {}, channel {} is not finite; expected numbers only",
                                path_, row, i / channels_, i % channels_));
      }
    }
    if (auto turning = check_turning(row); !turning) return turning;
    for (std::size_t channel = 0; channel < 3; ++channel) {
      for (const float value : columns_[channel])
        position_bound_ = std::max(position_bound_, std::fabs(double{value}));
    }
  }
  return {};
}

Result<void> RecordedTrajectory::check_turning(std::uint64_t row) const {
  if (channels_ != kRigidChannels) return {};
  const auto length = [this](std::size_t begin, std::size_t end, std::size_t body) {
    double squared = 0;
    for (std::size_t channel = begin; channel < end; ++channel) {
      const auto value = static_cast<double>(columns_[channel][body]);
      squared += value * value;
    }
    return std::sqrt(squared);
  };
  for (std::size_t body = 0; body < bodies_; ++body) {
    const double norm = length(kOrientation, kTurning, body);
    if (std::fabs(norm - 1) > kNormSlack) {
      return fail(ErrorCode::kMalformed,
                  fmt::format("{}: frame {}, body {}: the quaternion's norm is {:.4g}; expected 1 within {}",
                              path_, row, body, norm, kNormSlack));
    }
    const double turn = length(kTurning, kRigidChannels, body) * info_.dt_s;
    if (turn > engine::kMaxTurn) {
      return fail(ErrorCode::kMalformed,
                  fmt::format("{}: frame {}, body {} turns by {:.4g} rad a row; expected at most {}", path_,
                              row, body, turn, engine::kMaxTurn));
    }
  }
  return {};
}

bool RecordedTrajectory::read_row(std::uint64_t row) {
  const std::size_t row_bytes = interleaved_.size() * sizeof(float);
  file_.seekg(data_offset_ + static_cast<std::streamoff>(row * row_bytes));
  file_.read(static_cast<char*>(static_cast<void*>(interleaved_.data())),
             static_cast<std::streamsize>(row_bytes));
  if (!file_) return false;
  for (std::size_t i = 0; i < bodies_; ++i) {
    for (std::size_t channel = 0; channel < channels_; ++channel)
      columns_[channel][i] = interleaved_[channels_ * i + channel];
  }
  row_ = row;
  return true;
}

void RecordedTrajectory::step() {
  if (row_ + 1 >= rows_ || !read_row(row_ + 1))
    throw std::runtime_error(fmt::format("{}: no row {}", path_, row_ + 1));
}

engine::Vec3 RecordedTrajectory::gravity() const { return info_.gravity[std::min(row_ + 1, rows_ - 1)]; }

engine::Bodies RecordedTrajectory::bodies() const {
  // The columns beyond the sixth are empty where the file has none. Ours are x, y, z, w.
  const auto& c = columns_;
  return {.position = {c[0], c[1], c[2]},
          .velocity = {c[3], c[4], c[5]},
          .alive = alive_,
          .type = type_,
          .orientation = {c[7], c[8], c[9], c[6]},
          .angular_velocity = {c[10], c[11], c[12]}};
}

}  // namespace tandem::lab
