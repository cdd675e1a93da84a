// The predictor `hard`: projection of velocities in sub-steps, after M. Macklin et al., "Small Steps in
// Physics Simulation" (2019), and the solver of box2d 3. Normals are found once a frame, impulses are
// accumulated, and a speed in proportion to the overlap pushes bodies out of each other.
#include "sdk/core/predict/hard/hard.hpp"

#include <algorithm>
#include <bit>
#include <utility>

#include "sdk/core/lattice/fixed_point.hpp"
#include "sdk/core/predict/rest.hpp"

namespace tandem {
namespace {

using L = HardLaw;

constexpr std::uint32_t kGridBits = 14;
constexpr std::uint32_t kUnitBits = 11;                   // of the threshold a frame, in the solver's unit
constexpr std::int32_t kSlopShare = 10, kCalmShare = 10;  // of the threshold
constexpr std::int32_t kLargestRadius = 1 << 25;
constexpr std::uint8_t kSlow = 1, kTouched = 2, kTouchedTwice = 4, kByRestless = 8;

std::int32_t largest_of(const std::vector<ContactConstants::Type>& types) {
  std::int32_t largest = 1;
  for (const auto& type : types) largest = std::max(largest, type.radius);
  return largest;
}

std::uint32_t grid_shift_for(std::int32_t radius) {
  const auto bits = static_cast<std::uint32_t>(std::bit_width(2 * static_cast<std::uint32_t>(radius)));
  return bits > kGridBits ? bits - kGridBits : 0;
}

}  // namespace

Hard::Hard(std::uint32_t capacity, ContactConstants constants)
    : constants_(std::move(constants)),
      types_(constants_.types),
      grid_shift_(grid_shift_for(largest_of(types_))),
      order_(capacity),
      contacts_(capacity, grid_shift_),
      sleep_(capacity, order_.protocol_bits()),
      w_(capacity + 1),
      moved_(capacity + 1),
      fall_(capacity + 1),
      change_(capacity),
      mobility_(capacity),
      held_(capacity),
      signs_(capacity + 1),
      still_(capacity, {}) {}

void Hard::set_radii(const StepInput& input) {
  const std::int64_t threshold = std::int64_t{input.threshold} * 64;
  const auto bits = static_cast<std::uint32_t>(std::bit_width(static_cast<std::uint64_t>(threshold)));
  for (std::size_t i = 0; i < types_.size(); ++i) {
    const std::int32_t radius = constants_.types[i].radius;
    const std::int64_t longer = radius + share_of(radius, input.parameters.contacts.radius);
    types_[i].radius = static_cast<std::int32_t>(std::clamp<std::int64_t>(longer, 1, kLargestRadius));
  }
  reach_.shift = bits > kUnitBits ? bits - kUnitBits : 0;
  reach_.largest_radius = largest_of(types_);
  reach_.reach = std::min(input.threshold, reach_.largest_radius);
  reach_.met = 2 * threshold / kSlopShare;
  reach_.wall = input.parameters.contacts.wall;
}

void Hard::load(const State& from, const State& to, const StepInput& input) {
  const std::int32_t width = (2 * reach_.largest_radius + reach_.reach) >> grid_shift_;
  const auto cells_per = static_cast<std::int32_t>((std::int64_t{1} << 32) / (width + 1));
  ContactOrder::Input order{from, types_, {grid_shift_, cells_per}, {}};
  // Any change of gravity may move a heap.
  any_sleeps_ =
      input.gravity_before == input.drive.gravity && sleep_.find(from, to.rest(), order_.number(order));
  if (any_sleeps_) order.left_out = sleep_.left_out();
  const std::span<ContactBody> bodies = order_.sort(order);
  bodies_ = bodies;
  for (std::size_t place = 0; place < bodies.size(); ++place) {
    ContactBody& body = bodies[place];
    const bool still = to.rest()[body.slot] != 0 || (any_sleeps_ && sleep_.asleep()[body.slot] != 0);
    held_[place] = still ? 1 : 0;
    if (still) body.v = {};
    mobility_[place] = still ? 0 : constants_.type_of(from.type()[body.slot]).mobility;
    signs_[place] = still ? kSlow : std::uint8_t{0};
    for (std::size_t i = 0; i < 3; ++i) {
      const std::int32_t v = body.v[i];
      std::int64_t next = std::int64_t{v} + input.drive.gravity[i] + from.c(i)[body.slot];
      next -= share_of(next, input.drive.damping);
      const std::int32_t change = still ? 0 : limited(next, kVelocityLimit) - v;
      change_[place][i] = change;
      w_[place].of[i] = limited(v >> reach_.shift, L::kMostSpeed - L::kMostFall);
      fall_[place].of[i] = limited(change >> reach_.shift, L::kMostFall);
    }
    moved_[place] = {};
  }
  w_[bodies.size()] = moved_[bodies.size()] = fall_[bodies.size()] = {};
  signs_[bodies.size()] = kSlow;
}

void Hard::move(const State& from, State& to, const StepInput& input) {
  const std::int64_t unit = std::int64_t{1} << reach_.shift;
  const std::int64_t slow = std::int64_t{input.threshold} * 64 / kCalmShare;
  for (std::size_t place = 0; place < bodies_.size(); ++place) {
    const ContactBody& body = bodies_[place];
    const Slot s = body.slot;
    if (held_[place] != 0) {
      for (std::size_t i = 0; i < 3; ++i) {
        to.p(i)[s] = from.p(i)[s];
        to.v(i)[s] = from.v(i)[s];
        to.c(i)[s] = from.c(i)[s];
      }
      continue;
    }
    bool is_slow = true;
    for (std::size_t i = 0; i < 3; ++i) {
      // What the solver changed, beyond the motion without contacts: exactly 0 for a body that touches
      // nothing.
      const std::int32_t fall = fall_[place].of[i];
      const std::int32_t w = limited(body.v[i] >> reach_.shift, L::kMostSpeed - L::kMostFall);
      const std::int32_t fallen = 4 * w + (fall >> 2) + (fall >> 1) + (3 * fall >> 2) + fall;
      const std::int64_t pushed = (w_[place].of[i] - (w + fall)) * unit;
      const std::int64_t shifted = (moved_[place].of[i] - fallen) * unit >> 2;
      const std::int64_t v = std::int64_t{body.v[i]} + change_[place][i] + pushed;
      const std::int64_t way = body.v[i] + (5 * std::int64_t{change_[place][i]} >> 3) + shifted;
      const std::int32_t c = from.c(i)[s];
      const std::int32_t decayed = limited(c - share_of(c, input.parameters.decay), kVelocityLimit);
      moved_any_ |= decayed != c;
      to.c(i)[s] = decayed;
      to.v(i)[s] = limited(v, kVelocityLimit);
      to.p(i)[s] = limited(body.p[i] + ((way + 32) >> 6), kPositionLimit);
      is_slow = is_slow && -slow <= to.v(i)[s] && to.v(i)[s] <= slow;
    }
    if (is_slow) signs_[place] |= kSlow;
  }
}

// Bodies that were left out stay as they are.
void Hard::copy_sleepers(const State& from, State& to) {
  if (!any_sleeps_) return;
  const std::span<const std::uint8_t> left_out = sleep_.left_out();
  const std::span<const std::uint8_t> asleep = sleep_.asleep();
  for (std::size_t i = 0; i < 3 && &from != &to; ++i) {
    std::copy(from.p(i).begin(), from.p(i).end(), to.p(i).begin());
    std::copy(from.v(i).begin(), from.v(i).end(), to.v(i).begin());
    std::copy(from.c(i).begin(), from.c(i).end(), to.c(i).begin());
  }
  for (Slot s = 0; s < from.capacity(); ++s) {
    if (left_out[s] == 0) continue;
    const std::uint8_t calm = asleep[s] != 0 ? kCalmFrames : 0;
    moved_any_ |= from.own()[s] != calm;
    to.own()[s] = calm;
  }
}

// A body is calm while it is slow, touches two others at least or the geometry, and all these are slow. A
// heap that gets no corrections would creep, because the solver is never exact.
void Hard::rest_the_calm(const State& from, State& to, const StepInput& input) {
  const auto meet = [this](std::uint32_t one, std::uint32_t other) {
    std::uint8_t& signs = signs_[one];
    const std::uint8_t more = (signs & kTouched) != 0 ? kTouchedTwice : kTouched;
    signs = static_cast<std::uint8_t>(signs | more | ((signs_[other] & kSlow) != 0 ? 0U : kByRestless));
  };
  for (const HardContact& contact : contacts_.all()) {
    meet(contact.a, contact.b);
    if (contact.b < bodies_.size()) meet(contact.b, contact.a);
  }
  const bool woken = has_turned(input.gravity_before, input.drive.gravity);
  constexpr std::uint8_t kAll = kSlow | kTouchedTwice | kByRestless;
  for (std::size_t place = 0; place < bodies_.size(); ++place) {
    const Slot s = bodies_[place].slot;
    if (held_[place] != 0 && to.rest()[s] == 0) {
      to.own()[s] = kCalmFrames;
      continue;
    }
    const bool calm = !woken && to.rest()[s] == 0 && (signs_[place] & kAll) == (kSlow | kTouchedTwice);
    const std::uint8_t before = from.own()[s];
    const int frames = calm ? std::min<int>(before + 1, kCalmFrames) : 0;
    to.own()[s] = static_cast<std::uint8_t>(frames);
    for (std::size_t i = 0; i < 3 && frames == kCalmFrames; ++i) {
      to.p(i)[s] = bodies_[place].p[i];
      to.v(i)[s] = 0;
    }
    moved_any_ |= frames != before;
    for (std::size_t i = 0; i < 3 && to.rest()[s] == 0; ++i)
      moved_any_ |= to.p(i)[s] != bodies_[place].p[i] || to.v(i)[s] != bodies_[place].v[i];
  }
}

void Hard::sum_pushes() {
  std::fill(pushes_.begin(), pushes_.end(), Push{});
  for (const HardGroup& g : contacts_.groups()) {
    for (std::size_t k = 0; k < HardGroup::kContacts; ++k) {
      if (g.push[k] == 0) continue;
      const std::size_t a = g.a[k] / sizeof(HardRow);
      const std::size_t b = g.b[k] / sizeof(HardRow);
      const bool is_wall = b == bodies_.size();
      const std::int32_t sign = g.nz[k] < 0 ? -1 : 1;
      const Vec3i n{g.nx[k], g.ny[k], g.nz[k]};
      const Vec3i t1{g.t1x[k], g.t1y[k], -g.nx[k]};
      const Vec3i t2{sign * g.t1y[k], g.t2y[k], -sign * g.ny[k]};
      for (std::size_t i = 0; i < 3; ++i) {
        const std::int32_t normal = g.push[k] * n[i] >> 12;
        const std::int32_t across = (g.slide1[k] * t1[i] + g.slide2[k] * t2[i]) >> 12;
        const auto add = [&](std::size_t place, std::int32_t share) {
          Push& push = pushes_[bodies_[place].slot];
          (is_wall ? push.wall : push.normal)[i] += normal * share >> 12;
          push.across[i] += across * share >> 12;
        };
        add(a, g.share[k]);
        if (!is_wall) add(b, g.share[k] - L::kOne);
      }
    }
  }
}

void Hard::step(const State& from, State& to, const StepInput& input) {
  if (still_.is(from, input)) {
    still_.repeat(from, to);
    step_groups(from, to);
    return;
  }
  still_.forget();
  moved_any_ = false;
  keep_at_rest(from, to, input.drive);
  set_radii(input);
  load(from, to, input);
  contacts_.find(constants_, reach_, order_, bodies_, std::span(mobility_).first(bodies_.size()));
  const auto threshold = static_cast<std::int32_t>(std::int64_t{input.threshold} * 64 >> reach_.shift);
  const std::span<HardGroup> groups = contacts_.groups();
  contacts_.kernels().solve({threshold / kSlopShare, input.parameters.contacts.friction}, groups.data(),
                            groups.size(), {w_.data(), moved_.data(), fall_.data(), bodies_.size() + 1});
  if (!pushes_.empty()) sum_pushes();
  still_.copy_unmoved(from, to);
  copy_sleepers(from, to);
  move(from, to, input);
  rest_the_calm(from, to, input);
  if (!moved_any_) still_.remember(to, input);
  step_groups(from, to);
}

void Hard::step_slots(const State& from, State& to, const StepInput& input, std::span<const Slot> /*slots*/) {
  step(from, to, input);
}

}  // namespace tandem
