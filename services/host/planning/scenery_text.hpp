#pragma once
// What bodies meet, as the text that clients draw.

#include <string>

#include "tandem/scenery.hpp"

namespace tandem::planning {

/// The planes, boxes and balls of `scenery` as protobuf text of idl/scene.proto, with the time that a frame
/// simulates. Empty where they are more than a session may describe.
[[nodiscard]] std::string scenery_text(const Scenery& scenery, double dt_s);

}  // namespace tandem::planning
