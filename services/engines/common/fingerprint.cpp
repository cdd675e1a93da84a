#include "services/engines/common/checkpoint_bytes.hpp"
#include "services/engines/common/world.hpp"

namespace tandem::engine {

std::uint64_t fingerprint(const EngineWorld& world) {
  std::vector<std::byte> bytes;
  CheckpointWriter out(bytes);
  out.value(world.capacity);
  out.value(world.seed);
  out.value(world.dt_s);
  out.value(world.substeps);
  out.value(world.damping_per_s);
  out.value(world.low);
  out.value(world.high);
  out.value(world.pair);
  out.value(world.wall);
  out.column(world.types);
  out.column(world.planes);
  out.column(world.boxes);
  out.column(world.balls);
  for (const Emitter& e : world.emitters) {
    for (const Vec3f& v : {e.low, e.high, e.velocity}) out.value(v);
    out.value(e.rate_per_s);
    out.value(e.type);
  }
  for (const Region& r : world.regions) {
    for (const Vec3f& v : {r.low, r.high, r.offset}) out.value(v);
    out.value(r.action);
    out.value(r.type);
  }
  return checksum(bytes);
}

}  // namespace tandem::engine
