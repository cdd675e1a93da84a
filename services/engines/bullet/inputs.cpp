#include "services/engines/bullet/inputs.hpp"

#include <bit>
#include <cstring>

namespace tandem::engine {
namespace {

static_assert(std::endian::native == std::endian::little, "inputs are copied as they lie in memory");

struct SpawnBytes {
  std::uint8_t action = 1;
  std::uint8_t zero = 0;
  std::uint16_t type = 0;
  Vec3f position{}, velocity{};
  Quaternion orientation{};
  Vec3f angular_velocity{};
};
struct RemoveBytes {
  std::uint8_t action = 2;
  std::array<std::uint8_t, 3> zero{};
  Vec3f centre{};
  float radius = 0;
};
static_assert(sizeof(SpawnBytes) == 56 && sizeof(RemoveBytes) == 20);

template <class T>
Input input_of(const T& bytes) {
  Input input;
  input.kind = static_cast<std::uint32_t>(InputKind::kApplication);
  input.bytes.resize(sizeof bytes);
  std::memcpy(input.bytes.data(), &bytes, sizeof bytes);
  return input;
}

template <class T>
std::optional<T> read(std::span<const std::byte> bytes) {
  T read;
  const auto action = std::byte{read.action};
  if (bytes.size() != sizeof read || bytes[0] != action) return {};
  std::memcpy(&read, bytes.data(), sizeof read);
  return read;
}

}  // namespace

Input to_input(const Spawn& spawn) {
  return input_of(SpawnBytes{.type = spawn.type,
                             .position = spawn.position,
                             .velocity = spawn.velocity,
                             .orientation = spawn.orientation,
                             .angular_velocity = spawn.angular_velocity});
}

Input to_input(const Remove& remove) {
  return input_of(RemoveBytes{.centre = remove.centre, .radius = remove.radius});
}

std::optional<Spawn> spawn_of(std::span<const std::byte> bytes) {
  const auto found = read<SpawnBytes>(bytes);
  if (!found || found->zero != 0) return {};
  return Spawn{found->type, found->position, found->velocity, found->orientation, found->angular_velocity};
}

std::optional<Remove> remove_of(std::span<const std::byte> bytes) {
  const auto found = read<RemoveBytes>(bytes);
  if (!found || found->zero != std::array<std::uint8_t, 3>{}) return {};
  return Remove{found->centre, found->radius};
}

}  // namespace tandem::engine
