#pragma once
// Exports a recording of a session for other tools, as a trajectory or as point clouds.

#include <atomic>
#include <cstdint>
#include <string>

#include "tandem/result.hpp"

namespace tandem::lab {

/// The end of `tandem export --help`, for people who read the files.
inline constexpr const char* kRecordingFormat =
    "With --from, row 0 is the recording's first snapshot, and each slot is a body. An empty slot is all "
    "zeros\n"
    "(w of a quaternion 1), which a reader cannot tell from a body at the origin. dt_s and radius come from "
    "the\n"
    "recorded scene, which becomes X.scene.textproto, and \"scene\" names that file. Without a recorded "
    "scene\n"
    "there is no \"scene\", dt_s is 1 / the frame rate, and radius is that of the sphere around the smallest "
    "body,\n"
    "or the threshold. damping_per_s and threshold are those of row 0; gravity is as the inputs changed it. "
    "The\n"
    "states end where the recording has a gap, where another server began, or where the file is cut short.\n"
    "--points writes messages foxglove.PointCloud (JSON) of topic /bodies for the whole recording, at the "
    "times\n"
    "it was recorded: for each body, by slot, x, y, z, radius, red, green, blue, alpha, type.";

/// For an export that nobody breaks off.
inline const std::atomic<bool> no_stop{false};

/// The message of an export that was told to stop. It leaves no file behind.
[[nodiscard]] inline tl::unexpected<Error> stopped() {
  return fail(ErrorCode::kIo, "stopped by a signal before its end; no file was written");
}

/// Errors: kInvalidArgument (`npy` does not end in .npy); kConflict, if one of the files that a trajectory
/// becomes is there.
[[nodiscard]] Result<void> check_trajectory_free(const std::string& npy);

/// The agreed states of the recording's first run as a pair X.npy and X.json: a row for the start and one for
/// each frame. Where the recorded scene can be loaded, it becomes X.scene.textproto, and X.json names it.
/// Says on stderr where more follows, and where the file is cut short. Errors: kInvalidArgument (`npy` does
/// not end in .npy), kIo (also: `stop` was set), kConflict, kMalformed, kUnsupported, kMismatch.
[[nodiscard]] Result<void> export_states(const std::string& recording, const std::string& npy,
                                         const std::atomic<bool>& stop = no_stop);

/// All runs as messages foxglove.PointCloud (point_cloud.hpp) of topic /bodies in an MCAP file: of the first
/// frame of a run, and of each that `every` divides. Log times are those of the recording. Errors: as above.
[[nodiscard]] Result<void> export_points(const std::string& recording, const std::string& mcap,
                                         std::uint32_t every, const std::atomic<bool>& stop = no_stop);

}  // namespace tandem::lab
