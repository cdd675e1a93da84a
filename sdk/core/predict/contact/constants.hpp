#pragma once
// The constants of the predictors `contact` and `field`, and their form in the session.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/lattice/state.hpp"
#include "tandem/result.hpp"

namespace tandem {

/// The changes of v in one sub-step: by overlap (lattice units a frame), in 1/16384, and by relative
/// velocity, in 1/8192.
struct ContactMaterial {
  static constexpr std::int32_t kMaxSpring = 1 << 16, kMaxDamping = 1 << 13;
  std::int32_t spring = 0, damping = 0, shear = 0;
};

struct ContactConstants {
  static constexpr std::int32_t kMaxSubsteps = 16;
  static constexpr std::int32_t kMaxMobility = 1 << 20;
  static constexpr std::int32_t kMaxRadius = 1 << 24;
  static constexpr std::int32_t kOne = 1 << 30;  ///< a component 1 of a unit vector
  static constexpr std::size_t kMaxShapes = 256;

  struct Type {
    std::int32_t radius = 1;
    std::int32_t mobility = 65536;  ///< mass of type 0 divided by this one's, in 1/65536
  };
  struct Plane {
    Vec3i normal{};
    std::int32_t offset = 0;
  };
  struct Box {
    Vec3i centre{}, half{};
    std::array<Vec3i, 3> axes{};
  };
  struct Ball {
    Vec3i centre{};
    std::int32_t radius = 0;
  };

  std::int32_t substeps = 1;
  ContactMaterial pair, wall;
  std::vector<Type> types;  ///< at least one; a body of a higher type uses the last one
  std::vector<Plane> planes;
  std::vector<Box> boxes;
  std::vector<Ball> balls;

  [[nodiscard]] const Type& type_of(TypeId type) const {
    return types[type < types.size() ? type : types.size() - 1];
  }
};

/// The constants for one step per frame, which a server announces for `field`: the gains of all sub-steps
/// together, limited so that one step does not oscillate. With one sub-step nothing changes.
[[nodiscard]] ContactConstants in_one_step(ContactConstants constants);

/// Writes the integers of a session's `predictor_constants`.
[[nodiscard]] std::vector<std::int32_t> write_contact_constants(const ContactConstants& constants);

/// The numbers of sub-steps and shapes that `predictor_constants` begin with. Untrusted; where they are out
/// of range, read_contact_constants() refuses them.
struct ContactCounts {
  std::uint32_t substeps = 1, planes = 0, boxes = 0, balls = 0;
};
[[nodiscard]] ContactCounts count_contact_constants(std::span<const std::int32_t> values);

/// Reads `predictor_constants`. Untrusted. Errors: kMalformed with the reason.
[[nodiscard]] Result<ContactConstants> read_contact_constants(std::span<const std::int32_t> values);

}  // namespace tandem
