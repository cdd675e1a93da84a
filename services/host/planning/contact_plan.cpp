#include "services/host/planning/contact_plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/predict/contact/constants.hpp"
#include "sdk/core/predict/rigid/constants.hpp"
#include "services/host/streams/contact_control.hpp"

namespace tandem::planning {
namespace {

using engine::Vec3;

// A value that does not fit or is not a number becomes one beyond every limit, which the check at the end
// refuses.
std::int32_t rounded(double value) {
  if (std::isnan(value)) return INT32_MAX;
  return static_cast<std::int32_t>(std::clamp(std::nearbyint(value), double{INT32_MIN}, double{INT32_MAX}));
}

Vec3i scaled(const Vec3& v, double scale) {
  return {rounded(v[0] * scale), rounded(v[1] * scale), rounded(v[2] * scale)};
}

// The gains of one sub-step for a body of type 0.
ContactMaterial material_of(const Scenery::Law& law, double mass, double dt_s, double substeps) {
  TANDEM_ASSERT(mass > 0 && substeps >= 1);
  const double share = dt_s / (mass * substeps);
  return {rounded(16384.0 * law.spring * dt_s * share), rounded(8192.0 * law.damping * share),
          rounded(8192.0 * law.shear * share)};
}

bool is_above_0(double value) { return std::isfinite(value) && value > 0; }
bool is_law(const Scenery::Law& law) {
  return std::isfinite(law.spring) && law.spring >= 0 && std::isfinite(law.damping) && law.damping >= 0 &&
         std::isfinite(law.shear) && law.shear >= 0;
}
double dot(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
// False for values that are not numbers.
bool is_unit(const Vec3& v) { return std::fabs(dot(v, v) - 1) < 1e-3; }
bool is_orthonormal(const std::array<Vec3, 3>& axes) {
  for (std::size_t i = 0; i < 3; ++i)
    if (!is_unit(axes[i]) || !(std::fabs(dot(axes[i], axes[(i + 1) % 3])) < 1e-3)) return false;
  return true;
}

// The sub-steps of a frame that suit most engines: 120 a second.
std::int32_t substeps_of(double dt_s) {
  std::int32_t substeps = 1;
  while (substeps < 8 && dt_s * 120 > 1.5 * substeps) substeps *= 2;
  return substeps;
}

// The solid that stands for a type. A cylinder and a hull are as good as nothing: a box in their place, or a
// ball, costs more bits than it saves.
Solid solid_of(const BodyType& type, double scale) {
  const auto& values = type.shape_values;
  const auto size = [&](double x) { return std::max(1, rounded(x * scale)); };
  const auto value = [&](std::size_t i) { return i < values.size() ? static_cast<double>(values[i]) : 0; };
  switch (type.shape) {
    case BodyShape::kBox:
      return {Solid::Kind::kBox, {size(value(0)), size(value(1)), size(value(2))}};
    case BodyShape::kCapsule:
      return {Solid::Kind::kRound, {size(value(0)), value(1) > 0 ? size(value(1)) : 0, 0}};
    case BodyShape::kCylinder:
    case BodyShape::kHull:
      return {Solid::Kind::kRound, {1, 0, 0}};
    default:
      return {Solid::Kind::kRound, {size(type.contact_radius), 0, 0}};
  }
}

std::string text_of(const Vec3& v) { return fmt::format("({:g}, {:g}, {:g})", v[0], v[1], v[2]); }

// These return what is wrong; empty if nothing is.
std::string fault(const BodyType& type) {
  if (!is_above_0(type.mass)) return fmt::format("its mass is {:g}, but must be above 0", type.mass);
  if (!is_above_0(type.contact_radius))
    return fmt::format("its radius in contacts is {:g}, but must be above 0", type.contact_radius);
  return {};
}
std::string fault(const Scenery::Law& law) {
  if (is_law(law)) return {};
  return fmt::format("spring {:g}, damping {:g} and shear {:g} must be finite and not negative", law.spring,
                     law.damping, law.shear);
}
std::string fault(const Scenery::Plane& plane) {
  if (is_unit(plane.normal)) return {};
  return fmt::format("its normal {} has length {:.4g}, but must have 1", text_of(plane.normal),
                     std::sqrt(dot(plane.normal, plane.normal)));
}
std::string fault(const Scenery::Box& box) {
  if (!std::ranges::all_of(box.half, is_above_0))
    return fmt::format("its half sizes are {}, but must be above 0", text_of(box.half));
  if (is_orthonormal(box.axes)) return {};
  return fmt::format("its axes {}, {} and {} must have length 1 and be at right angles", text_of(box.axes[0]),
                     text_of(box.axes[1]), text_of(box.axes[2]));
}
std::string fault(const Scenery::Ball& ball) {
  return is_above_0(ball.radius) ? std::string()
                                 : fmt::format("its radius is {:g}, but must be above 0", ball.radius);
}

template <class T>
std::string fault(std::string_view what, const std::vector<T>& all) {
  for (std::size_t i = 0; i < all.size(); ++i)
    if (const std::string why = fault(all[i]); !why.empty()) return fmt::format("{}[{}]: {}", what, i, why);
  return {};
}

std::string fault(const PlannedWorld& world) {
  const Scenery& scenery = *world.scenery;
  for (const BodyType& type : world.types)
    if (const std::string why = fault(type); !why.empty())
      return fmt::format("body type '{}': {}", type.name, why);
  if (const std::string why = fault(scenery.between_bodies); !why.empty()) return "between bodies: " + why;
  if (const std::string why = fault(scenery.with_scenery); !why.empty()) return "with scenery: " + why;
  if (scenery.substeps < 1 || scenery.substeps > 16)
    return fmt::format("{} substeps, but 1 to 16 are allowed", scenery.substeps);
  for (const std::string& why :
       {fault("planes", scenery.planes), fault("boxes", scenery.boxes), fault("balls", scenery.balls)})
    if (!why.empty()) return "scenery: " + why;
  return {};
}

}  // namespace

Result<void> set_contact(const PlannedWorld& world, const PredictorTraits& predictor,
                         host::StreamConfig& stream) {
  const auto wrong = [&predictor](const std::string& what) {
    return fail(ErrorCode::kInvalidArgument, fmt::format("predictor '{}': {}", predictor.name, what));
  };
  if (!world.scenery || world.types.empty()) return wrong("needs a world with body types and scenery");
  if (std::string what = fault(world); !what.empty())
    return fail(ErrorCode::kInvalidArgument, std::move(what));
  const Scenery& scenery = *world.scenery;
  const host::Lattice& lattice = stream.lattice;
  const double scale = lattice.position_scale();
  const double one = ContactConstants::kOne;
  const double mass = world.types.front().mass;
  ContactConstants constants;
  constants.substeps = rounded(scenery.substeps);
  constants.pair = material_of(scenery.between_bodies, mass, lattice.dt_s, scenery.substeps);
  constants.wall = material_of(scenery.with_scenery, mass, lattice.dt_s, scenery.substeps);
  for (const BodyType& type : world.types)
    constants.types.push_back({rounded(type.contact_radius * scale), rounded(65536.0 * mass / type.mass)});
  for (const auto& plane : scenery.planes)
    constants.planes.push_back({scaled(plane.normal, one), rounded(plane.offset * scale)});
  for (const auto& box : scenery.boxes) {
    constants.boxes.push_back(
        {scaled(box.centre, scale),
         scaled(box.half, scale),
         {scaled(box.axes[0], one), scaled(box.axes[1], one), scaled(box.axes[2], one)}});
  }
  for (const auto& ball : scenery.balls)
    constants.balls.push_back({scaled(ball.centre, scale), rounded(ball.radius * scale)});
  if (!read_contact_constants(write_contact_constants(constants))) {
    return fail(ErrorCode::kCapacity,
                fmt::format("predictor '{}': the world does not fit the lattice", predictor.name));
  }
  std::vector<Solid> solids;
  if (predictor.reads_shapes) {
    if (!world.turns) return wrong("needs bodies that turn");
    constants.substeps = substeps_of(lattice.dt_s);
    for (const BodyType& type : world.types) solids.push_back(solid_of(type, scale));
    if (!read_rigid_constants(write_rigid_constants({constants, solids})))
      return fail(ErrorCode::kCapacity,
                  fmt::format("predictor '{}': the bodies do not fit the lattice", predictor.name));
  }
  std::vector<std::int32_t> values =
      predictor.reads_shapes
          ? write_rigid_constants({constants, solids})
          : write_contact_constants(predictor.one_step ? in_one_step(constants) : constants);
  if (auto good = check_predictor(predictor.name, stream.layout.capacity, values); !good)
    return fail(ErrorCode::kCapacity, good.error().message);
  if (predictor.one_step && constants.substeps == 1) stream.local.encodes_as = "contact";
  if (predictor.hard_contacts) host::set_first_contacts(stream.layout.parameters, predictor.reads_shapes);
  stream.layout.predictor = predictor.name;
  stream.layout.predictor_constants = std::move(values);
  return {};
}

}  // namespace tandem::planning
