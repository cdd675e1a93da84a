#pragma once
// Turns a world into the constants of the predictors that compute contacts.

#include "sdk/core/tables/predictor_table.hpp"
#include "services/host/planning/world.hpp"
#include "services/host/streams/stream.hpp"
#include "tandem/result.hpp"

namespace tandem::planning {

/// Sets a predictor that reads the world, and its constants, for the stream's lattice. Errors name the
/// predictor: kInvalidArgument for a world without scenery or body types, or with scenery that is no
/// geometry; kCapacity for one that does not fit the lattice, or whose step would take too long.
[[nodiscard]] Result<void> set_contact(const PlannedWorld& world, const PredictorTraits& predictor,
                                       host::StreamConfig& stream);

}  // namespace tandem::planning
