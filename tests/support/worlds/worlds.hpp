#pragma once
// Ordinary and extreme small worlds for every predictor. All machines must step them to the same bits.

#include <string>
#include <string_view>
#include <vector>

#include "sdk/core/layout/layout.hpp"
#include "sdk/core/predict/predictor.hpp"

namespace tandem::worlds {

struct World {
  std::string name;
  Layout layout;  ///< of a stream with the predictor
  State start;
  Drive drive;
};

/// The same at every call. With orientations if `turns`, which `rigid` needs.
[[nodiscard]] std::vector<World> worlds_for(std::string_view predictor, bool turns);

/// All worlds of every predictor.
[[nodiscard]] std::vector<World> all_worlds();

/// The input of a step of the world; some frames later gravity points elsewhere.
[[nodiscard]] StepInput input_at(const World& world, Frame frame);

/// Frames for which a world is worth stepping.
inline constexpr Frame kFrames = 40;

}  // namespace tandem::worlds
