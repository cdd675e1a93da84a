#include "services/host/planning/scenery_text.hpp"

#include <fmt/format.h>

#include <cmath>

#include "sdk/wire/limits.hpp"

namespace tandem::planning {
namespace {

using engine::Vec3;

std::string vector(const char* name, const Vec3& v) {
  return fmt::format(" {} {{ x: {} y: {} z: {} }}", name, v[0], v[1], v[2]);
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
  std::string text;
  for (const auto& [axis, rise, run] : all) {
    if (rise != 0 || run < 0)
      text += fmt::format(" turns {{ axis: \"{}\" rise: {} run: {} }}", axis, rise, run);
  }
  return text;
}

}  // namespace

std::string scenery_text(const Scenery& scenery, double dt_s) {
  std::string text = fmt::format("dt_s: {}\n", dt_s);
  for (const auto& plane : scenery.planes) {
    const Vec3& n = plane.normal;
    const Vec3 through{n[0] * plane.offset, n[1] * plane.offset, n[2] * plane.offset};
    text += fmt::format("planes {{{}{} }}\n", vector("through", through), vector("normal", n));
  }
  for (const auto& box : scenery.boxes) {
    const Vec3 size{2 * box.half[0], 2 * box.half[1], 2 * box.half[2]};
    text += fmt::format("boxes {{{}{}{} }}\n", vector("centre", box.centre), vector("size", size),
                        turns(box.axes));
  }
  for (const auto& ball : scenery.balls)
    text += fmt::format("spheres {{{} radius_m: {} }}\n", vector("centre", ball.centre), ball.radius);
  return text.size() > transport::kMaxDescriptionBytes ? std::string() : text;
}

}  // namespace tandem::planning
