#pragma once
// Contact forces: the hot loop of the full simulation.

#include <cstdint>
#include <span>

#include "services/engine/common/world.hpp"
#include "services/engine/particles/grid.hpp"
#include "services/engine/particles/vec.hpp"

namespace tandem::engine {

struct Contact {
  Float3 force;
  bool touching = false;
};

/// Forces on the sorted records [begin, end), into `sums` by their place there. A pair within the range is
/// computed once, a pair across its border by both sides; either way a body's forces are added in the order
/// scene, then partners by ascending place, so the division into ranges changes no bit. Writes only to its
/// own range of `sums`.
void sum_contacts(const World& world, const Grid& grid, std::uint32_t begin, std::uint32_t end,
                  std::span<Contact> sums);

/// Force of the static geometry on one body.
[[nodiscard]] Contact scene_contact(const World& world, const Record& body);

}  // namespace tandem::engine
