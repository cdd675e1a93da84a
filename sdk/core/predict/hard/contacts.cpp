#include "sdk/core/predict/hard/contacts.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <utility>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/lattice/fixed_point.hpp"
#include "sdk/core/predict/contact/walls.hpp"
#include "sdk/core/predict/words/lanes.hpp"

namespace tandem {
namespace {

using L = HardLaw;

constexpr std::uint32_t kNearShift = 5;
constexpr std::uint32_t kPairsAtOnce = 1024;
constexpr std::uint32_t kContactsPerBody = 10;
constexpr std::uint32_t kRuns = 2;      // of a wave
constexpr std::uint32_t kInBlock = 32;  // bodies

// The sum of the magnitudes of v in lattice units: nothing comes nearer by more in a frame.
std::int32_t way_of(const Vec3i& v) {
  std::int32_t sum = 0;
  for (const std::int32_t x : v) sum += x < 0 ? -x : x;
  return sum >> 6;
}

using Block = HardContacts::Block;

// True if no body of the block touches.
bool misses(const ContactConstants::Plane& plane, const Block& block) {
  std::int64_t least = 0;
  for (std::size_t i = 0; i < 3; ++i)
    least += std::int64_t{plane.normal[i]} * (plane.normal[i] < 0 ? block.high[i] : block.low[i]);
  return (least >> 30) - plane.offset >= block.longest;
}
bool misses(const auto& /*shape*/, const Block& /*block*/) { return false; }

}  // namespace

HardContacts::HardContacts(std::uint32_t capacity, std::uint32_t grid_shift, const HardMachine& machine)
    : grid_shift_(grid_shift),
      pair_kernels_(machine.pairs),
      meet_(machine.meet),
      kernels_(machine.solver),
      near_xy_(capacity + ContactOrder::kBeyond),
      later_xy_(near_xy_.size()),
      near_z_(near_xy_.size()),
      first_(kPairsAtOnce + ContactPairs::kMaxAtOnce),
      second_(first_.size()),
      used_(capacity),
      longest_(capacity),
      blocks_(capacity / kInBlock + 1),
      contacts_(std::size_t{kContactsPerBody} * capacity + first_.size()),
      by_run_(std::size_t{kContactsPerBody} * capacity + std::size_t{L::kWaves} * HardGroup::kContacts),
      groups_(by_run_.size() / HardGroup::kContacts) {}

void HardContacts::find(const ContactConstants& constants, const HardReach& reach, const ContactOrder& order,
                        std::span<const ContactBody> bodies, std::span<const std::int32_t> mobility) {
  count_ = 0;
  std::fill(used_.begin(), used_.end(), 0U);
  enclose_blocks(reach, bodies);
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
  const ContactGrid grid{order.bits(),    order.begin().data(), order.place_cell().data(),
                         near_xy_.data(), later_xy_.data(),     near_z_.data(),
                         near * near};
  const bool any_fixed = std::find(mobility.begin(), mobility.end(), 0) != mobility.end();
  for (std::uint32_t place = 0; place < order.begin().back();) {
    ContactPairs pairs{first_.data(), second_.data(), 0};
    place = pair_kernels_.find(grid, place, kPairsAtOnce, pairs);
    // The kernels write some pairs and contacts beyond the last.
    TANDEM_ASSERT(pairs.count + 8 <= first_.size() && count_ + pairs.count + 4 <= contacts_.size());
    add_pairs(meet_(reach, {bodies.data(), mobility.data(), any_fixed}, pairs, &contacts_[count_]), mobility);
  }
}

// Gives waves to `count` contacts of pairs, which stand behind the last contact. The loop reads nothing of
// this object, because the compiler would read it again after every write.
void HardContacts::add_pairs(std::uint32_t count, std::span<const std::int32_t> mobility) {
  const std::int32_t* const mobility_of = mobility.data();
  std::uint32_t* const used = used_.data();
  HardContact* to = &contacts_[count_];
  const HardContact* const end = contacts_.data() + std::size_t{kContactsPerBody} * used_.size();
  const HardContact* const last = to + count;
  for (const HardContact* from = to; from != last && to != end; ++from) {
    if (to != from) *to = *from;
    const std::int64_t of_a = mobility_of[to->a];
    const std::int64_t of_b = mobility_of[to->b];
    const auto share = [all = of_a + of_b](std::int64_t of) {
      return static_cast<std::int16_t>(std::min<std::int64_t>(of * L::kWhole / all, L::kMaxWord));
    };
    if (of_a == of_b) {
      to->share = {L::kHalf, L::kHalf};
    } else {
      to->share = {share(of_a), share(of_b)};
    }
    // No wave is marked for bodies that contacts do not change.
    const std::uint32_t used_a = used[to->a];
    const std::uint32_t used_b = used[to->b];
    const auto wave = static_cast<std::uint32_t>(std::countr_one(used_a | used_b));
    if (wave >= L::kPairWaves) continue;
    const std::uint32_t bit = std::uint32_t{1} << wave;
    used[to->a] = used_a | (of_a != 0 ? bit : 0U);
    used[to->b] = used_b | (of_b != 0 ? bit : 0U);
    to->run += kRuns * wave;
    ++to;
  }
  count_ = static_cast<std::uint32_t>(to - contacts_.data());
}

void HardContacts::enclose_blocks(const HardReach& reach, std::span<const ContactBody> bodies) {
  const std::int32_t all = reach.wall + reach.reach;
  for (std::size_t first = 0; first < bodies.size(); first += kInBlock) {
    Four low = load<Four>(bodies[first].p);  // and the radius, which does not count
    Four high = low;
    std::int32_t most = 0;
    for (std::size_t place = first; place < std::min(first + kInBlock, bodies.size()); ++place) {
      const ContactBody& body = bodies[place];
      const Four p = load<Four>(body.p);
      low = at_most(low, p);
      high = at_least(high, p);
      longest_[place] = body.radius + all + way_of(body.v);
      most = std::max(most, longest_[place]);
    }
    blocks_[first / kInBlock] = {{low[0], low[1], low[2]}, {high[0], high[1], high[2]}, most};
  }
}

template <class Shape>
void HardContacts::find_walls(const Shape& shape, const HardReach& reach, std::span<const ContactBody> bodies,
                              std::span<const std::int32_t> mobility) {
  const auto nobody = static_cast<std::uint32_t>(bodies.size());
  for (std::uint32_t place = 0; place < nobody; ++place) {
    if (place % kInBlock == 0 && misses(shape, blocks_[place / kInBlock])) {
      place += kInBlock - 1;
      continue;
    }
    if (mobility[place] == 0) continue;
    const ContactBody& body = bodies[place];
    const std::int32_t most = longest_[place];
    const WallTouch near = touch(shape, body.p, most);
    if (near.overlap <= 0) continue;
    HardContact& contact = contacts_[count_];
    Vec3i n{};
    for (std::size_t i = 0; i < 3; ++i) n[i] = std::clamp((near.out[i] + 2) >> 2, -L::kOne, L::kOne);
    const std::int64_t radius = std::int64_t{body.radius} + reach.wall;
    if (!hard_touches(reach, most - near.overlap - radius, n, body.v, contact)) continue;
    constexpr std::uint32_t kOfPairs = (std::uint32_t{1} << L::kPairWaves) - 1;
    const auto wave = static_cast<std::uint32_t>(std::countr_one(used_[place] | kOfPairs));
    if (wave >= L::kWaves || count_ == kContactsPerBody * used_.size()) continue;
    contact.a = place;
    contact.b = nobody;
    contact.share = {L::kMaxWord, 0};
    contact.run += kRuns * wave;
    used_[place] |= std::uint32_t{1} << wave;
    ++count_;
  }
}

void HardContacts::group(std::uint32_t nobody) {
  constexpr std::size_t kEach = HardGroup::kContacts;
  std::array<std::uint32_t, std::size_t{kRuns} * L::kWaves> next{};
  for (const HardContact& contact : all()) ++next[contact.run];
  std::uint32_t end = 0;
  for (std::uint32_t wave = 0; wave < L::kWaves; ++wave) {
    for (std::uint32_t run = kRuns * wave; run < kRuns * (wave + 1); ++run)
      end += std::exchange(next[run], end);
    // The last group of a wave is filled with contacts that never push.
    while (end % kEach != 0) by_run_[end++] = count_;
  }
  TANDEM_ASSERT(end <= by_run_.size() && count_ < contacts_.size());
  for (std::uint32_t i = 0; i < count_; ++i) by_run_[next[contacts_[i].run]++] = i;
  contacts_[count_] = {.a = nobody,
                       .b = nobody,
                       .n = {0, L::kOne, 0},
                       .gap = L::kMaxWord,
                       .share = {L::kHalf, L::kHalf},
                       .run = 0};
  group_count_ = end / kEach;
  kernels_.put(contacts_.data(), by_run_.data(), groups_.data(), group_count_);
}

}  // namespace tandem
