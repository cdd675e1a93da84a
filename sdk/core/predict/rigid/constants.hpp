#pragma once
// The constants of the predictor `rigid`: those of contacts, and a solid for each type.

#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/predict/contact/constants.hpp"
#include "tandem/result.hpp"

namespace tandem {

/// What a type of bodies is made of, in the body's frame. Lattice units.
struct Solid {
  static constexpr std::int32_t kMaxSize = 1 << 22;

  enum class Kind : std::int32_t {
    kRound = 0,  ///< sizes: radius, half of the axis along y (0: a ball), 0
    kBox = 1,    ///< sizes: the half sizes x, y, z
  };
  Kind kind = Kind::kRound;
  Vec3i size{1, 0, 0};
  friend bool operator==(const Solid&, const Solid&) = default;
};

struct RigidConstants {
  /// Of these, `rigid` reads substeps (1, 2, 4 or 8), mobilities and shapes.
  ContactConstants contact;
  std::vector<Solid> solids;  ///< as many as types
};

/// Writes the integers of a session's `predictor_constants`.
[[nodiscard]] std::vector<std::int32_t> write_rigid_constants(const RigidConstants& constants);
/// Reads `predictor_constants`. Untrusted. Errors: kMalformed with the reason.
[[nodiscard]] Result<RigidConstants> read_rigid_constants(std::span<const std::int32_t> values);

}  // namespace tandem
