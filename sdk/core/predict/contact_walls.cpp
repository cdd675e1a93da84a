#include "sdk/core/predict/contact_walls.hpp"

#include <algorithm>
#include <array>

namespace tandem {
namespace {

using Vec3l = std::array<std::int64_t, 3>;

// |p| <= 2^31 and |axis| <= 2^30 a component: the sum stays below 2^63.
std::int64_t along(const Vec3i& axis, const Vec3l& p) {
  return (axis[0] * p[0] + axis[1] * p[1] + axis[2] * p[2]) >> 30;
}

Vec3l difference(const Vec3i& a, const Vec3i& b) {
  return {std::int64_t{a[0]} - b[0], std::int64_t{a[1]} - b[1], std::int64_t{a[2]} - b[2]};
}

// Of a vector whose components are at most 2^31.
std::uint64_t squared(const Vec3l& d) {
  std::uint64_t sum = 0;
  for (const std::int64_t x : d) sum += static_cast<std::uint64_t>(x * x);
  return sum;
}

}  // namespace

std::int64_t root(std::uint64_t x) {
  std::uint64_t result = 0;
  for (std::uint64_t bit = std::uint64_t{1} << 62U; bit != 0; bit >>= 2U) {
    const bool fits = x >= result + bit;
    if (fits) x -= result + bit;
    result = (result >> 1U) + (fits ? bit : 0);
  }
  return static_cast<std::int64_t>(result);
}

WallTouch touch(const ContactConstants::Plane& plane, const Vec3i& p, std::int32_t radius) {
  const std::int64_t height = along(plane.normal, {p[0], p[1], p[2]}) - plane.offset;
  if (height >= radius) return {};
  const auto& n = plane.normal;
  return {radius - height, {n[0] >> 16, n[1] >> 16, n[2] >> 16}};
}

WallTouch touch(const ContactConstants::Ball& ball, const Vec3i& p, std::int32_t radius) {
  const Vec3l d = difference(p, ball.centre);
  const std::int64_t reach = std::int64_t{ball.radius} + radius;
  for (const std::int64_t x : d) {
    if (x >= reach || x <= -reach) return {};
  }
  const std::int64_t distance = root(squared(d));
  if (distance >= reach) return {};
  if (distance == 0) return {reach, {0, 1 << 14, 0}};
  WallTouch result{reach - distance, {}};
  for (std::size_t i = 0; i < 3; ++i) result.out[i] = static_cast<std::int32_t>(d[i] * (1 << 14) / distance);
  return result;
}

WallTouch touch(const ContactConstants::Box& box, const Vec3i& p, std::int32_t radius) {
  const Vec3l d = difference(p, box.centre);
  Vec3l local{};
  Vec3l outside{};
  bool inside = true;
  for (std::size_t i = 0; i < 3; ++i) {
    local[i] = along(box.axes[i], d);
    outside[i] = local[i] - std::clamp<std::int64_t>(local[i], -box.half[i], box.half[i]);
    if (outside[i] >= radius || outside[i] <= -radius) return {};
    inside = inside && outside[i] == 0;
  }
  WallTouch result;
  Vec3l normal{};  // in the box's axes, in 2^-14
  if (inside) {    // out through the nearest face, the first of equals
    std::size_t nearest = 0;
    Vec3l depth{};
    for (std::size_t i = 0; i < 3; ++i) {
      depth[i] = box.half[i] - (local[i] < 0 ? -local[i] : local[i]);
      if (depth[i] < depth[nearest]) nearest = i;
    }
    normal[nearest] = local[nearest] < 0 ? -(1 << 14) : 1 << 14;
    result.overlap = radius + depth[nearest];
  } else {
    const std::int64_t distance = root(squared(outside));
    if (distance >= radius) return {};
    for (std::size_t i = 0; i < 3; ++i) normal[i] = outside[i] * (1 << 14) / distance;
    result.overlap = radius - distance;
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const std::int64_t sum =
        box.axes[0][i] * normal[0] + box.axes[1][i] * normal[1] + box.axes[2][i] * normal[2];
    result.out[i] = static_cast<std::int32_t>(sum >> 30);
  }
  return result;
}

}  // namespace tandem
