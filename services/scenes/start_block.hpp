#pragma once

#include <cstdint>
#include <vector>

#include "services/scenes/scene.hpp"

namespace tandem::scenes {

/// The bodies of the scene's start block, layer by layer from its base.
[[nodiscard]] std::vector<engine::StartBody> fill_block(const Scene& scene, std::uint32_t bodies,
                                                        std::uint64_t seed);

}  // namespace tandem::scenes
