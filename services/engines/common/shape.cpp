#include "services/engines/common/shape.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

namespace tandem::engine {
namespace {

bool finite_positive(float value) { return std::isfinite(value) && value > 0; }
bool finite_not_negative(float value) { return std::isfinite(value) && value >= 0; }

using Extents = std::array<double, 3>;  // half, along x, y and z

Extents half_extents(const Shape& shape) {
  const auto value = [&shape](std::size_t i) { return static_cast<double>(shape.values[i]); };
  switch (shape.kind) {
    case Shape::Kind::kBox:
      return {value(0), value(1), value(2)};
    case Shape::Kind::kCapsule:
      return {value(0), value(0) + value(1), value(0)};
    case Shape::Kind::kCylinder:
      return {value(0), value(1), value(0)};
    case Shape::Kind::kHull: {
      Extents low{value(0), value(1), value(2)};
      Extents high = low;
      for (std::size_t i = 3; i < shape.values.size(); ++i) {
        low[i % 3] = std::min(low[i % 3], value(i));
        high[i % 3] = std::max(high[i % 3], value(i));
      }
      return {(high[0] - low[0]) / 2, (high[1] - low[1]) / 2, (high[2] - low[2]) / 2};
    }
    case Shape::Kind::kSphere:
      break;
  }
  const auto radius = static_cast<double>(shape.radius);
  return {radius, radius, radius};
}

// Returns what is wrong; empty if nothing is.
std::string fault(const Shape& shape) {
  const std::vector<float>& v = shape.values;
  switch (shape.kind) {
    case Shape::Kind::kSphere:
      return v.empty() && finite_positive(shape.radius) ? ""
                                                        : "a sphere needs a radius above 0 and no values";
    case Shape::Kind::kBox:
      return v.size() == 3 && std::ranges::all_of(v, positive) ? "" : "a box needs 3 half sizes above 0";
    case Shape::Kind::kCapsule:
      return v.size() == 2 && finite_positive(v[0]) && finite_not_negative(v[1])
                 ? ""
                 : "a capsule needs a radius above 0 and a half length of at least 0";
    case Shape::Kind::kCylinder:
      return v.size() == 2 && std::ranges::all_of(v, positive)
                 ? ""
                 : "a cylinder needs a radius and a half height above 0";
    case Shape::Kind::kHull:
      break;
  }
  if (v.size() < 12 || v.size() > 3 * kMaxHullPoints || v.size() % 3 != 0) {
    return "a hull needs 4 to " + std::to_string(kMaxHullPoints) + " points";
  }
  if (!std::ranges::all_of(v, [](float value) { return std::isfinite(value); }))
    return "a hull needs finite points";
  return std::ranges::min(half_extents(shape)) > 0 ? "" : "a hull needs an extent along x, y and z";
}

}  // namespace

Result<Shape::Kind> shape_kind(std::string_view name) {
  constexpr std::array<std::string_view, 5> kNames{"sphere", "box", "capsule", "cylinder", "hull"};
  const auto found = std::ranges::find(kNames, name);
  if (found == kNames.end()) {
    return fail(ErrorCode::kInvalidArgument,
                "shape '" + std::string(name) + "' is none of sphere, box, capsule, cylinder, hull");
  }
  return static_cast<Shape::Kind>(found - kNames.begin() + 1);
}

Result<void> check(const Shape& shape) {
  if (std::string reason = fault(shape); !reason.empty())
    return fail(ErrorCode::kInvalidArgument, std::move(reason));
  return {};
}

double bounding_radius(const Shape& shape) {
  const Extents half = half_extents(shape);
  switch (shape.kind) {
    case Shape::Kind::kBox:
      return std::sqrt(half[0] * half[0] + half[1] * half[1] + half[2] * half[2]);
    case Shape::Kind::kCylinder:
      return std::sqrt(half[0] * half[0] + half[1] * half[1]);
    case Shape::Kind::kHull: {
      double squared = 0;
      for (std::size_t i = 0; i + 2 < shape.values.size(); i += 3) {
        double distance = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const auto v = static_cast<double>(shape.values[i + axis]);
          distance += v * v;
        }
        squared = std::max(squared, distance);
      }
      return std::sqrt(squared);
    }
    case Shape::Kind::kSphere:
    case Shape::Kind::kCapsule:
      break;
  }
  return half[1];
}

double inner_radius(const Shape& shape) { return std::ranges::min(half_extents(shape)); }

}  // namespace tandem::engine
