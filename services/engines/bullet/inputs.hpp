#pragma once
// Inputs of rigid bodies beyond gravity and push: bytes of kind kApplication, which any client can send.

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "services/engines/bullet/world.hpp"
#include "tandem/simulation.hpp"

namespace tandem::engine {

/// A body appears in the lowest free slot; without a free slot, nothing happens. Bytes, little-endian: u8 1,
/// u8 0, u16 type, then float32 position x, y, z, velocity x, y, z, orientation x, y, z, w, angular velocity
/// x, y, z; 56 in all.
struct Spawn {
  std::uint16_t type = 0;
  Vec3f position{};
  Vec3f velocity{};
  Quaternion orientation{0, 0, 0, 1};
  Vec3f angular_velocity{};  ///< rad / s
};

/// Bodies whose centre is within `radius` of `centre` disappear. Bytes, little-endian: u8 2, three bytes 0,
/// then float32 centre x, y, z, radius; 20 in all.
struct Remove {
  Vec3f centre{};
  float radius = 0;
};

[[nodiscard]] Input to_input(const Spawn& spawn);
[[nodiscard]] Input to_input(const Remove& remove);

/// Reads the bytes of a kApplication input; both functions return nothing for other bytes. Values are not
/// checked.
[[nodiscard]] std::optional<Spawn> spawn_of(std::span<const std::byte> bytes);
[[nodiscard]] std::optional<Remove> remove_of(std::span<const std::byte> bytes);

}  // namespace tandem::engine
