#pragma once
// The places of bodies at frame 0. Internal to scenes.

#include <cstdint>
#include <vector>

#include "services/engines/scenes/scene.hpp"

namespace tandem::scenes {

/// The bodies of the scene's start block, which it has to have, layer by layer from its base.
[[nodiscard]] std::vector<engine::StartBody> fill_block(const Scene& scene, std::uint32_t bodies,
                                                        std::uint64_t seed);

/// Four walls around the start block, at half a pitch from the outermost centres.
[[nodiscard]] std::vector<engine::Plane> walls_around(const Scene& scene, std::uint32_t bodies);

/// One of `types` by their shares, from random bits; the first if none has a share.
[[nodiscard]] std::uint16_t pick_type(const std::vector<BodyType>& types, std::uint64_t random);

struct RigidStart {
  std::vector<engine::StartBody> bodies;
  std::vector<engine::Quaternion> orientation;  ///< empty: none is turned
  std::vector<engine::Vec3f> spin;              ///< empty: none spins
};

/// The bodies tower by tower, layer by layer; the last tower may be unfinished. Bodies are displaced by up to
/// a hundredth of their width, so that seeds differ.
[[nodiscard]] RigidStart fill_towers(const Scene& scene, std::uint32_t bodies, std::uint64_t seed);
/// The bodies row by row.
[[nodiscard]] RigidStart fill_rows(const Scene& scene, std::uint32_t bodies, std::uint64_t seed);
/// How the bodies of a scene with Cruising fly, and where and how they do at the start.
[[nodiscard]] engine::Cruise cruise_of(const Scene& scene, std::uint32_t bodies, std::uint64_t seed);
[[nodiscard]] RigidStart fill_ball(const Scene& scene, const engine::Cruise& cruise, std::uint32_t bodies,
                                   std::uint64_t seed);
/// `bodies` orientations, uniform over all.
[[nodiscard]] std::vector<engine::Quaternion> turn_at_random(std::uint32_t bodies, std::uint64_t seed);

}  // namespace tandem::scenes
