#pragma once
// What a measurement runs on: a scene or a recorded trajectory, and the session a server would make of it.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "services/engine/simulation.hpp"
#include "services/scenes/scene.hpp"
#include "services/tool/bandwidth.hpp"
#include "services/tool/replay.hpp"
#include "tandem/result.hpp"

namespace tandem::tool {

/// How a scene is run. Zero `users`: as many as the scene says.
struct SceneRun {
  std::uint32_t bodies = 0;
  std::uint64_t seed = 1;
  std::uint32_t threads = 1;
  std::uint32_t users = 0;
  std::uint64_t frames = 0;
};

/// The error threshold: of the scene or trajectory, unless the command line says otherwise.
struct ThresholdChoice {
  std::optional<double> length;  ///< scene units
  double scale = 1;              ///< of the scene's own
  [[nodiscard]] double of(double own) const { return length ? *length : own * scale; }
};

/// A simulation with its scripted inputs and its lattice.
struct Source {
  std::unique_ptr<engine::Simulation> simulation;
  std::vector<TimedInput> script;
  server::Lattice lattice;
  double threshold = 0;  ///< scene units
  TypeId type_count = 1;
};

/// Errors: what the scene loader and the lattice refuse.
[[nodiscard]] Result<Source> make_source(const scenes::Scene& scene, const SceneRun& run,
                                         const ThresholdChoice& threshold);

/// The trained table for this size and threshold; where there is none, the one whose threshold, then whose
/// size is nearest by ratio; empty for a scene that was never trained.
[[nodiscard]] scenes::TrainedTable table_for(const scenes::Scene& scene, std::uint32_t bodies,
                                             double threshold);

/// A timeline as a session on this source has it, without a codec; `table` gives the quantisation ranges.
[[nodiscard]] Result<BandwidthRun> make_run(const Source& source, const scenes::TrainedTable& table,
                                            const std::string& predictor, std::uint64_t frames);

/// Codec by name, with its tables (the built-in ones where `table` has none) and the budget of `limited`.
[[nodiscard]] CodecSetup make_codec_setup(const std::string& name, const scenes::TrainedTable& table,
                                          std::size_t limited_budget_bytes);

}  // namespace tandem::tool
