#include "services/host/streams/groups.hpp"

#include <fmt/format.h>

#include <cmath>

namespace tandem::host {

Result<void> choose_groups(bool turns, std::span<const BodySize> types, const Lattice& lattice,
                           const CodecTraits& traits, Layout& layout) {
  layout.groups = {kPositionGroup};
  layout.radii.clear();
  if (!turns || !traits.turns) return {};
  layout.groups.emplace_back(kOrientationGroup);
  for (const BodySize& type : types) {
    const double units = std::ceil(type.radius * lattice.position_scale());
    if (!(units >= 1 && units <= double{kPositionLimit})) {
      return fail(
          ErrorCode::kInvalidArgument,
          fmt::format("body type '{}': bodies that turn need a radius above 0 and within the extent, not {}",
                      type.name, type.radius));
    }
    layout.radii.push_back(static_cast<std::int32_t>(units));
  }
  return {};
}

}  // namespace tandem::host
