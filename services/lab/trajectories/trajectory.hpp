#pragma once
// Recorded trajectories: X.npy, float32 [frames + 1][bodies][6] (position, velocity) or [13] (then
// orientation w x y z, angular velocity), row 0 is the start; and X.json.

#include <cstdint>
#include <fstream>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "services/engines/common/shape.hpp"
#include "services/follow/recording/output_file.hpp"
#include "tandem/result.hpp"
#include "tandem/simulation.hpp"

namespace tandem::lab {

/// The end of `tandem export --help`, for people who write a trajectory.
inline constexpr const char* kTrajectoryFormat =
    "X.npy: little-endian float32 as numpy saves it, in any unit of length, and seconds. Row 0 is the "
    "start.\n"
    "A body has 6 columns, position and velocity, or 13: then also the quaternion w, x, y, z (the SDK uses\n"
    "x, y, z, w) from body to world with norm 1 within 0.001, and the angular velocity in the world's "
    "frame,\n"
    "rad / s, at most 2 rad per row.\n"
    "X.json: an object with\n"
    "  dt_s           seconds between rows\n"
    "  damping_per_s  share of its velocity that a free body loses in a second, 0 for none\n"
    "  radius         the radius of the smallest body; with 13 columns and no shapes, that of the sphere "
    "around\n"
    "                 every body; or a list of the radii of the spheres around each body\n"
    "  shapes         optional: a list of objects with \"shape\" (sphere, box, capsule, cylinder, hull) and "
    "\"values\"\n"
    "                 (a sphere's radius; half sizes x, y, z; radius and half length along y; points x, y, "
    "z)\n"
    "  shape_of       needed with shapes: for each body its place in that list, from 0\n"
    "  threshold      error that a codec may leave, of a position or, with 13 columns, of a surface\n"
    "  gravity        [x, y, z] for each row: the gravity in the step that leads to it\n"
    "  scene          optional: a scene's name, or the path of a .textproto from the folder of X.json. The\n"
    "                 predictors field, contact and hard use its first body type, pair, wall, substeps,\n"
    "                 planes, boxes and spheres; without a scene, only ballistic is possible.\n"
    "Any program may write the two files; `tandem bench bandwidth --trajectory X.npy` measures them.";

/// X.json: what the numbers alone do not say. Scene units and seconds.
struct TrajectoryInfo {
  double dt_s = 0;           ///< > 0
  double damping_per_s = 0;  ///< >= 0
  double radius = 0;         ///< > 0, of the smallest body
  double threshold = 0;      ///< > 0, the error that a codec may leave
  /// gravity[f] is in force in the step that produces frame f; gravity[0] is what holds at the start.
  std::vector<engine::Vec3> gravity;
  /// Scene that tells radius, materials and walls, for predictors that need them: a name, or the path of a
  /// .textproto. Empty: none. In the file a relative path starts at the file's folder.
  std::string scene;
  /// The shapes of bodies, at most 4,096. If the file has a list of radii, there is a sphere for each radius.
  /// Empty: unknown.
  std::vector<engine::Shape> shapes;
  std::vector<std::uint16_t> shape_of;  ///< by body, with shapes
};

/// Columns of a body.
inline constexpr std::size_t kPointChannels = 6;
inline constexpr std::size_t kRigidChannels = 13;

/// The name of the sidecar that belongs to a .npy file. Errors: kInvalidArgument when `npy` does not end in
/// .npy.
[[nodiscard]] Result<std::string> sidecar_path(const std::string& npy);

/// Writes a pair frame by frame; both files appear complete or not at all.
class TrajectoryWriter {
 public:
  /// `channels`: kPointChannels, or kRigidChannels for bodies with orientation. Errors: kInvalidArgument
  /// (name does not end in .npy), kIo.
  static Result<TrajectoryWriter> create(const std::string& npy, std::uint32_t bodies,
                                         std::size_t channels = kPointChannels);
  /// Adds the next row. A dead body's row is zero, and not turned. Errors: kIo.
  Result<void> append(const engine::Bodies& bodies);
  /// `info.gravity` has one entry a row. Errors: kIo.
  Result<void> finish(const TrajectoryInfo& info);

 private:
  TrajectoryWriter(recording::OutputFile npy, recording::OutputFile sidecar, std::uint32_t bodies,
                   std::size_t channels);
  recording::OutputFile npy_, sidecar_;
  std::uint32_t bodies_;
  std::size_t channels_;
  std::uint64_t rows_ = 0;
  std::vector<float> row_;
};

/// A recorded trajectory in the place of an engine: step() reads the next row. Every input is refused.
class RecordedTrajectory final : public engine::Simulation {
 public:
  /// Checks both files as a whole. Errors: kIo, kMalformed; each names the file, what was found and what was
  /// expected.
  static Result<std::unique_ptr<RecordedTrajectory>> open(const std::string& npy);

  [[nodiscard]] std::uint64_t frames() const { return rows_ - 1; }
  [[nodiscard]] const TrajectoryInfo& info() const { return info_; }
  /// Largest absolute position coordinate of all rows.
  [[nodiscard]] double position_bound() const { return position_bound_; }

  [[nodiscard]] std::uint32_t capacity() const override { return bodies_; }
  [[nodiscard]] double dt_s() const override { return info_.dt_s; }
  [[nodiscard]] engine::Vec3 gravity() const override;
  [[nodiscard]] double damping_per_s() const override { return info_.damping_per_s; }
  /// Precondition: fewer than frames() steps were made.
  void step() override;
  [[nodiscard]] engine::Bodies bodies() const override;

 private:
  RecordedTrajectory() = default;
  Result<void> open_npy(const std::string& path);
  Result<void> check_rows();
  [[nodiscard]] Result<void> check_turning(std::uint64_t row) const;
  bool read_row(std::uint64_t row);

  std::string path_;
  std::ifstream file_;
  std::streamoff data_offset_ = 0;
  std::uint64_t rows_ = 0, row_ = 0;
  std::uint32_t bodies_ = 0;
  std::size_t channels_ = 0;
  double position_bound_ = 0;
  TrajectoryInfo info_;
  std::vector<float> interleaved_;
  std::array<std::vector<float>, kRigidChannels> columns_;  // as in the file
  std::vector<std::uint8_t> alive_;
  std::vector<std::uint16_t> type_;
};

}  // namespace tandem::lab
