#pragma once
// The state of a simulation of rigid bodies between two steps, except Bullet's caches.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "services/engines/bullet/inputs.hpp"
#include "services/engines/bullet/motion.hpp"
#include "tandem/simulation.hpp"

namespace tandem::engine {

/// Maximum number of inputs in a step, more than a session lets its clients send; others are dropped.
inline constexpr std::size_t kMaxWaiting = 4096;

/// An input that waits for the next step, in the order of arrival.
struct WaitingInput {
  enum class Kind : std::uint32_t { kPush, kSpawn, kRemove };
  Kind kind = Kind::kPush;
  std::uint32_t type = 0;  ///< kSpawn
  Motion motion;           ///< kSpawn; for other kinds, position is the centre and velocity the change
  float radius = 0;        ///< kPush, kRemove
};

struct RigidColumns {
  explicit RigidColumns(std::uint32_t capacity)
      : alive(capacity), activity(capacity), type(capacity), still_s(capacity) {
    for (auto& column : position) column.resize(capacity);
    for (auto& column : velocity) column.resize(capacity);
    for (auto& column : orientation) column.resize(capacity);
    for (auto& column : angular_velocity) column.resize(capacity);
  }

  [[nodiscard]] Motion motion(std::uint32_t slot) const;
  void set_motion(std::uint32_t slot, const Motion& motion);

  // By slot.
  std::array<std::vector<float>, 3> position, velocity;
  std::array<std::vector<float>, 4> orientation;
  std::array<std::vector<float>, 3> angular_velocity;
  std::vector<std::uint8_t> alive;
  std::vector<std::uint8_t> activity;  ///< Bullet's activation state
  std::vector<std::uint16_t> type;
  std::vector<float> still_s;  ///< for how long a body has been slow enough to fall asleep

  Vec3 gravity{};
  Mishaps mishaps;
  std::vector<WaitingInput> waiting;
};

[[nodiscard]] std::uint64_t fingerprint(const RigidWorld& world);

/// Appends a checkpoint: little-endian machine layout, a fingerprint of the world and a checksum.
void save_columns(const RigidColumns& columns, std::uint64_t world_fingerprint, std::vector<std::byte>& out);

/// Reads a checkpoint. Returns false and leaves `columns` unchanged if the bytes are damaged or of another
/// world.
[[nodiscard]] bool load_columns(std::span<const std::byte> bytes, std::uint64_t world_fingerprint,
                                RigidColumns& columns);

}  // namespace tandem::engine
