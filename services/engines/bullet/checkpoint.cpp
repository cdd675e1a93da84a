#include <utility>

#include "services/engines/bullet/columns.hpp"
#include "services/engines/common/checkpoint_bytes.hpp"

namespace tandem::engine {
namespace {

constexpr std::uint64_t kMagic = 0x31444952444E4154;  // "TANDRID1"

// One list for both directions, so that they cannot differ.
template <class Io, class C>
void each_column(Io& io, C& columns) {
  for (auto& column : columns.position) io.column(column);
  for (auto& column : columns.velocity) io.column(column);
  for (auto& column : columns.orientation) io.column(column);
  for (auto& column : columns.angular_velocity) io.column(column);
  io.column(columns.alive);
  io.column(columns.activity);
  io.column(columns.type);
  io.column(columns.still_s);
  io.value(columns.gravity);
  io.value(columns.mishaps);
  io.column(columns.waiting);
}

}  // namespace

Motion RigidColumns::motion(std::uint32_t slot) const {
  Motion motion;
  for (std::size_t i = 0; i < 3; ++i) {
    motion.position[i] = position[i][slot];
    motion.velocity[i] = velocity[i][slot];
    motion.angular_velocity[i] = angular_velocity[i][slot];
  }
  for (std::size_t i = 0; i < 4; ++i) motion.orientation[i] = orientation[i][slot];
  return motion;
}

void RigidColumns::set_motion(std::uint32_t slot, const Motion& motion) {
  for (std::size_t i = 0; i < 3; ++i) {
    position[i][slot] = motion.position[i];
    velocity[i][slot] = motion.velocity[i];
    angular_velocity[i][slot] = motion.angular_velocity[i];
  }
  for (std::size_t i = 0; i < 4; ++i) orientation[i][slot] = motion.orientation[i];
}

std::uint64_t fingerprint(const RigidWorld& world) {
  std::vector<std::byte> bytes;
  CheckpointWriter out(bytes);
  out.value(fingerprint(world.world));
  for (const Shape& shape : world.shapes) {
    out.value(shape.kind);
    out.value(shape.radius);
    out.column(shape.values);
  }
  out.value(world.friction);
  out.value(world.restitution);
  if (world.cruise) {
    out.value(world.cruise->radius);
    out.value(world.cruise->acceleration);
    out.value(world.cruise->return_acceleration);
    out.column(world.cruise->speed);
  }
  return checksum(bytes);
}

void save_columns(const RigidColumns& columns, std::uint64_t world_fingerprint, std::vector<std::byte>& out) {
  const std::size_t begin = out.size();
  CheckpointWriter writer(out);
  writer.value(CheckpointHead{kMagic, world_fingerprint, columns.waiting.size()});
  each_column(writer, columns);
  seal(out, begin);
}

bool load_columns(std::span<const std::byte> bytes, std::uint64_t world_fingerprint, RigidColumns& columns) {
  const auto body = unsealed(bytes);
  if (!body) return false;
  CheckpointReader reader(*body);
  CheckpointHead head{};
  reader.value(head);
  if (head.magic != kMagic || head.world != world_fingerprint || head.waiting > kMaxWaiting) return false;
  RigidColumns loaded(static_cast<std::uint32_t>(columns.alive.size()));
  loaded.waiting.resize(head.waiting);
  each_column(reader, loaded);
  if (!reader.at_end()) return false;
  columns = std::move(loaded);
  return true;
}

}  // namespace tandem::engine
