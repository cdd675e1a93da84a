#include "sdk/core/predict/field_walls.hpp"

#include <algorithm>

#include "sdk/core/lattice/fixed_point.hpp"
#include "sdk/core/lattice/vector_clones.hpp"
#include "sdk/core/predict/contact_walls.hpp"

namespace tandem {
namespace {

constexpr std::size_t kTogether = 128;  // slots whose nearness is looked at at once

// The sign says whether a body is below `height`: normal . p - height, in 2^-30.
TANDEM_VECTOR_CLONES void look_at_plane(const std::int32_t* __restrict x, const std::int32_t* __restrict y,
                                        const std::int32_t* __restrict z, std::int64_t* __restrict near,
                                        std::size_t count, const Vec3i& normal, std::int64_t height) {
  const std::int32_t a = normal[0];
  const std::int32_t b = normal[1];
  const std::int32_t c = normal[2];
  for (std::size_t s = 0; s < count; ++s)
    near[s] |= std::int64_t{x[s]} * a + std::int64_t{y[s]} * b + std::int64_t{z[s]} * c - height;
}

// The sign says whether a body is nearer than `reach` on each axis.
TANDEM_VECTOR_CLONES void look_at_bound(const std::int32_t* __restrict x, const std::int32_t* __restrict y,
                                        const std::int32_t* __restrict z, std::int64_t* __restrict near,
                                        std::size_t count, const Vec3i& centre, std::int64_t reach) {
  const std::int64_t a = centre[0];
  const std::int64_t b = centre[1];
  const std::int64_t c = centre[2];
  for (std::size_t s = 0; s < count; ++s) {
    const std::int64_t i = x[s] - a;
    const std::int64_t j = y[s] - b;
    const std::int64_t k = z[s] - c;
    near[s] |= (i - reach) & (-i - reach) & (j - reach) & (-j - reach) & (k - reach) & (-k - reach);
  }
}

}  // namespace

FieldWalls::FieldWalls(const ContactConstants& world, const ContactMaterial& gains, std::uint32_t capacity)
    : world_(&world), gains_(gains), near_(capacity + 1) {
  for (const auto& type : world.types) largest_radius_ = std::max(largest_radius_, type.radius);
  for (const auto& box : world.boxes) {
    // Axes may be longer than 1 in a hostile world; a body is near where the box has it near.
    std::int64_t reach = largest_radius_ + 1;
    for (const std::int32_t half : box.half) reach += half;
    bounds_.push_back({box.centre, reach});
  }
  for (const auto& ball : world.balls)
    bounds_.push_back({ball.centre, std::int64_t{ball.radius} + largest_radius_});
}

std::uint32_t FieldWalls::find_near(const State& state) {
  std::uint32_t count = 0;
  for (std::uint32_t first = 0; first < state.capacity(); first += kTogether) {
    const std::size_t slots = std::min<std::size_t>(kTogether, state.capacity() - first);
    const std::int32_t* const x = state.p(0).data() + first;
    const std::int32_t* const y = state.p(1).data() + first;
    const std::int32_t* const z = state.p(2).data() + first;
    std::array<std::int64_t, kTogether> near{};
    for (const auto& plane : world_->planes) {
      const std::int64_t height = (std::int64_t{plane.offset} + largest_radius_) * (1 << 30);
      look_at_plane(x, y, z, near.data(), slots, plane.normal, height);
    }
    for (const Bound& bound : bounds_) look_at_bound(x, y, z, near.data(), slots, bound.centre, bound.reach);
    for (std::uint32_t s = 0; s < slots; ++s) {
      near_[count] = first + s;
      count += static_cast<std::uint32_t>(near[s] < 0) & state.alive()[first + s];
    }
  }
  return count;
}

template <class Shape>
void FieldWalls::add(const Shape& shape, const Vec3i& p, const Vec3i& v, std::int32_t radius,
                     std::array<std::int64_t, 3>& sum) const {
  const WallTouch t = touch(shape, p, radius);
  if (t.overlap <= 0) return;
  std::int64_t closing = 0;
  for (std::size_t i = 0; i < 3; ++i) closing -= std::int64_t{v[i]} * t.out[i];
  const std::int64_t push = (gains_.spring * t.overlap >> 8) - (gains_.shear * (closing >> 14) >> 13);
  const std::int64_t drag = std::int64_t{gains_.damping} + gains_.shear;
  for (std::size_t i = 0; i < 3; ++i) sum[i] += (push * t.out[i] >> 14) - (drag * v[i] >> 13);
}

void FieldWalls::add_forces(const State& state, const std::array<std::span<std::int32_t>, 3>& force) {
  const std::uint32_t count = find_near(state);
  for (const Slot s : std::span(near_).first(count)) {
    const Vec3i p{state.p(0)[s], state.p(1)[s], state.p(2)[s]};
    const Vec3i v{state.v(0)[s], state.v(1)[s], state.v(2)[s]};
    const std::int32_t radius =
        world_->types[std::min<std::size_t>(state.type()[s], world_->types.size() - 1)].radius;
    std::array<std::int64_t, 3> sum{};
    for (const auto& plane : world_->planes) add(plane, p, v, radius, sum);
    for (const auto& box : world_->boxes) add(box, p, v, radius, sum);
    for (const auto& ball : world_->balls) add(ball, p, v, radius, sum);
    for (std::size_t i = 0; i < 3; ++i) force[i][s] += limited(sum[i], kVelocityLimit);
  }
}

}  // namespace tandem
