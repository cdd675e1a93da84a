#pragma once
// Turns a world into the constants of the predictors that compute contacts.

#include <cstdint>
#include <string_view>
#include <vector>

#include "services/host/streams/lattice_choice.hpp"
#include "services/planning/world.hpp"
#include "tandem/result.hpp"

namespace tandem::planning {

/// The integers that travel in the session. Errors name `predictor`: kInvalidArgument for a world
/// without scenery or body types, or with scenery that is no geometry; kCapacity for one that does not fit
/// the lattice.
[[nodiscard]] Result<std::vector<std::int32_t>> contact_constants(const World& world,
                                                                  const host::Lattice& lattice,
                                                                  std::string_view predictor);

}  // namespace tandem::planning
