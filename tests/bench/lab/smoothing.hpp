#pragma once
// Measures for `bench_lab smoothing` how visible corrections are, with and without smoothing.

#include <cstdint>
#include <string>

#include "services/engines/scenes/scene.hpp"
#include "services/engines/sessions/session_plan.hpp"
#include "tandem/result.hpp"

namespace tandem::lab {

/// One session in simulated time, watched by two clients at the same moments.
struct SmoothingSetup {
  sessions::SessionChoice choice;
  std::uint64_t seed = 1;  ///< of the scene, its users and the network
  double seconds = 10;     ///< after the first second, which is left out
  double rate_hz = 144;    ///< of samples
  double smoothing_s = -1;
  double delay_ms = 5, jitter_ms = 3;  ///< of the network, each way
  double outage_s = 0;                 ///< the link is cut for this time every five seconds
};

/// Statistics of the places that one of the clients showed, over all bodies and samples, in scene units.
struct Seen {
  /// 99.9th percentile of the second difference of the place shown (its length), less that of the true motion
  /// at the same moments. Bodies that are new or jumped are left out.
  double jump = 0;
  double mean_error = 0;  ///< between the place shown and the true one at that moment
  double p999_error = 0;
};

struct SmoothingRow {
  std::string scene, predictor, codec;
  std::uint32_t bodies = 0;
  double threshold = 0;  ///< scene units
  std::uint64_t samples = 0;
  Seen smoothed = {}, unsmoothed = {};
};

/// The true motion is the full simulation's, places interpolated between its frames. Errors: what the scene
/// or the host refuse; kTimeout when the clients never play.
[[nodiscard]] Result<SmoothingRow> measure_smoothing(const scenes::Scene& scene, const SmoothingSetup& setup);

}  // namespace tandem::lab
