#include "sdk/core/predict/contact/walls.hpp"

#include <algorithm>
#include <array>
#include <bit>

#include "sdk/core/lattice/fixed_point.hpp"
#include "sdk/core/lattice/vector_clones.hpp"
#include "sdk/core/predict/contact/law.hpp"

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

// The squared length of a vector whose components are at most 2^31.
std::uint64_t squared(const Vec3l& d) {
  std::uint64_t sum = 0;
  for (const std::int64_t x : d) sum += static_cast<std::uint64_t>(x * x);
  return sum;
}

constexpr std::size_t kBlock = 64;

using Slab = ContactWalls::Slab;

std::int64_t product(const Vec3i& a, const Vec3i& b) {
  return std::int64_t{a[0]} * b[0] + std::int64_t{a[1]} * b[1] + std::int64_t{a[2]} * b[2];
}

// Adds the slabs of the region where a body of radius `r` may touch: for every body that does, low <= normal
// . p <= high. Everything stays below 2^63: |normal . p| <= 3 * 2^60, and the limits are at most 4.1 * 2^60.
void add_slabs(const ContactConstants::Plane& plane, std::int64_t r, std::vector<Slab>& slabs) {
  slabs.push_back({plane.normal, -(std::int64_t{1} << 62), (plane.offset + r) * (1 << 30)});
}

void add_slabs(const ContactConstants::Box& box, std::int64_t r, std::vector<Slab>& slabs) {
  for (std::size_t i = 0; i < 3; ++i) {
    const std::int64_t centre = product(box.axes[i], box.centre);
    const std::int64_t reach = (box.half[i] + r) * (1 << 30);
    slabs.push_back({box.axes[i], centre - reach, centre + reach});
  }
}

void add_slabs(const ContactConstants::Ball& ball, std::int64_t r, std::vector<Slab>& slabs) {
  for (std::size_t i = 0; i < 3; ++i) {
    Slab slab;
    slab.normal[i] = 1 << 30;
    slab.low = (ball.centre[i] - (ball.radius + r)) * (1 << 30);
    slab.high = (ball.centre[i] + (ball.radius + r)) * (1 << 30);
    slabs.push_back(slab);
  }
}

// The box around a block of bodies.
struct Extent {
  Vec3i low{}, high{};
};

bool meets(const Slab& slab, const Extent& extent) {
  std::int64_t least = 0;
  std::int64_t most = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::int64_t n = slab.normal[i];
    least += n * (n < 0 ? extent.high[i] : extent.low[i]);
    most += n * (n < 0 ? extent.low[i] : extent.high[i]);
  }
  return most >= slab.low && least <= slab.high;
}

// Finds which of 64 bodies lie within all slabs; the first body is the lowest bit.
TANDEM_VECTOR_CLONES std::uint64_t within(const Slab* slabs, std::size_t count, const std::int32_t* x,
                                          const std::int32_t* y, const std::int32_t* z) {
  std::uint64_t all = ~std::uint64_t{0};
  for (std::size_t s = 0; s < count && all != 0; ++s) {
    const Slab slab = slabs[s];
    std::uint64_t outside = 0;
    for (std::size_t k = 0; k < kBlock; ++k) {
      const std::int64_t along = std::int64_t{slab.normal[0]} * x[k] + std::int64_t{slab.normal[1]} * y[k] +
                                 std::int64_t{slab.normal[2]} * z[k];
      outside |= (static_cast<std::uint64_t>((along - slab.low) | (slab.high - along)) >> 63U) << k;
    }
    all &= ~outside;
  }
  return all;
}

}  // namespace

// The positions of up to 64 consecutive bodies.
struct PlacesOf64 {
  std::size_t first = 0;
  std::uint64_t present = 0;
  Extent extent;
  std::array<std::array<std::int32_t, kBlock>, 3> p{};
};

ContactWalls::ContactWalls(const ContactConstants& constants, const ContactLaw& law,
                           std::int32_t largest_radius)
    : constants_(constants), law_(law) {
  for (const auto& plane : constants.planes) add_slabs(plane, largest_radius, planes_);
  for (const auto& box : constants.boxes) add_slabs(box, largest_radius, boxes_);
  for (const auto& ball : constants.balls) add_slabs(ball, largest_radius, balls_);
}

template <class Shape>
void ContactWalls::add_shapes(std::span<const Shape> shapes, std::span<const Slab> slabs,
                              const PlacesOf64& places, std::span<const ContactBody> bodies,
                              std::span<ContactForce> forces) const {
  constexpr std::int32_t kOne = 1 << 12;
  const std::size_t each = shapes.empty() ? 0 : slabs.size() / shapes.size();
  for (std::size_t s = 0; s < shapes.size(); ++s) {
    const auto own = slabs.subspan(s * each, each);
    if (!std::all_of(own.begin(), own.end(), [&](const Slab& slab) { return meets(slab, places.extent); }))
      continue;
    std::uint64_t near =
        within(own.data(), each, places.p[0].data(), places.p[1].data(), places.p[2].data()) & places.present;
    for (; near != 0; near &= near - 1) {
      const std::size_t place = places.first + static_cast<std::size_t>(std::countr_zero(near));
      const ContactBody& body = bodies[place];
      const WallTouch t = touch(shapes[s], body.p, body.radius);
      if (t.overlap <= 0) continue;
      Vec3i n{};
      Vec3i u{};
      for (std::size_t i = 0; i < 3; ++i) {
        n[i] = std::clamp(-t.out[i] >> 2, -kOne, kOne);
        u[i] = -contact_speed(law_, body.v[i]);
      }
      const auto overlap =
          static_cast<std::int32_t>(std::min<std::int64_t>(t.overlap >> law_.shift, kMaxOverlap));
      const Vec3i f = contact_force(law_, overlap, n, u);
      for (std::size_t i = 0; i < 3; ++i) forces[place].f[i] += f[i];
    }
  }
}

void ContactWalls::add_forces(std::span<const ContactBody> bodies, std::span<ContactForce> forces) const {
  using C = ContactConstants;
  PlacesOf64 places;
  for (std::size_t first = 0; first < bodies.size(); first += kBlock) {
    const std::size_t count = std::min(kBlock, bodies.size() - first);
    places.first = first;
    places.present = ~std::uint64_t{0} >> (kBlock - count);
    Extent extent{bodies[first].p, bodies[first].p};
    for (std::size_t k = 0; k < count; ++k) {
      for (std::size_t i = 0; i < 3; ++i) {
        const std::int32_t p = bodies[first + k].p[i];
        places.p[i][k] = p;
        extent.low[i] = std::min(extent.low[i], p);
        extent.high[i] = std::max(extent.high[i], p);
      }
    }
    places.extent = extent;
    add_shapes<C::Plane>(constants_.planes, planes_, places, bodies, forces);
    add_shapes<C::Box>(constants_.boxes, boxes_, places, bodies, forces);
    add_shapes<C::Ball>(constants_.balls, balls_, places, bodies, forces);
  }
}

WallTouch touch(const ContactConstants::Plane& plane, const Vec3i& p, std::int32_t radius) {
  const std::int64_t height = height_above(plane, p);
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
  const std::int64_t distance = length_of(squared(d));
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
  if (inside) {    // out through the nearest face; among equal ones the first
    std::size_t nearest = 0;
    Vec3l depth{};
    for (std::size_t i = 0; i < 3; ++i) {
      depth[i] = box.half[i] - (local[i] < 0 ? -local[i] : local[i]);
      if (depth[i] < depth[nearest]) nearest = i;
    }
    normal[nearest] = local[nearest] < 0 ? -(1 << 14) : 1 << 14;
    result.overlap = radius + depth[nearest];
  } else {
    const std::int64_t distance = length_of(squared(outside));
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
