#include "sdk/core/predict/rigid/touch.hpp"

#include <algorithm>

#include "sdk/core/lattice/fixed_point.hpp"

namespace tandem {
namespace {

using R = RigidLaw;

constexpr std::int64_t kOne = std::int64_t{1} << R::kAxisBits;
constexpr std::int64_t kParallel = kOne >> 10;  // 1 - cos^2 of axes that have no nearest points
constexpr std::int64_t kParts = 16;             // of a round solid's axis

Vec3l scaled(const Vec3i& axis, std::int64_t length) {
  Vec3l x{};
  for (std::size_t i = 0; i < 3; ++i) x[i] = axis[i] * length >> R::kAxisBits;
  return x;
}

Vec3l sum(const Vec3l& a, const Vec3l& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
Vec3l difference(const Vec3l& a, const Vec3l& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

Vec3l local(const std::array<Vec3i, 3>& axes, const Vec3l& x) {
  return {along(axes[0], x), along(axes[1], x), along(axes[2], x)};
}

// The direction of x, of length `far` > 0, in 2^-14.
Vec3l direction(const Vec3l& x, std::int64_t far) {
  return {(x[0] << R::kNormalBits) / far, (x[1] << R::kNormalBits) / far, (x[2] << R::kNormalBits) / far};
}

bool is_far(const Vec3l& x, std::int64_t most) {
  return std::any_of(x.begin(), x.end(), [most](std::int64_t y) { return y >= most || -y >= most; });
}

// From the nearest point of the box to x.
Vec3l beyond(const Vec3l& half, const Vec3l& x) {
  Vec3l b{};
  for (std::size_t i = 0; i < 3; ++i) b[i] = x[i] - std::clamp(x[i], -half[i], half[i]);
  return b;
}

// A ball of a round solid at x in the frame of the box, whose edges are round. n points from the box to it.
struct NearBox {
  bool found = false;
  Vec3l n{};  // in the box's frame
  std::int64_t gap = 0;
};
NearBox near_box(const SizedSolid& box, const Vec3l& x, std::int64_t radius, std::int64_t margin) {
  const Vec3l& half = box.size;
  const std::int64_t round = box.rounding;
  const Vec3l b = beyond({half[0] - round, half[1] - round, half[2] - round}, x);
  if (is_far(b, round + radius + margin)) return {};
  NearBox near;
  if (b != Vec3l{}) {
    const std::int64_t far = length_of(static_cast<std::uint64_t>(product(b, b)));
    near.n = direction(b, far);
    near.gap = far - round - radius;
  } else {
    std::size_t face = 0;
    Vec3l inside{};
    for (std::size_t i = 0; i < 3; ++i) {
      inside[i] = half[i] - (x[i] < 0 ? -x[i] : x[i]);
      if (inside[i] < inside[face]) face = i;
    }
    near.n[face] = std::int64_t{x[face] < 0 ? -1 : 1} << R::kNormalBits;
    near.gap = -inside[face] - radius;
  }
  near.found = near.gap < margin;
  return near;
}

// `to_round`: the round solid's centre minus the box's; `at_box`: the box's centre minus that of a. `sign`: 1
// if the round solid is a.
void touch_round_and_box(const PlacedSolid& round, const PlacedSolid& box, const Vec3l& to_round,
                         const Vec3l& at_box, std::int64_t sign, std::int64_t margin, RigidPoints& points) {
  const Vec3l& half = box.solid->size;
  const std::int64_t radius = round.solid->size[0];
  const Vec3l centre = local(box.axes, to_round);
  const auto add = [&](const Vec3l& x) {
    const NearBox near = near_box(*box.solid, x, radius, margin);
    if (!near.found) return;
    Vec3l at{};
    for (std::size_t i = 0; i < 3; ++i) at[i] = x[i] - (near.n[i] * radius >> R::kNormalBits);
    const Vec3l n = in_world(box.axes, near.n);
    RigidPoint point{.n = {}, .gap = near.gap, .at = sum(at_box, in_world(box.axes, at))};
    for (std::size_t i = 0; i < 3; ++i) point.n[i] = static_cast<std::int32_t>(sign * n[i]);
    points.add(point);
  };
  const std::int64_t length = round.solid->size[1];
  if (length == 0) {
    add(centre);
    return;
  }
  const Vec3l axis = local(box.axes, scaled(round.axes[1], length));
  std::int64_t least = 0;
  std::int64_t nearest = 0;
  for (std::int64_t part = -kParts / 2; part <= kParts / 2; ++part) {
    Vec3l x{};
    for (std::size_t i = 0; i < 3; ++i) x[i] = centre[i] + axis[i] * part / (kParts / 2);
    const Vec3l b = beyond(half, x);
    const std::int64_t square = product(b, b);
    if (part > -kParts / 2 && square >= least) continue;
    least = square;
    nearest = part;
  }
  add(difference(centre, axis));
  if (nearest > -kParts / 2 && nearest < kParts / 2) {
    Vec3l x{};
    for (std::size_t i = 0; i < 3; ++i) x[i] = centre[i] + axis[i] * nearest / (kParts / 2);
    add(x);
  }
  add(sum(centre, axis));
}

void touch_rounds(const PlacedSolid& a, const PlacedSolid& b, const Vec3l& d, std::int64_t margin,
                  RigidPoints& points) {
  const std::int64_t length_a = a.solid->size[1];
  const std::int64_t length_b = b.solid->size[1];
  const Vec3i& axis_a = a.axes[1];
  const Vec3i& axis_b = b.axes[1];
  const std::int64_t cosine = product(axis_a, axis_b) >> R::kAxisBits;
  const std::int64_t square = kOne - (cosine * cosine >> R::kAxisBits);
  const std::int64_t to_b = along(axis_a, d);  // of b's centre
  const std::int64_t to_a = -along(axis_b, d);
  std::int64_t s = 0;
  if (square > kParallel) {
    s = ((to_b + (cosine * to_a >> R::kAxisBits)) << R::kAxisBits) / square;
    s = std::clamp(s, -length_a, length_a);
  }
  const std::int64_t t = std::clamp(to_a + (cosine * s >> R::kAxisBits), -length_b, length_b);
  s = std::clamp(to_b + (cosine * t >> R::kAxisBits), -length_a, length_a);
  const Vec3l on_a = scaled(axis_a, s);
  const Vec3l apart = difference(on_a, sum(d, scaled(axis_b, t)));
  const std::int64_t radii = a.solid->size[0] + b.solid->size[0];
  if (is_far(apart, radii + margin)) return;
  const std::int64_t far = length_of(static_cast<std::uint64_t>(product(apart, apart)));
  if (far - radii >= margin) return;
  const Vec3l n = far == 0 ? Vec3l{0, std::int64_t{1} << R::kNormalBits, 0} : direction(apart, far);
  RigidPoint point{.n = {}, .gap = far - radii, .at = on_a};
  for (std::size_t i = 0; i < 3; ++i) {
    point.n[i] = static_cast<std::int32_t>(n[i]);
    point.at[i] -= n[i] * a.solid->size[0] >> R::kNormalBits;
  }
  points.add(point);
}

}  // namespace

void touch_solids(const PlacedSolid& a, const PlacedSolid& b, const Vec3l& d, std::int64_t margin,
                  RigidPoints& points) {
  const bool a_is_box = a.solid->kind == Solid::Kind::kBox;
  const bool b_is_box = b.solid->kind == Solid::Kind::kBox;
  if (a_is_box) {
    touch_round_and_box(b, a, d, {}, -1, margin, points);
  } else if (b_is_box) {
    touch_round_and_box(a, b, {-d[0], -d[1], -d[2]}, d, 1, margin, points);
  } else {
    touch_rounds(a, b, d, margin, points);
  }
}

}  // namespace tandem
