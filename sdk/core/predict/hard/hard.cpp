// The predictor `hard`: projection of velocities in sub-steps, after M. Macklin et al., "Small Steps in
// Physics Simulation" (2019), and the solver of box2d 3. Normals are found once a frame, impulses are
// accumulated, and a speed in proportion to the overlap pushes bodies out of each other.
#include "sdk/core/predict/hard/hard.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <utility>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/lattice/fixed_point.hpp"
#include "sdk/core/lattice/vector_clones.hpp"
#include "sdk/core/predict/rest.hpp"
#include "sdk/core/predict/words/lanes.hpp"

namespace tandem {
namespace {

using L = HardLaw;

constexpr std::uint32_t kGridBits = 14;
constexpr std::uint32_t kUnitBits = 10;                   // of the threshold a frame, in the solver's unit
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

// Four times the way of a body in four sub-steps without contacts. The solver adds exactly 0 to it for a body
// that touches nothing.
template <class X>
[[gnu::always_inline]] inline X fallen(X w, X fall) {
  return 4 * w + (fall >> 2) + (fall >> 1) + (3 * fall >> 2) + fall;
}

// By place, as in Hard.
struct HardRows {
  HardRow *w, *fall;
  std::int32_t *moved_xz, *moved_y;
  HardVector* change;
};

struct Free {
  Drive drive;
  std::array<const std::int32_t*, 3> c{};  // by slot, as the next one
  const std::uint8_t* held = nullptr;
  std::uint32_t shift = 0;
};

// The motion of bodies without contacts.
TANDEM_VECTOR_CLONES void fall_freely(const Free& free, std::span<const ContactBody> bodies,
                                      const HardRows& rows) {
  const auto shift = static_cast<std::int32_t>(free.shift);
  const std::int32_t damping = free.drive.damping;
  const Four gravity{free.drive.gravity[0], free.drive.gravity[1], free.drive.gravity[2], 0};
  for (std::size_t place = 0; place < bodies.size(); ++place) {
    const Slot s = bodies[place].slot;
    const Four v = load<Four>(bodies[place].v) & Four{-1, -1, -1, 0};
    const Four next = v + gravity + Four{free.c[0][s], free.c[1][s], free.c[2][s], 0};
    // (next * damping + 2^15) >> 16 in 32 bits: the halves of next one by one.
    const FourBits low = (bits_of(next & 0xFFFF) * bits_of(damping) + (1U << 15U)) >> 16U;
    const Four damped = next - ((next >> 16) * damping + value_of(low));
    const Four moves = same(std::int32_t{free.held[s]} - 1);
    const Four change = (within(damped, same(kVelocityLimit)) - v) & moves;
    write_words<Four>(rows.w[place].of.data(), within(v >> shift, same(L::kMaxStart)));
    write_words<Four>(rows.fall[place].of.data(), within(change >> shift, same(L::kMaxFall)));
    write(&rows.change[place], change);
  }
}

// With a greater shift the sums below do not fit.
constexpr std::uint32_t kMaxShift32 = 11;

// As Hard::move(), three axes at once.
TANDEM_VECTOR_CLONES void move_in_32_bits(std::span<const ContactBody> bodies, const HardRows& solved,
                                          std::uint32_t shift, std::int32_t slow, HardNext* next,
                                          std::uint8_t* signs) {
  const auto by = static_cast<std::int32_t>(shift);
  const Four axes{-1, -1, -1, 0};
  for (std::size_t place = 0; place < bodies.size(); ++place) {
    const Four v = load<Four>(bodies[place].v) & axes;
    const Four fall = read_words<Four>(solved.fall[place].of.data());
    const Four change = load<Four>(solved.change[place]);
    const Four w = within(v >> by, same(L::kMaxStart));
    const Four pushed = (read_words<Four>(solved.w[place].of.data()) - (w + fall)) << by;
    const Four moved{solved.moved_xz[2 * place], solved.moved_y[2 * place], solved.moved_xz[2 * place + 1],
                     0};
    const Four shifted = (moved - fallen(w, fall)) << by >> 2;
    const Four part = 5 * (change >> 3) + (5 * (change & 7) >> 3);  // of the change, 5/8
    const Four new_v = within(v + change + pushed, same(kVelocityLimit));
    const Four p = load<Four>(bodies[place].p) + ((v + part + shifted + 32) >> 6);
    write(&next[place].v, new_v);
    write(&next[place].p, within(p, same(kPositionLimit)));
    const bool is_slow = !any((new_v > slow) | (new_v < -slow));
    signs[place] |= is_slow ? kSlow : std::uint8_t{0};
  }
}

// Writes the decayed c of bodies that are not held, and that of the others as it is. Returns whether any
// changed.
TANDEM_VECTOR_CLONES bool decay_c(const std::int32_t* c, const std::uint8_t* held, std::uint16_t decay,
                                  std::int32_t* to, std::size_t count) {
  std::uint32_t changed = 0;
  std::array<std::int32_t, 256> decayed{};  // because `to` may be `c`
  for (std::size_t first = 0; first < count; first += decayed.size()) {
    const std::size_t part = std::min(decayed.size(), count - first);
    for (std::size_t k = 0; k < part; ++k) {
      const std::int32_t x = c[first + k];
      // (x * decay + 2^15) >> 16 in 32 bits: the halves of x one by one.
      const std::uint32_t low = ((static_cast<std::uint32_t>(x) & 0xFFFFU) * decay + (1U << 15U)) >> 16U;
      const std::uint32_t share = static_cast<std::uint32_t>((x >> 16) * decay) + low;
      const std::uint32_t by = share & (static_cast<std::uint32_t>(held[first + k]) - 1U);
      changed |= by;
      decayed[k] = static_cast<std::int32_t>(static_cast<std::uint32_t>(x) - by);
    }
    std::copy_n(decayed.begin(), part, to + first);
  }
  return changed != 0;
}

}  // namespace

Hard::Hard(std::uint32_t capacity, ContactConstants constants, const HardMachine& machine)
    : constants_(std::move(constants)),
      types_(constants_.types),
      grid_shift_(grid_shift_for(largest_of(types_))),
      order_(capacity),
      contacts_(capacity, grid_shift_, machine),
      sleep_(capacity,
             {order_.protocol_bits().row, order_.protocol_bits().layer, order_.protocol_bits().all}),
      w_(capacity + 1 + HardMotions::kBeyond),
      base_(w_.size()),
      way_(w_.size()),
      fall_(w_.size()),
      moved_xz_(2 * w_.size()),
      moved_y_(moved_xz_.size()),
      change_(capacity),
      next_(capacity),
      mobility_(capacity),
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
  any_held_ = sleep_.find(from, input, to.rest(), order_.number(order));
  if (any_held_) order.left_out = sleep_.left_out();
  const std::span<const std::uint8_t> held = sleep_.held();
  const std::span<ContactBody> bodies = order_.sort(order);
  TANDEM_ASSERT(order_.begin().back() <= bodies.size());
  crowded_ = static_cast<std::uint32_t>(bodies.size()) - order_.begin().back();
  bodies_ = bodies;
  const TypeId* const type = from.type().data();
  for (std::size_t place = 0; place < bodies.size(); ++place) {
    const Slot s = bodies[place].slot;
    const bool holds = held[s] != 0;
    if (holds) bodies[place].v = {};
    mobility_[place] = holds ? 0 : constants_.type_of(type[s]).mobility;
    signs_[place] = holds ? kSlow : std::uint8_t{0};
  }
  fall_freely(
      {input.drive, {from.c(0).data(), from.c(1).data(), from.c(2).data()}, held.data(), reach_.shift},
      bodies, {w_.data(), fall_.data(), moved_xz_.data(), moved_y_.data(), change_.data()});
  // The geometry does not move, nor does what a vector reads behind it.
  for (std::size_t place = bodies.size(); place <= bodies.size() + HardMotions::kBeyond; ++place)
    w_[place] = fall_[place] = {};
  std::fill_n(moved_xz_.begin(), 2 * bodies.size() + 2, 0);
  std::fill_n(moved_y_.begin(), 2 * bodies.size() + 2, 0);
  signs_[bodies.size()] = kSlow;
}

// Computes where bodies are after the frame.
void Hard::move(const StepInput& input) {
  const std::uint32_t shift = reach_.shift;
  const std::int64_t slow = std::int64_t{input.threshold} * 64 / kCalmShare;
  if (shift <= kMaxShift32) {
    move_in_32_bits(bodies_, {w_.data(), fall_.data(), moved_xz_.data(), moved_y_.data(), change_.data()},
                    shift, static_cast<std::int32_t>(slow), next_.data(), signs_.data());
    return;
  }
  for (std::size_t place = 0; place < bodies_.size(); ++place) {
    const ContactBody& body = bodies_[place];
    bool is_slow = true;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::int32_t v = body.v[i];
      const std::int32_t fall = fall_[place].of[i];
      const std::int32_t change = change_[place].of[i];
      const std::int32_t w = limited(v >> shift, L::kMaxStart);
      const std::int64_t pushed = std::int64_t{w_[place].of[i] - (w + fall)} << shift;
      const std::int32_t moved = i == 1 ? moved_y_[2 * place] : moved_xz_[2 * place + i / 2];
      const std::int64_t shifted = std::int64_t{moved - fallen(w, fall)} << shift >> 2;
      const std::int64_t way = v + (5 * std::int64_t{change} >> 3) + shifted;
      const std::int32_t next = limited(std::int64_t{v} + change + pushed, kVelocityLimit);
      next_[place].v.of[i] = next;
      next_[place].p.of[i] = limited(body.p[i] + ((way + 32) >> 6), kPositionLimit);
      is_slow &= -slow <= next && next <= slow;
    }
    signs_[place] |= is_slow ? kSlow : std::uint8_t{0};
  }
}

// A heap that gets no corrections would creep, because the solver is never exact. So a body rests that is
// calm: slow, in touch with two others at least or the geometry, and all these slow.
void Hard::look_around() {
  std::uint8_t* const signs = signs_.data();
  const auto meet = [signs](std::uint32_t one, std::uint32_t other) {
    const unsigned so_far = signs[one];
    const unsigned more = (so_far & kTouched) << 1U | kTouched;
    signs[one] = static_cast<std::uint8_t>(so_far | more | (~unsigned{signs[other]} & kSlow) << 3U);
  };
  static_assert(kTouchedTwice == kTouched << 1U && kByRestless == kSlow << 3U);
  // The geometry stands behind the last body. It gets signs, too, of which only kSlow is read.
  for (const HardContact& contact : contacts_.all()) {
    meet(contact.a, contact.b);
    meet(contact.b, contact.a);
  }
}

// Writes bodies to their slots. Those that hold still stay as they are.
void Hard::write(const State& from, State& to, const StepInput& input) {
  const std::uint8_t* const held = sleep_.held().data();
  std::array<std::int32_t*, 3> p{}, v{};
  bool changed = false;
  for (std::size_t i = 0; i < 3; ++i) {
    p[i] = to.p(i).data();
    v[i] = to.v(i).data();
    if (any_held_ && &from != &to) {
      std::copy(from.p(i).begin(), from.p(i).end(), p[i]);
      std::copy(from.v(i).begin(), from.v(i).end(), v[i]);
    }
    changed |= decay_c(from.c(i).data(), held, input.parameters.decay, to.c(i).data(), from.capacity());
  }
  const std::uint8_t* const rest = to.rest().data();
  const std::uint8_t* const before = from.own().data();
  std::uint8_t* const own = to.own().data();
  for (Slot s = 0; any_held_ && s < from.capacity(); ++s) {
    const std::uint8_t now = rest[s] != 0 ? std::uint8_t{0} : before[s];
    changed |= now != before[s];
    own[s] = now;
  }
  const bool woken = has_turned(input.gravity_before, input.drive.gravity);
  constexpr std::uint8_t kAll = kSlow | kTouchedTwice | kByRestless;
  for (std::size_t place = 0; place < bodies_.size(); ++place) {
    const ContactBody& body = bodies_[place];
    const Slot s = body.slot;
    if (held[s] != 0) continue;
    HardNext next = next_[place];
    const bool calm = !woken && (signs_[place] & kAll) == (kSlow | kTouchedTwice);
    const std::uint8_t frames_before = before[s];
    const int frames = calm ? std::min<int>(frames_before + 1, kCalmFrames) : 0;
    if (frames == kCalmFrames) next = {{{body.p[0], body.p[1], body.p[2]}}, {}};
    own[s] = static_cast<std::uint8_t>(frames);
    changed |= frames != frames_before;
    for (std::size_t i = 0; i < 3; ++i) {
      changed |= next.p.of[i] != body.p[i] || next.v.of[i] != body.v[i];
      p[i][s] = next.p.of[i];
      v[i][s] = next.v.of[i];
    }
  }
  if (!changed) still_.remember(to, input);
}

void Hard::sum_pushes() {
  std::fill(pushes_.begin(), pushes_.end(), Push{});
  for (const HardGroup& g : contacts_.groups()) {
    for (std::size_t k = 0; k < HardGroup::kContacts; ++k) {
      if (g.push[k] == 0) continue;
      const std::size_t a = g.a[k] / sizeof(HardRow);
      const std::size_t b = g.b[k] / sizeof(HardRow);
      const bool is_wall = b == bodies_.size();
      const Vec3i n{g.nx[k], g.ny[k], g.nz[k]};
      const Vec3i t1{g.t1x[k], g.t1y[k], -g.nx[k]};
      const Vec3i t2{g.t1y[k], g.t2y[k], -g.ny[k]};
      for (std::size_t i = 0; i < 3; ++i) {
        const std::int32_t normal = g.push[k] * n[i] >> 14;
        const std::int32_t across = (g.slide1[k] * t1[i] >> 14) + (g.slide2[k] * t2[i] >> 14);
        const auto add = [&](std::size_t place, std::int32_t share) {
          Push& push = pushes_[bodies_[place].slot];
          (is_wall ? push.wall : push.normal)[i] += normal * share >> 15;
          push.across[i] += static_cast<std::int32_t>(std::int64_t{across} * share >> 15);
        };
        add(a, g.share_a[k]);
        if (!is_wall) add(b, -g.share_b[k]);
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
  keep_at_rest(from, to, input.drive);
  set_radii(input);
  load(from, to, input);
  contacts_.find(constants_, reach_, order_, bodies_, std::span(mobility_).first(bodies_.size()));
  const auto threshold = static_cast<std::int32_t>(std::int64_t{input.threshold} * 64 >> reach_.shift);
  const HardMaterial material{
      static_cast<std::int16_t>(threshold / kSlopShare),
      static_cast<std::int16_t>(std::min(input.parameters.contacts.friction << 3, L::kMaxWord))};
  const std::span<HardGroup> groups = contacts_.groups();
  contacts_.kernels().solve(material, groups.data(), groups.size(),
                            {w_.data(), base_.data(), way_.data(), moved_xz_.data(), moved_y_.data(),
                             fall_.data(), bodies_.size() + 1});
  if (!pushes_.empty()) sum_pushes();
  still_.copy_unmoved(from, to);
  move(input);
  look_around();
  write(from, to, input);
  step_groups(from, to);
}

void Hard::step_slots(const State& from, State& to, const StepInput& input, std::span<const Slot> /*slots*/) {
  step(from, to, input);
}

}  // namespace tandem
