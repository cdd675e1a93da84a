#pragma once
// The measurement of `tandem bench bandwidth`: several codecs over the same trajectory, without a network.

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sdk/core/tables/codec_table.hpp"
#include "sdk/core/timeline/timeline.hpp"
#include "services/host/streams/stream.hpp"
#include "services/lab/measures/replay.hpp"
#include "tandem/result.hpp"

namespace tandem::lab {

/// One row of the result: a scene, a size and a codec. Times are medians over the frames.
struct BandwidthRow {
  std::string scene;
  std::optional<int> number;  ///< number of the thesis's scene, 1..5
  std::uint32_t bodies = 0;
  std::string codec, predictor;
  CodecTraits traits;           ///< peers have none
  StreamParameters parameters;  ///< at the end
  std::uint32_t threads = 1;
  std::uint64_t seed = 0;
  std::uint64_t frames = 0;
  double dt_s = 0;                         ///< a frame
  double threshold = 0;                    ///< scene units; if automatic, the last one
  double lattice_unit = 0;                 ///< scene units; the error may reach threshold and one of these
  double mbit_per_s = 0;                   ///< payload only, at the nominal rate; 2^20 bits to the Mbit
  double wire_mbit_per_s = 0;              ///< what one observer takes on the network, with all headers
  std::optional<double> ideal_mbit_per_s;  ///< code length of adaptive models, without rounding and headers
  std::optional<double> bound_mbit_per_s;  ///< their decisions at the best fixed probability of each context
  double max_error = 0, rms_error = 0;     ///< scene units; agreed state against the simulation's floats
  /// Scene units. The error on the sphere around each body is |dp| + 2 r sin(a / 2), where a is the angle by
  /// which its orientation is off. The threshold limits it in sessions with orientations; others have none.
  std::optional<double> max_surface_error, rms_surface_error;
  double max_snap = 0, rms_snap = 0;          ///< scene units; how far a correction moves a body at once
  double corrected_per_frame = 0;             ///< bodies
  double at_rest_per_frame = 0;               ///< bodies
  double snapshot_bytes_per_body = 0;         ///< size of a snapshot one frame later, per living body
  std::optional<double> colliding_per_frame;  ///< bodies; not known for recorded trajectories
  double step_ms = 0, predict_ms = 0, encode_ms = 0, decode_ms = 0, apply_ms = 0;
  std::string missing;                   ///< the Debian package for want of which nothing was measured
  std::vector<std::uint32_t> bytes;      ///< payload of each frame
  std::vector<std::uint32_t> colliding;  ///< bodies in contact in each frame
};

/// Runs `replay` for `frames` frames. Each of `streams`, which share the replay's lattice, produces every
/// frame as a host's would, and a client's timeline decodes it and checks the hash. Fills the measured fields
/// of a row per stream; `progress` gets the frame. Errors: what the streams and the replay refuse; kMismatch
/// when a client's state ever differs. With a `peer_threshold` (scene units) rows of all peers follow, at
/// that largest error on the same frames.
[[nodiscard]] Result<std::vector<BandwidthRow>> measure_bandwidth(Replay& replay,
                                                                  std::span<const host::StreamConfig> streams,
                                                                  std::uint64_t frames,
                                                                  const std::function<void(Frame)>& progress,
                                                                  std::optional<double> peer_threshold = {});

}  // namespace tandem::lab
