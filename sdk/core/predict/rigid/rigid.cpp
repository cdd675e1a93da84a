// The predictor `rigid`: as `hard`, projection of velocities in sub-steps with normals that are found once a
// frame, but of bodies that turn and have faces.
#include "sdk/core/predict/rigid/rigid.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <utility>

#include "sdk/core/lattice/fixed_point.hpp"
#include "sdk/core/predict/contact/walls.hpp"
#include "sdk/core/predict/rest.hpp"

namespace tandem {
namespace {

using L = RigidLaw;

constexpr std::uint32_t kGridBits = 14;
constexpr std::uint32_t kUnitBits = 11;                   // of the threshold a frame, in the solver's unit
constexpr std::int32_t kSlopShare = 10, kCalmShare = 10;  // of the threshold
constexpr std::int32_t kCalmSpinShare = 6;                // of the threshold, at the radius
constexpr std::size_t kContactsPerBody = 20;
constexpr std::uint32_t kPairWaves = 40, kWaves = 50;  // those from kPairWaves on are of walls
constexpr std::uint64_t kOfPairs = (std::uint64_t{1} << kPairWaves) - 1;
constexpr std::uint8_t kCalmFrames = 5;  // a body that has been calm for so many frames sleeps
constexpr std::uint8_t kSlow = 1, kTouched = 2, kByRestless = 4;

std::uint32_t grid_shift_for(std::int64_t radius) {
  const auto bits = static_cast<std::uint32_t>(std::bit_width(2 * static_cast<std::uint64_t>(radius)));
  return bits > kGridBits ? bits - kGridBits : 0;
}

std::int64_t largest_of(const std::vector<SizedSolid>& solids) {
  std::int64_t largest = 1;
  for (const SizedSolid& solid : solids) largest = std::max(largest, solid.radius);
  return largest;
}

std::int64_t sum_of(const auto& x) {
  std::int64_t sum = 0;
  for (const std::int64_t y : x) sum += y < 0 ? -y : y;
  return sum;
}

}  // namespace

Rigid::Rigid(std::uint32_t capacity, RigidConstants constants)
    : capacity_(capacity),
      constants_(std::move(constants)),
      substep_bits_(static_cast<std::uint32_t>(
          std::countr_zero(static_cast<std::uint32_t>(constants_.contact.substeps)))),
      order_(capacity),
      bodies_(capacity),
      motions_(capacity + 1),
      still_(capacity, {.orientation = true}) {
  for (const Solid& solid : constants_.solids) solids_.push_back(sized(solid, 0));
  grid_shift_ = grid_shift_for(largest_of(solids_));
  used_.resize(capacity);
  found_.reserve(kContactsPerBody * capacity);
  contacts_.resize(found_.capacity());
}

void Rigid::set_sizes(const StepInput& input) {
  for (std::size_t i = 0; i < solids_.size(); ++i)
    solids_[i] = sized(constants_.solids[i], input.parameters.contacts.radius);
  largest_radius_ = largest_of(solids_);
  reach_ = std::min<std::int64_t>(input.threshold, largest_radius_);
  const std::int64_t threshold = std::int64_t{input.threshold} << L::kLengthBits;
  const auto bits = static_cast<std::uint32_t>(std::bit_width(static_cast<std::uint64_t>(threshold)));
  shift_ = bits > kUnitBits ? bits - kUnitBits : 0;
}

void Rigid::load(const State& from, const State& to, const StepInput& input) {
  const bool turns = from.groups().orientation;
  const std::span<const Slot> slots =
      order_.sort(from, grid_shift_, (2 * largest_radius_ + reach_) >> grid_shift_);
  count_ = static_cast<std::uint32_t>(slots.size());
  for (std::uint32_t place = 0; place < count_; ++place) {
    const Slot s = slots[place];
    Body& body = bodies_[place];
    const std::size_t type = std::min<std::size_t>(from.type()[s], solids_.size() - 1);
    const SizedSolid& solid = solids_[type];
    body.slot = s;
    body.still = to.rest()[s] != 0;
    body.solid.solid = &solid;
    body.q = turns ? from.quaternion(s) : kNoTurn;
    body.solid.axes = axes_of(body.q);
    body.mass = {inertia_of(body.solid), (std::int64_t{1} << 40) / solid.radius,
                 2 * (solid.radius << L::kLengthBits),
                 body.still ? 0 : constants_.contact.type_of(from.type()[s]).mobility};
    body.w = turns && !body.still ? from.spin(s) : Spin{};
    body.signs = body.still ? kSlow : std::uint8_t{0};
    RigidMotion& motion = motions_[place];
    motion = {};
    for (std::size_t i = 0; i < 3; ++i) {
      const std::int32_t v = body.still ? 0 : from.v(i)[s];
      body.solid.p[i] = from.p(i)[s];
      body.v[i] = v;
      std::int64_t next = std::int64_t{v} + input.drive.gravity[i] + from.c(i)[s];
      next -= share_of(next, input.drive.damping);
      body.change[i] = body.still ? 0 : limited(next, kVelocityLimit) - v;
      body.start[i] = limited(v >> shift_, L::kMostSpeed / 2);
      body.start_spin[i] =
          limited((body.w[i] * solid.radius >> (28 - L::kLengthBits)) >> shift_, L::kMostSpeed / 2);
      motion.fall[i] = limited(body.change[i] >> shift_, L::kMostSpeed / 2);
    }
    motion.v = body.start;
    motion.spin = body.start_spin;
    const std::int64_t way = (sum_of(body.v) >> L::kLengthBits) + (sum_of(body.w) * solid.radius >> 28);
    body.way = std::min(way, L::kMostMargin / 4);
  }
  motions_[count_] = {};
}

void Rigid::find_pairs() {
  order_.each_pair([this](std::uint32_t place_a, std::uint32_t place_b) {
    const Body& a = bodies_[place_a];
    const Body& b = bodies_[place_b];
    const std::int64_t margin = std::min(reach_, L::kMostMargin / 2) + a.way + b.way;
    const std::int64_t most = a.solid.solid->radius + b.solid.solid->radius + margin;
    Vec3l d{};
    std::int64_t square = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      d[i] = std::int64_t{b.solid.p[i]} - a.solid.p[i];
      if (d[i] >= most || -d[i] >= most) return;
      square += d[i] * d[i];
      d[i] <<= L::kLengthBits;
    }
    if (square >= most * most || (a.mass.mobility == 0 && b.mass.mobility == 0)) return;
    points_.clear();
    touch_solids(a.solid, b.solid, d, margin << L::kLengthBits, points_);
    const std::uint64_t used =
        (a.mass.mobility != 0 ? used_[place_a] : 0) | (b.mass.mobility != 0 ? used_[place_b] : 0);
    const auto wave = static_cast<std::uint32_t>(std::countr_one(used));
    if (wave >= kPairWaves) return;
    bool touched = false;
    for (const RigidPoint& point : points_.all())
      touched |=
          add(place_a, place_b, wave, point, {point.at[0] - d[0], point.at[1] - d[1], point.at[2] - d[2]});
    if (!touched) return;
    used_[place_a] |= std::uint64_t{1} << wave;
    used_[place_b] |= std::uint64_t{1} << wave;
  });
}

// Adds a contact if the bodies touch there in this frame.
bool Rigid::add(std::uint32_t a, std::uint32_t b, std::uint32_t wave, const RigidPoint& point,
                const Vec3l& at_b) {
  if (found_.size() == found_.capacity()) return false;
  const std::int32_t gap = limited(point.gap >> shift_, L::kMostGap);
  const bool is_wall = b == count_;
  const RigidRow row =
      normal_row(bodies_[a].mass, is_wall ? nullptr : &bodies_[b].mass, point.at, at_b, point.n);
  const std::int64_t closing = std::min<std::int64_t>(0, speed_along(row, motions_[a], motions_[b]));
  if (gap + closing >= reach_ << L::kLengthBits >> shift_) return false;
  found_.push_back({a, b, wave, gap, point.n, point.at, at_b});
  return true;
}

// Fills contacts_, wave by wave.
void Rigid::put_in_order() {
  std::array<std::uint32_t, kWaves + 1> next{};
  for (const Found& each : found_) ++next[each.wave + 1];
  for (std::size_t wave = 0; wave < kWaves; ++wave) next[wave + 1] += next[wave];
  for (const Found& each : found_) {
    RigidContact& contact = contacts_[next[each.wave]++];
    contact.a = each.a;
    contact.b = each.b;
    contact.gap = each.gap;
    set_rows(bodies_[each.a].mass, each.b == count_ ? nullptr : &bodies_[each.b].mass, each.at_a, each.at_b,
             each.n, contact);
  }
}

template <class Shape>
void Rigid::find_wall(const Shape& shape, std::int64_t wall) {
  for (std::uint32_t place = 0; place < count_; ++place) {
    const Body& body = bodies_[place];
    if (body.mass.mobility == 0) continue;
    const SizedSolid& solid = *body.solid.solid;
    const std::int64_t margin = wall + std::min(reach_, L::kMostMargin / 2) + body.way;
    if (touch(shape, body.solid.p, limited(solid.radius + margin, kPositionLimit)).overlap <= 0) continue;
    const auto wave = static_cast<std::uint32_t>(std::countr_one(used_[place] | kOfPairs));
    if (wave >= kWaves) continue;
    bool touched = false;
    const bool is_box = solid.kind == Solid::Kind::kBox;
    const std::int64_t radius = is_box ? 0 : solid.size[0];
    const std::uint32_t corners = is_box ? 8 : solid.size[1] > 0 ? 2 : 1;
    for (std::uint32_t corner = 0; corner < corners; ++corner) {
      Vec3l local{};
      for (std::size_t i = 0; i < 3; ++i) {
        const std::int64_t sign = (corner >> i & 1U) != 0 ? -1 : 1;
        if (is_box) local[i] = sign * solid.size[i];
      }
      if (!is_box) local[1] = corner == 0 ? solid.size[1] : -solid.size[1];
      const Vec3l at = in_world(body.solid.axes, local);
      Vec3i p{};
      for (std::size_t i = 0; i < 3; ++i)
        p[i] = limited(body.solid.p[i] + (at[i] >> L::kLengthBits), kPositionLimit);
      const std::int32_t most = limited((radius >> L::kLengthBits) + margin, kPositionLimit);
      const WallTouch near = touch(shape, p, most);
      if (near.overlap <= 0) continue;
      RigidPoint point{.n = {}, .gap = 0, .at = {}};
      point.gap = ((most - near.overlap - wall) << L::kLengthBits) - radius;
      for (std::size_t i = 0; i < 3; ++i) {
        point.n[i] = std::clamp(near.out[i], -(1 << L::kNormalBits), 1 << L::kNormalBits);
        point.at[i] = at[i] - (point.n[i] * radius >> L::kNormalBits);
      }
      touched |= add(place, count_, wave, point, {});
    }
    if (touched) used_[place] |= std::uint64_t{1} << wave;
  }
}

void Rigid::find_walls(const StepInput& input) {
  const std::int64_t wall = input.parameters.contacts.wall;
  for (const auto& plane : constants_.contact.planes) find_wall(plane, wall);
  for (const auto& box : constants_.contact.boxes) find_wall(box, wall);
  for (const auto& ball : constants_.contact.balls) find_wall(ball, wall);
}

void Rigid::move(const State& from, State& to, const StepInput& input) {
  const bool turns = from.groups().orientation;
  const std::int64_t unit = std::int64_t{1} << shift_;
  const std::int64_t threshold = std::int64_t{input.threshold} << L::kLengthBits;
  const std::int64_t slow = threshold / kCalmShare;
  const std::int64_t substeps = std::int64_t{1} << substep_bits_;
  for (std::uint32_t place = 0; place < count_; ++place) {
    Body& body = bodies_[place];
    const RigidMotion& motion = motions_[place];
    const Slot s = body.slot;
    if (body.still) {
      for (std::size_t i = 0; i < kColumns; ++i)
        if (!from.column(i).empty()) to.column(i)[s] = from.column(i)[s];
      continue;
    }
    bool is_slow = true;
    WideSpin w{}, turn{};
    const std::int64_t radius = body.solid.solid->radius;
    // 2^-28 rad a frame for a unit of the solver, in 2^-8.
    const std::int64_t per_unit =
        std::min<std::int64_t>((std::int64_t{1} << (30 + shift_)) / radius, std::int64_t{1} << 36);
    for (std::size_t i = 0; i < 3; ++i) {
      // What the solver changed, beyond the motion without contacts: exactly 0 for a body that touches
      // nothing.
      const std::int64_t fall = motion.fall[i];
      std::int64_t fallen = substeps * body.start[i];
      for (std::int64_t k = 1; k <= substeps; ++k) fallen += k * fall >> substep_bits_;
      const std::int64_t pushed = (motion.v[i] - (body.start[i] + fall)) * unit;
      const std::int64_t shifted = (motion.moved[i] - fallen) * unit >> substep_bits_;
      const std::int64_t v = std::int64_t{body.v[i]} + body.change[i] + pushed;
      const std::int64_t way =
          body.v[i] + ((substeps + 1) * std::int64_t{body.change[i]} >> (substep_bits_ + 1)) + shifted;
      const std::int64_t spun = motion.spin[i] - std::int64_t{body.start_spin[i]};
      const std::int64_t turned = (motion.turned[i] - substeps * body.start_spin[i]) >> substep_bits_;
      w[i] = body.w[i] + (spun * per_unit >> 8);
      turn[i] = body.w[i] + (turned * per_unit >> 8);
      const std::int32_t c = from.c(i)[s];
      const std::int32_t decayed = limited(c - share_of(c, input.parameters.decay), kVelocityLimit);
      moved_any_ |= decayed != c;
      to.c(i)[s] = decayed;
      to.v(i)[s] = limited(v, kVelocityLimit);
      to.p(i)[s] = limited(body.solid.p[i] + ((way + 32) >> 6), kPositionLimit);
      is_slow = is_slow && -slow <= to.v(i)[s] && to.v(i)[s] <= slow;
    }
    if (turns) {
      const Spin spin = limited_spin(w);
      for (std::size_t i = 0; i < 3; ++i) {
        to.w(i)[s] = spin[i];
        const std::int64_t speed = std::int64_t{spin[i]} * radius >> (28 - L::kLengthBits);
        is_slow = is_slow && -threshold <= kCalmSpinShare * speed && kCalmSpinShare * speed <= threshold;
      }
      to.set_quaternion(s, turned(body.q, limited_spin(turn)));
    }
    if (is_slow) body.signs |= kSlow;
  }
}

// A body is calm while it is slow, touches something, and all that it touches is slow. A heap that gets no
// corrections would creep, because the solver is never exact.
void Rigid::rest_the_calm(const State& from, State& to, const StepInput& input) {
  const auto meet = [](Body& one, std::uint8_t other) {
    one.signs = static_cast<std::uint8_t>(one.signs | kTouched | ((other & kSlow) != 0 ? 0U : kByRestless));
  };
  for (const RigidContact& contact : contacts()) {
    Body& a = bodies_[contact.a];
    const bool is_wall = contact.b == count_;
    meet(a, is_wall ? kSlow : bodies_[contact.b].signs);
    if (!is_wall) meet(bodies_[contact.b], a.signs);
  }
  const bool turns = from.groups().orientation;
  const bool woken = has_turned(input.gravity_before, input.drive.gravity);
  constexpr std::uint8_t kAll = kSlow | kTouched | kByRestless;
  for (std::uint32_t place = 0; place < count_; ++place) {
    const Body& body = bodies_[place];
    const Slot s = body.slot;
    const bool calm = !woken && !body.still && (body.signs & kAll) == (kSlow | kTouched);
    const std::uint8_t before = from.own()[s];
    const int frames = calm ? std::min<int>(before + 1, kCalmFrames) : 0;
    to.own()[s] = static_cast<std::uint8_t>(frames);
    moved_any_ |= frames != before;
    if (frames == kCalmFrames) {
      for (std::size_t i = 0; i < 3; ++i) {
        to.p(i)[s] = body.solid.p[i];
        to.v(i)[s] = 0;
        if (turns) to.w(i)[s] = 0;
      }
      if (turns) to.set_quaternion(s, body.q);
    }
    if (body.still) continue;
    for (std::size_t i = 0; i < 3; ++i)
      moved_any_ |= to.p(i)[s] != body.solid.p[i] || to.v(i)[s] != body.v[i];
    if (turns) moved_any_ |= to.quaternion(s) != body.q || to.spin(s) != body.w;
  }
}

void Rigid::sum_pushes() {
  std::fill(pushes_.begin(), pushes_.end(), Push{});
  for (const RigidContact& contact : contacts()) {
    if (contact.push[0] == 0) continue;
    const bool is_wall = contact.b == count_;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::int64_t normal = std::int64_t{contact.push[0]} * contact.rows[0].d[i] >> L::kNormalBits;
      const std::int64_t across = (std::int64_t{contact.push[1]} * contact.rows[1].d[i] +
                                   std::int64_t{contact.push[2]} * contact.rows[2].d[i]) >>
                                  L::kNormalBits;
      const auto add = [&](std::uint32_t place, std::int64_t share) {
        Push& push = pushes_[bodies_[place].slot];
        std::int32_t& of = (is_wall ? push.wall : push.normal)[i];
        of = limited(of + (normal * share >> L::kNormalBits), kVelocityLimit);
        push.across[i] = limited(push.across[i] + (across * share >> L::kNormalBits), kVelocityLimit);
      };
      add(contact.a, contact.share_a);
      if (!is_wall) add(contact.b, -std::int64_t{contact.share_b});
    }
  }
}

void Rigid::step(const State& from, State& to, const StepInput& input) {
  if (still_.is(from, input)) {
    still_.repeat(from, to);
    return;
  }
  still_.forget();
  moved_any_ = false;
  keep_at_rest(from, to, input.drive);
  set_sizes(input);
  load(from, to, input);
  found_.clear();
  std::fill(used_.begin(), used_.end(), 0U);
  find_pairs();
  find_walls(input);
  put_in_order();
  const auto threshold =
      static_cast<std::int32_t>((std::int64_t{input.threshold} << L::kLengthBits) >> shift_);
  solve({substep_bits_, threshold / kSlopShare, input.parameters.contacts.friction}, contacts(),
        std::span(motions_).first(count_ + 1));
  if (!pushes_.empty()) sum_pushes();
  still_.copy_unmoved(from, to);
  move(from, to, input);
  rest_the_calm(from, to, input);
  if (!moved_any_) still_.remember(to, input);
}

void Rigid::step_slots(const State& from, State& to, const StepInput& input,
                       std::span<const Slot> /*slots*/) {
  step(from, to, input);
}

}  // namespace tandem
