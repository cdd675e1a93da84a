#pragma once
// Contact forces: the hot loop of the full simulation.

#include <cstdint>
#include <span>

#include "services/engine/particles/grid.hpp"
#include "services/engine/particles/vec.hpp"
#include "services/engine/particles/world.hpp"

namespace tandem::engine {

struct Contact {
  Float3 force;
  bool touching = false;
};

/// A body looks at no more others than this, in the order of the cells around it: what keeps a step bounded
/// when everything is in one place. In a deep pile of equal spheres it has about 40 to look at.
inline constexpr std::uint32_t kMaxCandidates = 1024;

/// Forces on the sorted records [begin, end), each written to `contacts[record.slot]`.
void sum_contacts(const World& world, const Grid& grid, std::uint32_t begin, std::uint32_t end,
                  std::span<Contact> contacts);

/// Force of the static geometry on one body.
[[nodiscard]] Contact scene_contact(const World& world, const Record& body);

}  // namespace tandem::engine
