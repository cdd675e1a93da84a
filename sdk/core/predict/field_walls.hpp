#pragma once
// Forces of the static geometry in the tier `field`.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/lattice/state.hpp"
#include "sdk/core/predict/contact_constants.hpp"

namespace tandem {

/// A world's shapes: which bodies are near one, in a vector's pace, and what those few feel.
class FieldWalls {
 public:
  /// `gains` of a pass.
  FieldWalls(const ContactConstants& world, const ContactMaterial& gains, std::uint32_t capacity);

  /// Adds to `force`, by slot, what the shapes change of v, at most 2^28.
  void add_forces(const State& state, const std::array<std::span<std::int32_t>, 3>& force);

 private:
  [[nodiscard]] std::uint32_t find_near(const State& state);
  template <class Shape>
  void add(const Shape& shape, const Vec3i& p, const Vec3i& v, std::int32_t radius,
           std::array<std::int64_t, 3>& sum) const;

  /// What reaches a body whose centre is within `reach` of `centre` on each axis.
  struct Bound {
    Vec3i centre{};
    std::int64_t reach = 0;
  };

  const ContactConstants* world_;
  ContactMaterial gains_;
  std::int32_t largest_radius_ = 1;
  std::vector<Bound> bounds_;  // of boxes and balls
  std::vector<Slot> near_;
};

}  // namespace tandem
