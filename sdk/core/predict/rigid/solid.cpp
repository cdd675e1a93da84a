#include "sdk/core/predict/rigid/solid.hpp"

#include <algorithm>

#include "sdk/core/lattice/fixed_point.hpp"

namespace tandem {
namespace {

using R = RigidLaw;

}  // namespace

SizedSolid sized(const Solid& solid, std::int32_t longer, std::int32_t rounding) {
  SizedSolid of{.kind = solid.kind, .size = {}, .radius = 1, .rounding = 0, .inverse = {}};
  Vec3l size{};
  for (std::size_t i = 0; i < 3; ++i) {
    const std::int64_t x = solid.size[i];
    if (x != 0) size[i] = std::clamp<std::int64_t>(x + share_of(x, longer), 1, Solid::kMaxSize);
    of.size[i] = size[i] << R::kLengthBits;
  }
  Vec3l box = size;
  if (solid.kind == Solid::Kind::kRound) {
    of.radius = size[0] + size[1];
    box = {size[0], size[1] + size[0], size[0]};
  } else {
    of.radius = static_cast<std::int64_t>(square_root(static_cast<std::uint64_t>(product(size, size)))) + 1;
  }
  if (solid.kind == Solid::Kind::kBox)
    of.rounding = share_of(std::min({of.size[0], of.size[1], of.size[2]}), rounding);
  const std::int64_t square = of.radius * of.radius;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::int64_t y = box[(i + 1) % 3];
    const std::int64_t z = box[(i + 2) % 3];
    const std::int64_t across = std::max<std::int64_t>(1, (y * y + z * z) >> R::kInertiaBits);
    of.inverse[i] = std::min(3 * square / across, R::kMaxInertia);
  }
  // A ball: 5/2.
  if (solid.kind == Solid::Kind::kRound && size[1] == 0) of.inverse.fill(5 << (R::kInertiaBits - 1));
  return of;
}

std::array<Vec3i, 3> axes_of(const Quaternion& q) {
  const auto [x, y, z, w] = std::array<std::int64_t, 4>{q[0], q[1], q[2], q[3]};
  // Twice a product of two components: 2^-59 become 2^-24.
  constexpr unsigned kShift = 60 - 1 - R::kAxisBits;
  const auto axis = [](std::int64_t sum) {
    return static_cast<std::int32_t>((sum + (std::int64_t{1} << (kShift - 1))) >> kShift);
  };
  constexpr std::int64_t kOne = std::int64_t{1} << 59;
  return {{{axis(kOne - y * y - z * z), axis(x * y + w * z), axis(x * z - w * y)},
           {axis(x * y - w * z), axis(kOne - x * x - z * z), axis(y * z + w * x)},
           {axis(x * z + w * y), axis(y * z - w * x), axis(kOne - x * x - y * y)}}};
}

Inertia inertia_of(const PlacedSolid& placed) {
  constexpr std::array<std::array<std::size_t, 2>, 6> kOf{{{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {2, 0}}};
  constexpr unsigned kShift = 2 * R::kAxisBits - 12;
  Inertia sum{};
  for (std::size_t m = 0; m < sum.size(); ++m) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3i& axis = placed.axes[k];
      sum[m] += (std::int64_t{axis[kOf[m][0]]} * axis[kOf[m][1]] >> kShift) * placed.solid->inverse[k];
    }
    sum[m] >>= 12;
  }
  return sum;
}

}  // namespace tandem
