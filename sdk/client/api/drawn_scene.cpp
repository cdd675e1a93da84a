#include "sdk/client/api/drawn_scene.hpp"

#include <cmath>
#include <string>

#include "sdk/wire/json_reader.hpp"

namespace tandem::api {
namespace {

using transport::JsonReader;

/// Far below the overflow of a float, so that results computed with it stay finite.
constexpr double kLargest = 1e30;

double number(JsonReader& in) {
  const double value = in.number().value_or(0);
  return std::abs(value) <= kLargest ? value : 0;
}

/// Calls `use(name)` for each member of the value at hand; for none if it is no object.
template <class Use>
void each_member(JsonReader& in, Use&& use) {
  if (!in.open_object()) return;
  for (std::string name; in.next_member(name);) use(name);
}

Vector vector(JsonReader& in) {
  Vector out{};
  each_member(in, [&](const std::string& name) {
    if (name == "x") out[0] = number(in);
    if (name == "y") out[1] = number(in);
    if (name == "z") out[2] = number(in);
  });
  return out;
}

using Quaternion = std::array<double, 4>;  // x, y, z, w

Quaternion product(const Quaternion& a, const Quaternion& b) {
  return {a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
          a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
          a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
          a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2]};
}

Solid plane(JsonReader& in) {
  Solid solid;
  solid.shape = Solid::Shape::kPlane;
  each_member(in, [&](const std::string& name) {
    if (name == "through") solid.centre = vector(in);
    if (name == "normal") solid.normal = vector(in);
  });
  const double length = std::hypot(solid.normal[0], solid.normal[1], solid.normal[2]);
  for (double& x : solid.normal) x = length > 0 ? x / length : 0;
  return solid;
}

// About an axis of the scene.
Quaternion turn(JsonReader& in) {
  double rise = 0, run = 0;
  std::size_t axis = 0;
  each_member(in, [&](const std::string& name) {
    if (name == "rise") rise = number(in);
    if (name == "run") run = number(in);
    if (name == "axis") {
      const std::string told = in.text().value_or("x");
      axis = told == "y" ? 1 : told == "z" ? 2 : 0;
    }
  });
  const double half = std::atan2(rise, run) / 2;
  Quaternion turn{0, 0, 0, std::cos(half)};
  turn.at(axis) = std::sin(half);
  return turn;
}

Solid box(JsonReader& in) {
  Solid solid;
  solid.shape = Solid::Shape::kBox;
  each_member(in, [&](const std::string& name) {
    if (name == "centre") solid.centre = vector(in);
    if (name == "size") solid.size = vector(in);
    if (name != "turns") return;
    solid.orientation = {0, 0, 0, 1};
    if (!in.open_array()) return;
    while (in.next_item()) solid.orientation = product(turn(in), solid.orientation);
  });
  return solid;
}

Solid sphere(JsonReader& in) {
  Solid solid;
  solid.shape = Solid::Shape::kSphere;
  each_member(in, [&](const std::string& name) {
    if (name == "centre") solid.centre = vector(in);
    if (name == "radiusM") solid.radius = number(in);
  });
  return solid;
}

/// One more than the maximum if there are too many.
std::vector<Solid> list(JsonReader& in, Solid (*make)(JsonReader&)) {
  std::vector<Solid> solids;
  if (!in.open_array()) return solids;
  while (in.next_item()) {
    if (solids.size() <= DrawnScene::kMaxSolids) solids.push_back(make(in));
  }
  return solids;
}

}  // namespace

Result<DrawnScene> read_scene_json(std::string_view json) {
  DrawnScene out;
  if (json.empty()) return out;
  JsonReader in(json);
  std::vector<Solid> planes, boxes, spheres;
  each_member(in, [&](const std::string& name) {
    if (name == "gravity") out.gravity = vector(in);
    if (name == "maxGravity") out.max_gravity = number(in);
    if (name == "maxPush") out.max_push = number(in);
    if (name == "bounds") {
      out.low = out.high = {};
      each_member(in, [&](const std::string& corner) {
        if (corner == "low") out.low = vector(in);
        if (corner == "high") out.high = vector(in);
      });
    }
    if (name == "planes") planes = list(in, plane);
    if (name == "boxes") boxes = list(in, box);
    if (name == "spheres") spheres = list(in, sphere);
  });
  if (auto whole = in.finish(); !whole)
    return fail(ErrorCode::kMalformed, "scene_json, " + whole.error().message);
  const double gravity = std::hypot(out.gravity[0], out.gravity[1], out.gravity[2]);
  if (out.max_gravity == 0) out.max_gravity = 10 * gravity;  // idl/scene.proto
  for (const std::vector<Solid>* solids : {&planes, &boxes, &spheres}) {
    if (solids->size() > DrawnScene::kMaxSolids)
      return fail(ErrorCode::kMalformed, "scene_json has more than 4,096 solids of a kind");
    for (const Solid& solid : *solids) {
      if (solid.shape != Solid::Shape::kPlane || solid.normal != Vector{}) out.solids.push_back(solid);
    }
  }
  return out;
}

}  // namespace tandem::api
