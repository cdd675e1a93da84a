#include "services/engines/bullet/bullet.hpp"

namespace tandem::engine {

bool bullet_is_built() { return false; }

Result<std::unique_ptr<Simulation>> make_bullet(const RigidWorld& /*world*/) {
  return fail(ErrorCode::kUnsupported,
              "this build has no engine 'bullet'; install libbullet-dev, then configure and build again");
}

}  // namespace tandem::engine
