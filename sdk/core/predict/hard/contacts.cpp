#include "sdk/core/predict/hard/contacts.hpp"

#include <algorithm>
#include <array>
#include <bit>

#include "sdk/core/lattice/fixed_point.hpp"
#include "sdk/core/predict/contact/walls.hpp"

namespace tandem {
namespace {

using L = HardLaw;

constexpr std::uint32_t kNearShift = 5;
constexpr std::uint32_t kPairsAtOnce = 1024;
constexpr std::uint32_t kContactsPerBody = 10;

std::int64_t product(const Vec3i& a, const Vec3i& b) {
  return std::int64_t{a[0]} * b[0] + std::int64_t{a[1]} * b[1] + std::int64_t{a[2]} * b[2];
}

// The sum of the magnitudes of u in lattice units: bodies do not come nearer by more in a frame.
std::int64_t way_of(const Vec3i& u) {
  std::int64_t sum = 0;
  for (const std::int64_t x : u) sum += x < 0 ? -x : x;
  return sum >> 6;
}

// Sets the gap. Returns whether bodies that are `gap` lattice units apart along n, with the relative velocity
// u, touch in this frame.
bool touches(const HardReach& reach, std::int64_t gap, const Vec3i& u, HardContact& contact) {
  const std::int64_t closing = std::min<std::int64_t>(0, product(u, contact.n) >> 12);
  if (gap * 64 + closing >= std::int64_t{reach.reach} * 64) return false;
  contact.gap = limited(gap * 64 >> reach.shift, L::kMostGap);
  return true;
}

// The contact of two bodies; false if there is none.
bool meet(const HardReach& reach, const ContactBody& a, const ContactBody& b, HardContact& contact) {
  std::array<std::int64_t, 3> d{};
  Vec3i u{};
  std::uint64_t squared = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    d[i] = std::int64_t{a.p[i]} - b.p[i];
    u[i] = a.v[i] - b.v[i];
    squared += static_cast<std::uint64_t>(d[i] * d[i]);
  }
  const std::int64_t radii = std::int64_t{a.radius} + b.radius;
  const std::int64_t most = radii + reach.reach + way_of(u);
  if (squared >= static_cast<std::uint64_t>(most * most)) return false;
  const auto far = static_cast<std::int64_t>(square_root(squared));
  const std::int64_t inverse = far == 0 ? 0 : (std::int64_t{1} << 40) / far;
  contact.n = {0, L::kOne, 0};
  for (std::size_t i = 0; i < 3 && far > 0; ++i)
    contact.n[i] = static_cast<std::int32_t>((d[i] * inverse + (1 << 27)) >> 28);
  return touches(reach, far - radii, u, contact);
}

}  // namespace

HardContacts::HardContacts(std::uint32_t capacity, std::uint32_t grid_shift)
    : grid_shift_(grid_shift),
      kernels_(fastest_contact_kernels()),
      near_xy_(capacity + ContactOrder::kBeyond),
      later_xy_(near_xy_.size()),
      near_z_(near_xy_.size()),
      first_(kPairsAtOnce + ContactPairs::kMostAtOnce),
      second_(first_.size()),
      used_(capacity),
      contacts_(std::size_t{kContactsPerBody} * capacity),
      groups_(contacts_.size() / 4 + L::kWaves) {}

void HardContacts::find(const ContactConstants& constants, const HardReach& reach, const ContactOrder& order,
                        std::span<const ContactBody> bodies, std::span<const std::int32_t> mobility) {
  count_ = 0;
  std::fill(used_.begin(), used_.end(), 0U);
  find_pairs(reach, order, bodies, mobility);
  for (const auto& plane : constants.planes) find_walls(plane, reach, bodies, mobility);
  for (const auto& box : constants.boxes) find_walls(box, reach, bodies, mobility);
  for (const auto& ball : constants.balls) find_walls(ball, reach, bodies, mobility);
  group(static_cast<std::uint32_t>(bodies.size()));
}

void HardContacts::find_pairs(const HardReach& reach, const ContactOrder& order,
                              std::span<const ContactBody> bodies, std::span<const std::int32_t> mobility) {
  for (std::size_t place = 0; place < bodies.size(); ++place) {
    const ContactBody& body = bodies[place];
    const auto packed = [shift = grid_shift_ + kNearShift](std::int32_t x, std::int32_t y) {
      return (static_cast<std::uint32_t>(x >> shift) & 0xFFFFU) | static_cast<std::uint32_t>(y >> shift)
                                                                      << 16U;
    };
    const auto later = [&body](std::size_t i) { return body.p[i] + (body.v[i] >> 6); };
    near_xy_[place] = packed(body.p[0], body.p[1]);
    later_xy_[place] = packed(later(0), later(1));
    near_z_[place] = packed(body.p[2], later(2));
  }
  const auto near =
      static_cast<std::uint32_t>((2 * reach.largest_radius + reach.reach) >> (grid_shift_ + kNearShift)) + 3;
  const ContactGrid grid{order.side_bits(), order.begin().data(), order.place_cell().data(),
                         near_xy_.data(),   later_xy_.data(),     near_z_.data(),
                         near * near};
  for (std::uint32_t place = 0; place < order.begin().back();) {
    ContactPairs pairs{first_.data(), second_.data(), 0};
    place = kernels_.find(grid, place, kPairsAtOnce, pairs);
    for (std::uint32_t i = 0; i < pairs.count; ++i) {
      HardContact contact{.a = first_[i], .b = second_[i], .n = {}, .gap = 0, .share = 0, .wave = 0};
      const std::int64_t of_a = mobility[contact.a];
      const std::int64_t of_b = mobility[contact.b];
      if (of_a + of_b == 0 || !meet(reach, bodies[contact.a], bodies[contact.b], contact)) continue;
      contact.share = of_a == of_b ? L::kOne / 2 : static_cast<std::int32_t>(of_a * L::kOne / (of_a + of_b));
      add(contact, 0, L::kPairWaves, mobility);
    }
  }
}

template <class Shape>
void HardContacts::find_walls(const Shape& shape, const HardReach& reach, std::span<const ContactBody> bodies,
                              std::span<const std::int32_t> mobility) {
  const auto nobody = static_cast<std::uint32_t>(bodies.size());
  for (std::uint32_t place = 0; place < nobody; ++place) {
    if (mobility[place] == 0) continue;
    const ContactBody& body = bodies[place];
    const std::int64_t radius = std::int64_t{body.radius} + reach.wall;
    const std::int32_t most = limited(radius + reach.reach + way_of(body.v), kPositionLimit);
    const WallTouch near = touch(shape, body.p, most);
    if (near.overlap <= 0) continue;
    HardContact contact{.a = place, .b = nobody, .n = {}, .gap = 0, .share = L::kOne, .wave = 0};
    for (std::size_t i = 0; i < 3; ++i) contact.n[i] = std::clamp((near.out[i] + 2) >> 2, -L::kOne, L::kOne);
    if (touches(reach, most - near.overlap - radius, body.v, contact))
      add(contact, L::kPairWaves, L::kWaves, mobility);
  }
}

// The wave of a contact is the first in which both bodies have none yet.
void HardContacts::add(HardContact contact, std::uint32_t least_wave, std::uint32_t most_wave,
                       std::span<const std::int32_t> mobility) {
  const bool has_b = contact.b < mobility.size() && mobility[contact.b] != 0;
  const bool has_a = mobility[contact.a] != 0;
  std::uint32_t used = (std::uint32_t{1} << least_wave) - 1;
  if (has_a) used |= used_[contact.a];
  if (has_b) used |= used_[contact.b];
  contact.wave = static_cast<std::uint32_t>(std::countr_one(used));
  if (contact.wave >= most_wave || count_ == contacts_.size()) return;
  const std::uint32_t bit = std::uint32_t{1} << contact.wave;
  if (has_a) used_[contact.a] |= bit;
  if (has_b) used_[contact.b] |= bit;
  contacts_[count_++] = contact;
}

void HardContacts::group(std::uint32_t nobody) {
  std::array<std::uint32_t, L::kWaves> count{};
  for (const HardContact& contact : all()) ++count[contact.wave];
  std::array<std::uint32_t, L::kWaves> next{};
  group_count_ = 0;
  for (std::size_t wave = 0; wave < L::kWaves; ++wave) {
    next[wave] = 4 * group_count_;
    group_count_ += (count[wave] + 3) / 4;
  }
  for (const HardContact& contact : all()) {
    const std::uint32_t at = next[contact.wave]++;
    put_contact(contact, groups_[at / 4], at % 4);
  }
  // The last group of a wave is filled with contacts that never push.
  const HardContact none{
      .a = nobody, .b = nobody, .n = {0, L::kOne, 0}, .gap = L::kMostGap, .share = 0, .wave = 0};
  for (const std::uint32_t end : next) {
    for (std::uint32_t at = end; at % 4 != 0; ++at) put_contact(none, groups_[at / 4], at % 4);
  }
}

}  // namespace tandem
