#pragma once
// The state of a particle simulation between two steps.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "services/engines/common/world.hpp"
#include "services/engines/particles/vec.hpp"
#include "tandem/simulation.hpp"

namespace tandem::engine {

/// A change of velocity that waits for the next step.
struct Push {
  Vec3f centre{};
  float radius = 0;
  Vec3f velocity{};
};

/// Maximum number of pushes in a step, more than a session lets its clients send; others are dropped.
inline constexpr std::size_t kMaxPushes = 4096;

struct Columns {
  explicit Columns(std::uint32_t capacity)
      : alive(capacity), type(capacity), moved((capacity + kMovedSlots - 1) / kMovedSlots, 1) {
    for (auto& column : position) column.resize(capacity);
    for (auto& column : velocity) column.resize(capacity);
  }

  // By slot.
  std::array<std::vector<float>, 3> position, velocity;
  std::vector<std::uint8_t> alive;
  std::vector<std::uint16_t> type;

  std::vector<std::uint8_t> moved;  ///< Simulation::moved()

  std::uint64_t frame = 0;
  std::uint64_t spawned = 0;  ///< bodies that emitters made or left out; counts their random numbers
  Vec3 gravity{};
  std::vector<double> due;  ///< by emitter: the share of a body that waits for the next step
  std::vector<Push> pushes;
};

/// What a Pile keeps from step to step, by place, except what `columns` have.
struct PileImage {
  std::vector<std::uint32_t> slot;           ///< UINT32_MAX where no body is
  std::array<std::vector<float>, 3> anchor;  ///< where the body was when its list was made
  std::array<std::vector<float>, 3> force;   ///< the force accumulator of the thesis: acts in the next step
  std::vector<std::uint8_t> state;           ///< Pile::state_
  Vec3 felt_gravity{};
  float skin = 0, sleep_speed = 0;
  Vec3f drift{}, mean_velocity{};
  std::uint8_t sorted = 0, crowded = 0;
};

struct Checkpoint {
  explicit Checkpoint(std::uint32_t capacity) : columns(capacity) {}
  Columns columns;
  PileImage image;
};

/// Appends a checkpoint: little-endian machine layout, a fingerprint of the world and a checksum.
void save_checkpoint(const Columns& columns, const PileImage& image, std::uint64_t world_fingerprint,
                     std::vector<std::byte>& out);

/// Reads a checkpoint of a world with `emitters` emitters. Returns false if the bytes are damaged or of
/// another world; `out` may then hold anything.
[[nodiscard]] bool load_checkpoint(std::span<const std::byte> bytes, std::uint64_t world_fingerprint,
                                   std::size_t emitters, Checkpoint& out);

}  // namespace tandem::engine
