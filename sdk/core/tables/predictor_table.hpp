#pragma once
// The table of predictors: all that anybody has to know of one by its name.

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sdk/core/layout/tracker_kind.hpp"
#include "sdk/core/predict/predictor.hpp"
#include "tandem/result.hpp"

namespace tandem {

/// Decay and gains of the first frame, as in StreamParameters; they suit most scenes.
struct FirstGains {
  std::uint16_t decay = 0, beta = 0, gamma = 0;
};

/// Mean cosines, see GainEvidence, at which bits are fewest, in 1/100. Not 0, as corrections come late, when
/// a body is beyond the threshold, or early, where the encoder likes to be.
struct GainAim {
  std::int32_t agreement = 25;
  std::int32_t forwardness = 20;
};

/// A new predictor is a line of predictor_table.cpp, and a folder with its step.
struct PredictorTraits {
  std::string_view name;
  /// `--predictor auto` chooses this predictor for worlds with at most this many bodies; 0: never. Where
  /// `only_spheres` is set, they must be spheres of about one size: others cost it more than it gains.
  std::uint32_t most_bodies = 0;
  bool only_spheres = false;
  /// Its constants are the world's geometry and materials (ContactConstants); otherwise it has none.
  bool reads_world = false;
  TrackerKind tracker;
  FirstGains first_gains;
  GainAim gain_aim;
  /// As make_predictor(), of which `capacity` was checked.
  Result<std::unique_ptr<Predictor>> (*make)(std::uint32_t capacity, std::span<const std::int32_t> constants);
};

/// Those that this build knows, from the one with the fewest bits where it suits to the one that suits any
/// world, basic_predictor().
[[nodiscard]] std::span<const PredictorTraits> predictors();

/// The last of predictors().
[[nodiscard]] const PredictorTraits& basic_predictor();

/// The names of predictors(), the basic one first.
[[nodiscard]] std::vector<std::string> predictor_names();

/// By name. Errors: kUnsupported, naming those that there are.
[[nodiscard]] Result<const PredictorTraits*> find_predictor(std::string_view name);

/// Makes the predictor a session names, with the constants the session carries.
/// Errors: kUnsupported for a name this build does not know, kMalformed for constants that do not fit it.
[[nodiscard]] Result<std::unique_ptr<Predictor>> make_predictor(std::string_view name, std::uint32_t capacity,
                                                                std::span<const std::int32_t> constants);

}  // namespace tandem
