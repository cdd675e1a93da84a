#pragma once
// Checks the rules for a scene file that its schema does not express. Internal to scenes.

#include <scene.pb.h>

#include "services/engines/scenes/text_file.hpp"

namespace tandem::scenes {

/// Notes in `root`'s findings the first rule that `scene` breaks.
void check_scene(const Node& root, const idl::Scene& scene);
/// The rules of one input event.
void check_event(const Node& node, const idl::InputEvent& event);

/// 0xRRGGBBAA of "#RRGGBB"; false for anything else. Empty means grey.
[[nodiscard]] bool read_colour(const std::string& text, std::uint32_t& rgba);

}  // namespace tandem::scenes
