#include "services/host/planning/scenery_json.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <vector>

#include "sdk/wire/limits.hpp"

namespace tandem::planning {
namespace {

using engine::Vec3;

std::string vector(const Vec3& v) { return fmt::format(R"({{"x":{},"y":{},"z":{}}})", v[0], v[1], v[2]); }

using Items = std::vector<std::string>;

std::string list(const char* name, const Items& items) {
  return items.empty() ? "" : fmt::format(R"(,"{}":[{}])", name, fmt::join(items, ","));
}

// The turns about the scene's x, y and z, in this order, that bring a box's edges into the directions `axes`.
std::string turns(const std::array<Vec3, 3>& axes) {
  // The third axis is this or its opposite, which makes the same box.
  const auto &x = axes[0], &y = axes[1];
  const Vec3 z{x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]};
  const double flat = std::hypot(x[0], x[1]);
  // With x upright the first and the last turn are about one axis, and the first alone is enough.
  const bool upright = flat < 1e-9;
  const struct {
    char axis;
    double rise, run;
  } all[] = {{'x', upright ? -z[1] : y[2], upright ? y[1] : z[2]},
             {'y', -x[2], flat},
             {'z', upright ? 0 : x[1], upright ? 1 : x[0]}};
  Items items;
  for (const auto& [axis, rise, run] : all) {
    if (rise != 0 || run < 0)
      items.push_back(fmt::format(R"({{"axis":"{}","rise":{},"run":{}}})", axis, rise, run));
  }
  return list("turns", items);
}

}  // namespace

std::string scenery_json(const Scenery& scenery, double dt_s) {
  Items planes, boxes, spheres;
  for (const auto& plane : scenery.planes) {
    const Vec3& n = plane.normal;
    const Vec3 through{n[0] * plane.offset, n[1] * plane.offset, n[2] * plane.offset};
    planes.push_back(fmt::format(R"({{"through":{},"normal":{}}})", vector(through), vector(n)));
  }
  for (const auto& box : scenery.boxes) {
    const Vec3 size{2 * box.half[0], 2 * box.half[1], 2 * box.half[2]};
    boxes.push_back(
        fmt::format(R"({{"centre":{},"size":{}{}}})", vector(box.centre), vector(size), turns(box.axes)));
  }
  for (const auto& ball : scenery.balls)
    spheres.push_back(fmt::format(R"({{"centre":{},"radiusM":{}}})", vector(ball.centre), ball.radius));
  const std::string json = fmt::format(R"({{"dtS":{}{}{}{}}})", dt_s, list("planes", planes),
                                       list("boxes", boxes), list("spheres", spheres));
  return json.size() > transport::kMaxSceneJsonBytes ? std::string() : json;
}

}  // namespace tandem::planning
