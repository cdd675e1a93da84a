#pragma once
// The state of a particle simulation between two steps.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "services/engine/particles/contacts.hpp"
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
  explicit Columns(std::uint32_t capacity) : alive(capacity), type(capacity), contact(capacity) {
    for (auto& column : position) column.resize(capacity);
    for (auto& column : velocity) column.resize(capacity);
  }

  // By slot.
  std::array<std::vector<float>, 3> position, velocity;
  std::vector<std::uint8_t> alive;
  std::vector<std::uint16_t> type;
  std::vector<Contact> contact;  ///< the force accumulator of the thesis: acts in the next step

  std::uint64_t frame = 0;
  std::uint64_t spawned = 0;  ///< bodies that emitters made or left out; counts their random numbers
  Vec3 gravity{};
  std::vector<double> due;  ///< by emitter: the share of a body that waits for the next step
  std::vector<Push> pushes;
};

/// Appends a checkpoint: little-endian machine layout, a fingerprint of the world and a checksum.
void save_columns(const Columns& columns, std::uint64_t world_fingerprint, std::vector<std::byte>& out);

/// Reads a checkpoint. Returns false and leaves `columns` unchanged if the bytes are damaged or of another
/// world.
[[nodiscard]] bool load_columns(std::span<const std::byte> bytes, std::uint64_t world_fingerprint,
                                Columns& columns);

}  // namespace tandem::engine
