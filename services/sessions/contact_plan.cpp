#include "services/sessions/contact_plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "sdk/core/predict/contact/constants.hpp"

namespace tandem::sessions {
namespace {

// What does not fit ends at a value beyond every limit, which the check at the end refuses.
std::int32_t rounded(double value) {
  return static_cast<std::int32_t>(std::clamp(std::nearbyint(value), double{INT32_MIN}, double{INT32_MAX}));
}

Vec3i scaled(const engine::Vec3f& v, double scale) {
  return {rounded(static_cast<double>(v[0]) * scale), rounded(static_cast<double>(v[1]) * scale),
          rounded(static_cast<double>(v[2]) * scale)};
}

// Gains of one sub-step for a body of type 0.
ContactMaterial material_of(const engine::Material& material, double mass, double dt_s, double substeps) {
  const double share = dt_s / (mass * substeps);
  return {rounded(16384.0 * static_cast<double>(material.spring) * dt_s * share),
          rounded(8192.0 * static_cast<double>(material.damping) * share),
          rounded(8192.0 * static_cast<double>(material.shear) * share)};
}

}  // namespace

Result<std::vector<std::int32_t>> contact_constants(const scenes::Scene& scene, const host::Lattice& lattice,
                                                    std::string_view predictor) {
  const engine::World& world = scene.world;
  if (world.types.empty())
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("predictor '{}' needs a scene with body types", predictor));
  const double scale = lattice.position_scale();
  const double one = ContactConstants::kOne;
  const auto mass = static_cast<double>(world.types.front().mass);
  ContactConstants constants;
  constants.substeps = rounded(world.substeps);
  constants.pair = material_of(world.pair, mass, lattice.dt_s, world.substeps);
  constants.wall = material_of(world.wall, mass, lattice.dt_s, world.substeps);
  for (const auto& type : world.types) {
    constants.types.push_back({rounded(static_cast<double>(type.radius) * scale),
                               rounded(65536.0 * mass / static_cast<double>(type.mass))});
  }
  for (const auto& plane : world.planes) {
    constants.planes.push_back(
        {scaled(plane.normal, one), rounded(static_cast<double>(plane.offset) * scale)});
  }
  for (const auto& box : world.boxes) {
    constants.boxes.push_back(
        {scaled(box.centre, scale),
         scaled(box.half, scale),
         {scaled(box.axes[0], one), scaled(box.axes[1], one), scaled(box.axes[2], one)}});
  }
  for (const auto& ball : world.balls)
    constants.balls.push_back(
        {scaled(ball.centre, scale), rounded(static_cast<double>(ball.radius) * scale)});
  std::vector<std::int32_t> values = write_contact_constants(constants);
  if (!read_contact_constants(values))
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("predictor '{}': the world does not fit the lattice", predictor));
  return values;
}

}  // namespace tandem::sessions
