#pragma once
// From a scene to a session: lattice, codec with its tables, and what clients are told about the scene.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "services/host/host.hpp"
#include "services/scenes/scene.hpp"
#include "tandem/result.hpp"

namespace tandem::sessions {

/// Below, a frame has hardly room for one body.
inline constexpr std::size_t kLeastBudgetBytes = 64;
/// Beyond, `field` would take even a fast client most of a frame.
inline constexpr std::uint32_t kMostBodiesForField = 50'000;

/// What an operator chooses on top of the scene.
struct SessionChoice {
  std::uint32_t bodies = 0;
  std::string codec = "tracker";
  /// auto: `field` for `tracker` with at most kMostBodiesForField bodies in a scene whose types are spheres
  /// of about one size, else `ballistic`
  std::string predictor = "auto";
  std::optional<double> threshold_m;  ///< empty: the scene's, times threshold_scale
  double threshold_scale = 1;
  bool automatic = false;        ///< quality follows the scene at run time, from a quarter of that threshold
  double target_mbit_per_s = 0;  ///< with `automatic`; 0: the threshold stays
  std::optional<double> max_error_m;  ///< with `automatic`; empty: four times the threshold
  /// Of corrections per frame, for `limited` and `tracker`, at least kLeastBudgetBytes; empty: the paper's
  /// and none.
  std::optional<std::size_t> budget_bytes;
  std::uint32_t threads = 1;  ///< of the codec, where a session has several blocks
};

/// The stream that follows from scene and choice. Where nothing was trained for this size and threshold, the
/// nearest table is used, and the built-in one for a scene that was never trained. Errors: kInvalidArgument
/// (the threshold, a world too large for it, or a body type that turns and has no radius).
[[nodiscard]] Result<host::StreamConfig> plan_stream(const scenes::Scene& scene, const SessionChoice& choice);

/// A host's configuration with that stream, the scene's frame rate, types and names; the rest keeps its
/// defaults. Errors: as plan_stream().
[[nodiscard]] Result<host::HostConfig> plan_session(const scenes::Scene& scene, const SessionChoice& choice);

}  // namespace tandem::sessions
