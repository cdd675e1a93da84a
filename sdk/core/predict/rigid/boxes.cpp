// Two boxes: the axis along which they are furthest apart, and by it the points of a face cut to the other
// box's face, or the two nearest points of edges.
#include <algorithm>
#include <utility>

#include "sdk/core/lattice/fixed_point.hpp"
#include "sdk/core/predict/rigid/touch.hpp"

namespace tandem {
namespace {

using L = RigidLaw;

constexpr std::int64_t kOne = std::int64_t{1} << L::kAxisBits;
constexpr std::int64_t kLeastSine = kOne >> 4;  // of edges that make an axis
// A face of b, or two edges, must be so much better, of the smallest half size.
constexpr unsigned kFaceShift = 13;
constexpr std::int64_t kEdgePart = 50;

std::int64_t magnitude(std::int64_t x) { return x < 0 ? -x : x; }
std::size_t next(std::size_t i) { return i == 2 ? 0 : i + 1; }

using Matrix = std::array<Vec3l, 3>;

// What a search for the axis needs of both boxes.
struct Boxes {
  const PlacedSolid& a;
  const PlacedSolid& b;
  Vec3l d;               // b's centre minus a's
  Matrix cosine{};       // of a's axis i and b's j
  Vec3l in_a{}, in_b{};  // d in their frames
};

struct Axis {
  std::int64_t apart = 0;
  std::size_t i = 0, j = 0;
};

// How far they are apart along axis i of a, or j of b.
std::int64_t apart_along_a(const Boxes& boxes, std::size_t i) {
  std::int64_t other = 0;
  for (std::size_t j = 0; j < 3; ++j) other += boxes.b.solid->size[j] * magnitude(boxes.cosine[i][j]);
  return magnitude(boxes.in_a[i]) - boxes.a.solid->size[i] - (other >> L::kAxisBits);
}
std::int64_t apart_along_b(const Boxes& boxes, std::size_t j) {
  std::int64_t other = 0;
  for (std::size_t i = 0; i < 3; ++i) other += boxes.a.solid->size[i] * magnitude(boxes.cosine[i][j]);
  return magnitude(boxes.in_b[j]) - boxes.b.solid->size[j] - (other >> L::kAxisBits);
}

// The face along which the other box's centre is furthest outside.
std::size_t outermost(const Vec3l& centre, const Vec3l& size) {
  std::size_t best = 0;
  for (std::size_t i = 1; i < 3; ++i)
    if (magnitude(centre[i]) - size[i] > magnitude(centre[best]) - size[best]) best = i;
  return best;
}

std::int64_t cosine_of(const Vec3i& a, const Vec3i& b) {
  return std::clamp(product(a, b) >> L::kAxisBits, -kOne, kOne);
}

// Fills the cosines and the rest of `boxes`, and the best face of both. False if some face keeps the boxes
// apart. The likeliest is tried before the rest is computed.
bool find_faces(Boxes& boxes, std::int64_t margin, Axis& of_a, Axis& of_b) {
  const PlacedSolid& a = boxes.a;
  const PlacedSolid& b = boxes.b;
  for (std::size_t i = 0; i < 3; ++i) boxes.in_a[i] = along(a.axes[i], boxes.d);
  const std::size_t likely = outermost(boxes.in_a, a.solid->size);
  for (std::size_t j = 0; j < 3; ++j) boxes.cosine[likely][j] = cosine_of(a.axes[likely], b.axes[j]);
  if (apart_along_a(boxes, likely) >= margin) return false;
  for (std::size_t i = 0; i < 3; ++i) {
    boxes.in_b[i] = along(b.axes[i], boxes.d);
    for (std::size_t j = 0; j < 3 && i != likely; ++j) boxes.cosine[i][j] = cosine_of(a.axes[i], b.axes[j]);
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const std::int64_t apart_a = apart_along_a(boxes, i);
    const std::int64_t apart_b = apart_along_b(boxes, i);
    if (apart_a >= margin || apart_b >= margin) return false;
    if (i == 0 || apart_a > of_a.apart) of_a = {apart_a, i, 0};
    if (i == 0 || apart_b > of_b.apart) of_b = {apart_b, i, 0};
  }
  return true;
}

struct EdgeAxis {
  bool found = false;
  Axis axis;
  std::int64_t sine = 0, along = 0;  // d along the axis, times the sine
};

// Finds the pair of edges along whose axis the boxes are furthest apart. Edges decide nothing unless that is
// more than `least`. Most are ruled out without a root and a quotient, which are slow: a sine is at most 1.
EdgeAxis edges_of(const Boxes& boxes, std::int64_t least, std::int64_t margin) {
  EdgeAxis best;
  const std::int64_t least_whole = least * (least < 0 ? kOne : kLeastSine);
  const Vec3l& a = boxes.a.solid->size;
  const Vec3l& b = boxes.b.solid->size;
  const Matrix& c = boxes.cosine;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t i1 = next(i);
    const std::size_t i2 = next(i1);
    for (std::size_t j = 0; j < 3; ++j) {
      const std::size_t j1 = next(j);
      const std::size_t j2 = next(j1);
      const std::int64_t along = boxes.in_a[i2] * c[i1][j] - boxes.in_a[i1] * c[i2][j];
      const std::int64_t both = a[i1] * magnitude(c[i2][j]) + a[i2] * magnitude(c[i1][j]) +
                                b[j1] * magnitude(c[i][j2]) + b[j2] * magnitude(c[i][j1]);
      if (magnitude(along) - both < least_whole) continue;
      const std::int64_t square = (kOne << L::kAxisBits) - c[i][j] * c[i][j];
      if (square < kLeastSine * kLeastSine) continue;
      const auto sine = static_cast<std::int64_t>(quick_root(static_cast<std::uint64_t>(square)));
      const std::int64_t apart = (magnitude(along) - both) / sine;
      if (best.found && apart <= best.axis.apart) continue;
      best = {true, {apart, i, j}, sine, along};
      if (apart >= margin) return best;
    }
  }
  return best;
}

// Corners of the face that is cut, in the frame of the other box: across, along, and above its face.
struct Corner {
  std::int64_t u, v, above;
};
struct Polygon {
  std::array<Corner, 8> corners;
  std::size_t count;
};

// Cuts off what is beyond `most` along one axis; `sign` -1: below -most. Swaps the two if anything is.
void cut(Polygon*& polygon, std::int64_t Corner::*at, std::int64_t sign, std::int64_t most, Polygon*& space) {
  constexpr unsigned kPartBits = 30;
  const Polygon& from = *polygon;
  std::size_t inside = 0;
  while (inside < from.count && sign * from.corners[inside].*at <= most) ++inside;
  if (inside == from.count) return;
  Polygon& kept = *space;
  kept.count = 0;
  for (std::size_t k = 0; k < from.count; ++k) {
    const Corner& one = from.corners[k];
    const Corner& other = from.corners[k + 1 == from.count ? 0 : k + 1];
    const std::int64_t x = sign * one.*at;
    const std::int64_t y = sign * other.*at;
    if (x <= most && kept.count < kept.corners.size()) kept.corners[kept.count++] = one;
    if ((x <= most) == (y <= most) || kept.count == kept.corners.size()) continue;
    const std::int64_t part = (magnitude(most - x) << kPartBits) / magnitude(y - x);
    const auto between = [part](std::int64_t a, std::int64_t b) { return a + ((b - a) * part >> kPartBits); };
    kept.corners[kept.count++] = {between(one.u, other.u), between(one.v, other.v),
                                  between(one.above, other.above)};
  }
  std::swap(polygon, space);
}

// Of more than four corners: the furthest along the two diagonals, and the lowest. Bits of those to keep.
std::uint32_t most_important(const Polygon& polygon) {
  if (polygon.count <= 4) return (1U << polygon.count) - 1;
  std::array<std::size_t, 5> best{};
  const auto value = [](const Corner& c, std::size_t what) {
    switch (what) {
      case 0:
        return c.u + c.v;
      case 1:
        return -c.u - c.v;
      case 2:
        return c.u - c.v;
      case 3:
        return c.v - c.u;
      default:
        return -c.above;
    }
  };
  std::uint32_t bits = 0;
  for (std::size_t what = 0; what < best.size(); ++what) {
    for (std::size_t k = 1; k < polygon.count; ++k) {
      if (value(polygon.corners[k], what) > value(polygon.corners[best[what]], what)) best[what] = k;
    }
    bits |= 1U << best[what];
  }
  return bits;
}

// By face k of `one`. `to_other`: the other's centre minus one's, in one's frame; `cosine` of one's axis i
// and the other's j; `at_one`: one's centre minus a's; `sign`: 1 if `one` is b.
struct Faces {
  const PlacedSolid& one;
  const PlacedSolid& other;
  Vec3l to_other;
  Matrix cosine;
  Vec3l at_one;
  std::int64_t sign;
};

void touch_faces(const Faces& faces, std::size_t k, std::int64_t margin, RigidPoints& points) {
  const Vec3l& half = faces.one.solid->size;
  const Vec3l& other = faces.other.solid->size;
  const Matrix& c = faces.cosine;
  const std::int64_t out = faces.to_other[k] < 0 ? -1 : 1;
  std::size_t j = 0;
  for (std::size_t i = 1; i < 3; ++i)
    if (magnitude(c[k][i]) > magnitude(c[k][j])) j = i;
  const std::int64_t towards = out * c[k][j] > 0 ? -1 : 1;
  const std::size_t j1 = next(j);
  const std::size_t j2 = next(j1);
  Vec3l centre{}, along{}, across{};
  for (std::size_t i = 0; i < 3; ++i) {
    centre[i] = faces.to_other[i] + towards * (other[j] * c[i][j] >> L::kAxisBits);
    along[i] = other[j1] * c[i][j1] >> L::kAxisBits;
    across[i] = other[j2] * c[i][j2] >> L::kAxisBits;
  }
  const std::size_t u = next(k);
  const std::size_t v = next(u);
  std::array<Polygon, 2> polygons;
  Polygon* polygon = polygons.data();
  Polygon* space = polygon + 1;
  polygon->count = 0;
  const auto add = [&](std::int64_t s, std::int64_t t) {
    const auto x = [&](std::size_t i) { return centre[i] + s * along[i] + t * across[i]; };
    polygon->corners[polygon->count++] = {x(u), x(v), out * x(k) - half[k]};
  };
  add(1, 1);
  add(-1, 1);
  add(-1, -1);
  add(1, -1);
  cut(polygon, &Corner::u, 1, half[u], space);
  cut(polygon, &Corner::u, -1, half[u], space);
  cut(polygon, &Corner::v, 1, half[v], space);
  cut(polygon, &Corner::v, -1, half[v], space);
  Polygon& near = *space;
  near.count = 0;
  for (std::size_t i = 0; i < polygon->count; ++i)
    if (polygon->corners[i].above < margin) near.corners[near.count++] = polygon->corners[i];
  const std::uint32_t kept = most_important(near);
  for (std::size_t i = 0; i < near.count; ++i) {
    if ((kept >> i & 1U) == 0) continue;
    const Corner& corner = near.corners[i];
    Vec3l x{};
    x[u] = corner.u;
    x[v] = corner.v;
    x[k] = out * (corner.above + half[k]);
    RigidPoint point{.n = {}, .gap = corner.above, .at = in_world(faces.one.axes, x)};
    constexpr unsigned kShift = L::kAxisBits - L::kNormalBits;
    for (std::size_t m = 0; m < 3; ++m) {
      const std::int64_t n = faces.sign * out * faces.one.axes[k][m];
      point.n[m] = static_cast<std::int32_t>((n + (1 << (kShift - 1))) >> kShift);
      point.at[m] += faces.at_one[m];
    }
    points.add(point);
  }
}

void touch_edges(const Boxes& boxes, const EdgeAxis& edges, RigidPoints& points) {
  const auto [apart, i, j] = edges.axis;
  const Vec3i& along_a = boxes.a.axes[i];
  const Vec3i& along_b = boxes.b.axes[j];
  RigidPoint point{.n = {}, .gap = apart, .at = {}};
  const std::int64_t sign = edges.along > 0 ? -1 : 1;
  for (std::size_t m = 0; m < 3; ++m) {
    const std::size_t m1 = next(m);
    const std::size_t m2 = next(m1);
    const std::int64_t cross =
        std::int64_t{along_a[m1]} * along_b[m2] - std::int64_t{along_a[m2]} * along_b[m1];
    point.n[m] = static_cast<std::int32_t>(sign * (cross >> (L::kAxisBits - L::kNormalBits)) / edges.sine);
  }
  Vec3l on_a{}, on_b{};  // in their frames
  for (std::size_t k = 0; k < 3; ++k) {
    if (k != i)
      on_a[k] = product(boxes.a.axes[k], point.n) > 0 ? -boxes.a.solid->size[k] : boxes.a.solid->size[k];
    if (k != j)
      on_b[k] = product(boxes.b.axes[k], point.n) > 0 ? boxes.b.solid->size[k] : -boxes.b.solid->size[k];
  }
  point.at = in_world(boxes.a.axes, on_a);
  Vec3l between = in_world(boxes.b.axes, on_b);
  for (std::size_t m = 0; m < 3; ++m) between[m] += boxes.d[m] - point.at[m];
  const std::int64_t cosine = boxes.cosine[i][j];
  const std::int64_t one = along(along_a, between);
  const std::int64_t other = -along(along_b, between);
  const std::int64_t square = kOne - (cosine * cosine >> L::kAxisBits);
  const std::int64_t half = boxes.a.solid->size[i];
  const std::int64_t place =
      std::clamp(((one + (cosine * other >> L::kAxisBits)) << L::kAxisBits) / square, -half, half);
  for (std::size_t m = 0; m < 3; ++m) point.at[m] += along_a[m] * place >> L::kAxisBits;
  points.add(point);
}

}  // namespace

void touch_boxes(const PlacedSolid& a, const PlacedSolid& b, const Vec3l& d, std::int64_t margin,
                 RigidPoints& points) {
  Boxes boxes{a, b, d, {}, {}, {}};
  Axis of_a, of_b;
  if (!find_faces(boxes, margin, of_a, of_b)) return;
  const Vec3l& x = a.solid->size;
  const Vec3l& y = b.solid->size;
  const std::int64_t smallest = std::min({x[0], x[1], x[2], y[0], y[1], y[2]});
  const bool is_b = of_b.apart > of_a.apart + (smallest >> kFaceShift);
  const std::int64_t face = (is_b ? of_b.apart : of_a.apart) + smallest / kEdgePart;
  const EdgeAxis edges = edges_of(boxes, std::min(face, margin - 1), margin);
  if (edges.found && edges.axis.apart >= margin) return;
  if (edges.found && edges.axis.apart > face) {
    touch_edges(boxes, edges, points);
  } else if (!is_b) {
    touch_faces({a, b, boxes.in_a, boxes.cosine, {}, -1}, of_a.i, margin, points);
  } else {
    Matrix turned{};
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j) turned[i][j] = boxes.cosine[j][i];
    touch_faces({b, a, {-boxes.in_b[0], -boxes.in_b[1], -boxes.in_b[2]}, turned, d, 1}, of_b.i, margin,
                points);
  }
}

}  // namespace tandem
