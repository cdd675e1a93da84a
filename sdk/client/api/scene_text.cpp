#include "sdk/client/api/scene_text.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "sdk/wire/text_message.hpp"

namespace tandem::api {
namespace {

using transport::child;
using transport::scalar;
using Message = transport::TextMessage;
using Field = transport::TextField;

/// Far below the overflow of a float, so that results computed with it stay finite.
constexpr double kLargest = 1e30;

double number(const Message* message, std::string_view name) {
  std::string_view text = scalar(message, name);
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const std::string_view rest(end, static_cast<std::size_t>(text.data() + text.size() - end));
  const bool whole = error == std::errc() && (rest.empty() || rest == "f" || rest == "F");
  return whole && std::abs(value) <= kLargest ? value : 0;  // false for NaN
}

Vector vector(const Message* message) {
  return {number(message, "x"), number(message, "y"), number(message, "z")};
}

using Quaternion = std::array<double, 4>;  // x, y, z, w

Quaternion product(const Quaternion& a, const Quaternion& b) {
  return {a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
          a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
          a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
          a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2]};
}

Solid plane(const Message& text) {
  Solid solid;
  solid.shape = Solid::Shape::kPlane;
  solid.centre = vector(child(&text, "through"));
  solid.normal = vector(child(&text, "normal"));
  const double length = std::hypot(solid.normal[0], solid.normal[1], solid.normal[2]);
  for (double& x : solid.normal) x = length > 0 ? x / length : 0;
  return solid;
}

// Each turn is about an axis of the scene, so its quaternion is multiplied from the left.
Solid box(const Message& text) {
  Solid solid;
  solid.shape = Solid::Shape::kBox;
  solid.centre = vector(child(&text, "centre"));
  solid.size = vector(child(&text, "size"));
  for (const Field& field : text) {
    if (field.name != "turns" || !field.is_message) continue;
    const double half = std::atan2(number(&field.message, "rise"), number(&field.message, "run")) / 2;
    const std::string_view axis = scalar(&field.message, "axis");
    Quaternion turn{0, 0, 0, std::cos(half)};
    turn.at(axis == "y" ? 1 : axis == "z" ? 2 : 0) = std::sin(half);
    solid.orientation = product(turn, solid.orientation);
  }
  return solid;
}

Solid sphere(const Message& text) {
  Solid solid;
  solid.shape = Solid::Shape::kSphere;
  solid.centre = vector(child(&text, "centre"));
  solid.radius = number(&text, "radius_m");
  return solid;
}

bool add_solids(const Message& scene, std::string_view name, Solid (*make)(const Message&),
                std::vector<Solid>& solids) {
  std::size_t count = 0;
  for (const Field& field : scene) {
    if (field.name != name || !field.is_message) continue;
    if (++count > SceneText::kMaxSolids) return false;
    const Solid solid = make(field.message);
    if (solid.shape == Solid::Shape::kPlane && solid.normal == Vector{}) continue;
    solids.push_back(solid);
  }
  return true;
}

}  // namespace

Result<SceneText> read_scene_text(std::string_view text) {
  const auto scene = transport::read_text_message(text);
  if (!scene) return tl::unexpected<Error>(scene.error());
  SceneText out;
  out.gravity = vector(child(&*scene, "gravity"));
  out.max_gravity = number(&*scene, "max_gravity");
  const double gravity = std::hypot(out.gravity[0], out.gravity[1], out.gravity[2]);
  if (out.max_gravity == 0) out.max_gravity = 10 * gravity;  // idl/scene.proto
  out.max_push = number(&*scene, "max_push");
  const Message* bounds = child(&*scene, "bounds");
  out.low = vector(child(bounds, "low"));
  out.high = vector(child(bounds, "high"));
  if (!add_solids(*scene, "planes", plane, out.solids) || !add_solids(*scene, "boxes", box, out.solids) ||
      !add_solids(*scene, "spheres", sphere, out.solids)) {
    return fail(ErrorCode::kMalformed, "the scene's text has more than 4,096 solids of a kind");
  }
  return out;
}

}  // namespace tandem::api
