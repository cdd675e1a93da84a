#include "services/lab/trajectories/export_recording.hpp"

#include <fmt/format.h>

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>
#include <utility>

#include "services/engines/scenes/scene.hpp"
#include "services/follow/recording/mcap_writer.hpp"
#include "services/follow/recording/output_file.hpp"
#include "services/follow/recording/playback.hpp"
#include "services/lab/trajectories/point_cloud.hpp"
#include "services/lab/trajectories/recorded_bodies.hpp"
#include "services/lab/trajectories/trajectory.hpp"
#include "services/tool/print_error.hpp"

namespace tandem::lab {
namespace {

using recording::Playback;
using Step = Playback::Step;

/// A playback whose errors name the file.
class Reader {
 public:
  /// Opens the recording at its first run.
  static Result<Reader> open(const std::string& path) {
    auto playback = Playback::open(path);
    if (!playback) return tl::unexpected(playback.error());
    Reader reader(path, std::move(*playback));
    const auto step = reader.next();
    if (!step) return tl::unexpected(step.error());
    if (*step == Step::kEnd) return fail(ErrorCode::kMalformed, path + ": it " + Playback::kNothingToPlay);
    return reader;
  }
  [[nodiscard]] Result<Step> next() {
    auto step = playback_->next();
    if (std::string now = playback_->left_out(); now != left_out_) tell(left_out_ = std::move(now));
    if (!step) return fail(step.error().code, path_ + ": " + step.error().message);
    return step;
  }
  [[nodiscard]] const Playback& playback() const { return *playback_; }
  [[nodiscard]] const ClientTimeline& timeline() const { return playback_->timeline(); }
  [[nodiscard]] const State& state() const { return timeline().state(timeline().applied()); }
  void tell(const std::string& what) const {
    tool::print_error(fmt::format("tandem export: {} {}\n", path_, what));
  }

 private:
  Reader(std::string path, std::unique_ptr<Playback> playback)
      : path_(std::move(path)), playback_(std::move(playback)) {}
  std::string path_;
  std::unique_ptr<Playback> playback_;
  std::string left_out_;  // what has been told
};

Result<void> write_whole(const std::string& path, const std::string& text) {
  auto file = recording::OutputFile::create(path, recording::Existing::kReplaced);
  if (!file) return tl::unexpected(file.error());
  return file->write(std::as_bytes(std::span(text))).and_then([&file] { return file->commit(); });
}

engine::Shape shape_of(const transport::BodyType& type) {
  if (type.shape == transport::Shape::kNone || type.shape == transport::Shape::kSphere)
    return {engine::Shape::Kind::kSphere, type.radius, {}};
  return {static_cast<engine::Shape::Kind>(type.shape), 0, type.shape_values};
}

/// The radius of the smallest body, if the session says it; otherwise 0.
double smallest_radius(const transport::SessionMessage& session) {
  double smallest = 0;
  for (const transport::BodyType& type : session.types) {
    const auto radius = static_cast<double>(type.radius);
    if (radius > 0 && (smallest == 0 || radius < smallest)) smallest = radius;
  }
  return smallest;
}

/// Empty if one of them is unknown.
std::vector<engine::Shape> shapes_of(const transport::SessionMessage& session) {
  std::vector<engine::Shape> shapes;
  for (const transport::BodyType& type : session.types) {
    shapes.push_back(shape_of(type));
    if (!engine::check(shapes.back())) return {};
  }
  return shapes;
}

std::string scene_path(const std::string& sidecar) {
  return std::filesystem::path(sidecar).replace_extension(".scene.textproto").string();
}

}  // namespace

Result<void> check_trajectory_free(const std::string& npy) {
  const auto sidecar = sidecar_path(npy);
  if (!sidecar) return tl::unexpected(sidecar.error());
  for (const std::string& output : {npy, *sidecar, scene_path(*sidecar)}) {
    if (auto free = recording::check_free(output); !free) return free;
  }
  return {};
}

Result<void> export_states(const std::string& recording, const std::string& npy,
                           const std::atomic<bool>& stop) {
  const auto sidecar = sidecar_path(npy);
  if (!sidecar) return tl::unexpected(sidecar.error());
  for (const std::string& output : {npy, *sidecar}) {
    if (auto distinct = recording::check_distinct(recording, output); !distinct) return distinct;
  }
  auto reader = Reader::open(recording);
  if (!reader) return tl::unexpected(reader.error());
  const transport::SessionMessage session = reader->playback().session();
  const bool turning = reader->state().groups().orientation;
  auto writer = TrajectoryWriter::create(npy, session.capacity, turning ? kRigidChannels : kPointChannels);
  if (!writer) return tl::unexpected(writer.error());

  TrajectoryInfo info;
  info.dt_s = session.dt_s;
  info.threshold = reader->timeline().parameters().codec.threshold * session.lattice_unit;
  info.radius = smallest_radius(session);
  // For a session without a scene file the announcement has to suffice.
  const auto scene = scenes::parse_scene(session.scene_json, session.scene);
  const std::filesystem::path scene_file = scene_path(*sidecar);
  if (scene) {
    info.radius = scene->smallest_radius_m;
    info.scene = scene_file.filename().string();
  }
  if (!(info.radius > 0)) info.radius = info.threshold;
  if (turning) info.shapes = shapes_of(session);
  if (!info.shapes.empty()) info.shape_of.resize(session.capacity);
  RecordedBodies recorded(session.lattice_unit, info.dt_s);
  info.damping_per_s = recorded.damping_per_s(reader->timeline().drive());

  Step step = Step::kStarted;
  do {
    if (stop) return stopped();
    info.gravity.push_back(recorded.gravity(reader->timeline().drive()));
    const engine::Bodies bodies = recorded.of(reader->state());
    // The last that lived in a slot.
    for (std::size_t slot = 0; slot < info.shape_of.size(); ++slot) {
      if (bodies.alive[slot] != 0) info.shape_of[slot] = bodies.type[slot];
    }
    if (auto appended = writer->append(bodies); !appended) return appended;
    const auto next = reader->next();
    if (!next) return tl::unexpected(next.error());
    step = *next;
  } while (step == Step::kFrame);
  if (info.gravity.size() < 2)
    return fail(ErrorCode::kMalformed, recording + ": no frame follows its first snapshot");
  if (step == Step::kStarted) {
    reader->tell(fmt::format("has a gap or another server at {:.1f} s; exported up to there",
                             reader->playback().time_s()));
  }
  if (scene) {
    if (auto written = write_whole(scene_file.string(), scene->text); !written) return written;
  }
  return writer->finish(info);
}

Result<void> export_points(const std::string& recording, const std::string& mcap, std::uint32_t every,
                           const std::atomic<bool>& stop) {
  if (auto distinct = recording::check_distinct(recording, mcap); !distinct) return distinct;
  auto reader = Reader::open(recording);
  if (!reader) return tl::unexpected(reader.error());
  auto file = recording::OutputFile::create(mcap, recording::Existing::kReplaced);
  if (!file) return tl::unexpected(file.error());
  constexpr const char* kTopic = "/bodies";
  recording::McapWriter writer([&file](std::span<const std::byte> bytes) { return file->write(bytes); },
                               recording::Compression::kZstd);
  writer.declare(point_cloud_kind(kTopic));
  for (Step step = Step::kStarted; step != Step::kEnd;) {
    if (stop) return stopped();
    if (step == Step::kStarted || reader->timeline().applied() % every == 0) {
      const transport::SessionMessage& session = reader->playback().session();
      const std::uint64_t time_ns = reader->playback().time_ns();
      RecordedBodies recorded(session.lattice_unit, session.dt_s);
      const std::string cloud = point_cloud(recorded.of(reader->state()), session.types, time_ns);
      const auto wall_ns = static_cast<std::int64_t>(time_ns);
      writer.add(kTopic, std::as_bytes(std::span(cloud)), wall_ns, wall_ns);
      if (!writer.written()) return writer.written();
    }
    const auto next = reader->next();
    if (!next) return tl::unexpected(next.error());
    step = *next;
  }
  return writer.finish().and_then([&file] { return file->commit(); });
}

}  // namespace tandem::lab
