#include "services/sessions/group_plan.hpp"

#include <fmt/format.h>

#include <cmath>
#include <vector>

namespace tandem::sessions {

Result<void> choose_groups(const scenes::Scene& scene, const host::Lattice& lattice,
                           const CodecTraits& traits, Layout& layout) {
  layout.groups = {kPositionGroup};
  layout.radii.clear();
  if (!scene.turns || !traits.turns) return {};
  layout.groups.emplace_back(kOrientationGroup);
  for (const scenes::BodyType& type : scene.types) {
    const double units = std::ceil(type.bounding_radius_m * lattice.position_scale());
    if (!(units >= 1 && units <= double{kPositionLimit})) {
      return fail(
          ErrorCode::kInvalidArgument,
          fmt::format("body type '{}': orientations need a radius above 0 that fits the lattice, not {}",
                      type.name, type.bounding_radius_m));
    }
    layout.radii.push_back(static_cast<std::int32_t>(units));
  }
  return {};
}

}  // namespace tandem::sessions
