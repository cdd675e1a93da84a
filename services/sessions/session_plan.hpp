#pragma once
// From a scene to a session: lattice, codec with its tables, and what clients are told about the scene.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "services/host/host.hpp"
#include "services/scenes/scene.hpp"
#include "tandem/result.hpp"

namespace tandem::sessions {

/// Below, a frame has hardly room for one body.
inline constexpr std::size_t kLeastBudgetBytes = 64;
/// As a predictor's name: the first of predictors() that suits codec, bodies and scene.
inline constexpr std::string_view kAutomaticPredictor = "auto";

/// What an operator chooses for one of several streams; what is empty comes from the session's choice, where
/// the codec has a use for it.
struct StreamChoice {
  std::string name = {};  ///< see host::check_stream_names()
  std::optional<std::string> codec = {}, predictor = {};
  std::optional<double> threshold_m = {};        ///< and no automatic quality
  std::optional<double> target_mbit_per_s = {};  ///< and automatic quality
  std::optional<double> max_error_m = {};        ///< with automatic quality
  std::optional<std::size_t> budget_bytes = {};
};

/// What an operator chooses on top of the scene.
struct SessionChoice {
  std::uint32_t bodies = 0;
  std::string codec = "tracker";
  std::string predictor{kAutomaticPredictor};
  std::optional<double> threshold_m;  ///< empty: the scene's, times threshold_scale
  double threshold_scale = 1;
  bool automatic = false;        ///< quality follows the scene at run time, from a quarter of that threshold
  double target_mbit_per_s = 0;  ///< with `automatic`; 0: the threshold stays
  std::optional<double> max_error_m;  ///< with `automatic`; empty: four times the threshold
  /// Of corrections per frame, for `limited` and `tracker`, at least kLeastBudgetBytes; empty: the paper's
  /// and none.
  std::optional<std::size_t> budget_bytes;
  std::uint32_t threads = 1;               ///< of the codec, where a session has several blocks
  std::vector<StreamChoice> streams = {};  ///< empty: one without a name, as chosen above
};

/// What is chosen for one of several streams, all told.
[[nodiscard]] SessionChoice choice_of(const SessionChoice& session, const StreamChoice& stream);

/// The streams of a session where nobody chose any: where the automatic predictor is not the basic one,
/// `thin` with the basic one and `rich` with that; else none, which means one without a name. Errors: as
/// plan_stream().
[[nodiscard]] Result<std::vector<StreamChoice>> usual_streams(const scenes::Scene& scene,
                                                              const SessionChoice& choice);

/// The stream that follows from scene and choice. Where nothing was trained for this size and threshold, the
/// nearest table is used, and the built-in one for a scene that was never trained. Errors: kInvalidArgument
/// (the threshold, a world too large for it, or a body type that turns and has no radius).
[[nodiscard]] Result<host::StreamConfig> plan_stream(const scenes::Scene& scene, const SessionChoice& choice);

/// A host's configuration with the streams chosen, on the lattice of the finest threshold among them, the
/// scene's frame rate, types and names; the rest keeps its defaults. Errors: as plan_stream(), naming the
/// stream where it has a name; also kInvalidArgument for a stream that the lattice cannot hold, and as
/// host::check_stream_names().
[[nodiscard]] Result<host::HostConfig> plan_session(const scenes::Scene& scene, const SessionChoice& choice);

}  // namespace tandem::sessions
