#pragma once
// The scene's world as the constants of the predictors `contact` and `field`.

#include <cstdint>
#include <string_view>
#include <vector>

#include "services/host/streams/lattice_choice.hpp"
#include "services/scenes/scene.hpp"
#include "tandem/result.hpp"

namespace tandem::sessions {

/// The integers that travel in the session. `predictor` is named in errors: kInvalidArgument for a scene
/// without body types (a recorded trajectory) or one that does not fit the lattice.
[[nodiscard]] Result<std::vector<std::int32_t>> contact_constants(const scenes::Scene& scene,
                                                                  const host::Lattice& lattice,
                                                                  std::string_view predictor);

}  // namespace tandem::sessions
