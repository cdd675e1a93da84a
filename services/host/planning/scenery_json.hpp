#pragma once
// What bodies meet, as the JSON that clients draw.

#include <string>

#include "tandem/scenery.hpp"

namespace tandem::planning {

/// The planes, boxes and balls of `scenery` with the time that a frame simulates, as a message Scene of
/// idl/scene.proto in protobuf's JSON mapping. Empty where they are more than a session may describe.
[[nodiscard]] std::string scenery_json(const Scenery& scenery, double dt_s);

}  // namespace tandem::planning
