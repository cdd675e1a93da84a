// The predictor `rigid`: as `hard`, projection of velocities in sub-steps with normals that are found once a
// frame, but of bodies that turn and have faces.
#include "sdk/core/predict/rigid/rigid.hpp"

#include <algorithm>
#include <bit>
#include <utility>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/lattice/fixed_point.hpp"
#include "sdk/core/predict/rest.hpp"

namespace tandem {
namespace {

using R = RigidLaw;
using S = RigidSolverLaw;

constexpr std::uint32_t kGridBits = 14;
constexpr std::uint32_t kPairBits = 15;     // of what is between two boxes that are near
constexpr std::uint32_t kUnitBits = 9;      // of the threshold a frame, in the solver's unit
constexpr std::int32_t kUnitsOfPushes = 2;  // those of `hard` are 2^-2 of a unit
constexpr std::int32_t kMaxPushOut = 1 << (kUnitBits - 1);
constexpr std::int32_t kSlopShare = 10, kCalmShare = 10, kNearShare = 4;  // of the threshold
constexpr std::int32_t kCalmSpinShare = 6;                                // of the threshold, at the radius
constexpr std::int32_t kRousingShare = 2;  // of the speed at which a body is slow: a slower one rouses nobody
constexpr std::size_t kContactsPerBody = 20;
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

Vec3i direction_of(const RigidImpulse& row, std::size_t lane) {
  const auto low = [](std::int32_t x) { return static_cast<std::int16_t>(x & 0xFFFF); };
  return {low(row.d_xy[lane]), row.d_xy[lane] >> 16, low(row.d_z[lane])};
}

// The change of velocity that an impulse gives a body whose share is 1.
Vec3i impulse_of(const RigidImpulse& row, std::size_t lane) {
  constexpr std::int32_t kShift = S::kBits - kUnitsOfPushes;
  Vec3i impulse = direction_of(row, lane);
  for (std::int32_t& x : impulse) x = row.push[lane] * x >> kShift;
  return impulse;
}

// Whether a round solid touches an edge or a corner of a box, rather than a face, where the normal is n.
bool is_at_edge(const PlacedSolid& a, const PlacedSolid& b, const Vec3i& n) {
  const bool a_is_box = a.solid->kind == Solid::Kind::kBox;
  if (a_is_box == (b.solid->kind == Solid::Kind::kBox)) return false;
  constexpr std::int64_t kOfFace = S::kOne * 99 / 100;
  const auto is_face = [&](const Vec3i& axis) {
    const std::int64_t along = product(axis, n) >> R::kAxisBits;
    return along > kOfFace || along < -kOfFace;
  };
  const std::array<Vec3i, 3>& axes = a_is_box ? a.axes : b.axes;
  return std::none_of(axes.begin(), axes.end(), is_face);
}

// `threshold` in 1/64 lattice unit.
bool is_slow(const Vec3i& v, const Spin& w, const SizedSolid& solid, std::int64_t threshold) {
  const std::int64_t slow = threshold / kCalmShare;
  const auto within = [](std::int64_t x, std::int64_t most) { return -most <= x && x <= most; };
  bool is = true;
  for (std::size_t i = 0; i < 3; ++i)
    is = is && within(v[i], slow) &&
         within(kCalmSpinShare * (w[i] * solid.radius >> (28 - R::kLengthBits)), threshold);
  return is;
}

std::int64_t sum_of(const auto& x) {
  std::int64_t sum = 0;
  for (const std::int64_t y : x) sum += y < 0 ? -y : y;
  return sum;
}

}  // namespace

Rigid::Rigid(std::uint32_t capacity, RigidConstants constants, const RigidMachine& machine)
    : capacity_(capacity),
      constants_(std::move(constants)),
      substep_bits_(static_cast<std::uint32_t>(
          std::countr_zero(static_cast<std::uint32_t>(constants_.contact.substeps)))),
      order_(capacity),
      sleep_(capacity, order_.bits()),
      bodies_(capacity),
      balls_(capacity),
      balls_xy_(capacity + RigidBalls::kMore),
      balls_z_radius_(capacity + RigidBalls::kMore),
      maybe_near_(capacity),
      solids_in_words_(capacity),
      slow_(capacity),
      held_(capacity),
      signs_(capacity + 1),
      masses_(capacity + 1),
      now_(capacity + 1),
      base_(capacity + 1),
      way_(capacity + 1),
      fall_(capacity + 1),
      moved_(capacity + 1),
      most_found_(kContactsPerBody * capacity),
      pair_kernels_(machine.pairs),
      kernels_(machine.solver),
      still_(capacity, {.orientation = true}) {
  TANDEM_ASSERT(!constants_.solids.empty() && constants_.solids.size() == constants_.contact.types.size());
  TANDEM_ASSERT(constants_.contact.substeps == 1 << substep_bits_);
  for (std::vector<std::int32_t>& turns : turns_) turns.resize(capacity);
  for (std::vector<std::int32_t>& turned : turned_) turned.resize(capacity);
  for (const Solid& solid : constants_.solids) solids_.push_back(sized(solid, 0, 0));
  grid_shift_ = grid_shift_for(largest_of(solids_));
  used_.resize(capacity);
  found_.reserve(most_found_);
  touches_.reserve(most_found_);
  constexpr std::size_t kPairs = RigidGroup::kPairs;
  by_wave_.resize(most_found_ + S::kWaves * kPairs);
  groups_.resize(by_wave_.size() / kPairs);
  // Pairs of a wave come by their number of points, so the points of a group are few more than an eighth of
  // those of the group before it.
  contacts_.resize(most_found_ / kPairs + S::kWaves * S::kMaxPoints);
}

void Rigid::set_sizes(const StepInput& input) {
  for (std::size_t i = 0; i < solids_.size(); ++i)
    solids_[i] =
        sized(constants_.solids[i], input.parameters.contacts.radius, input.parameters.contacts.rounding);
  largest_radius_ = largest_of(solids_);
  reach_ = std::min<std::int64_t>(input.threshold, largest_radius_);
  const std::int64_t threshold = std::int64_t{input.threshold} << R::kLengthBits;
  const auto bits = static_cast<std::uint32_t>(std::bit_width(static_cast<std::uint64_t>(threshold)));
  shift_ = bits > kUnitBits ? bits - kUnitBits : 0;
  const std::int64_t furthest = (3 * largest_radius_ + reach_) << R::kLengthBits;
  slop_ = static_cast<std::int32_t>(threshold >> shift_) / kSlopShare;
  const auto length_bits = static_cast<std::uint32_t>(std::bit_width(static_cast<std::uint64_t>(furthest)));
  constexpr std::uint32_t kBallBits = RigidBalls::kBits + R::kLengthBits;
  ball_shift_ = length_bits > kBallBits ? length_bits - kBallBits : 0;
  pair_shift_ = std::max(shift_, length_bits > kPairBits ? length_bits - kPairBits : 0);
}

void Rigid::put_in_words(const Body& body, RigidSolidWords& words) const {
  const SizedSolid& solid = *body.solid.solid;
  constexpr unsigned kShift = R::kAxisBits - 15;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t m = 0; m < 3; ++m)
      words.axes[i][m] = static_cast<std::int16_t>(
          std::clamp((body.solid.axes[i][m] + (1 << (kShift - 1))) >> kShift, -S::kMaxWord, S::kMaxWord));
    words.size[i] = word_of(solid.size[i] >> R::kLengthBits);
  }
  const auto radius = std::max<std::uint32_t>(1, static_cast<std::uint16_t>(word_of(solid.radius)));
  const auto up = static_cast<std::uint32_t>(15 - std::bit_width(radius));
  words.radius = static_cast<std::int16_t>(radius);
  words.scale = static_cast<std::int16_t>(1U << up);
  words.inverse = static_cast<std::int16_t>((1U << 27U) / (radius << up));
}

// Places what pairs need of a body's shape.
void Rigid::place_solid(std::uint32_t place) {
  Body& body = bodies_[place];
  body.solid.axes = axes_of(body.q);
  body.per_length = (std::int64_t{1} << 40) / body.solid.solid->radius;
  if (balls_[place].is_box) put_in_words(body, solids_in_words_[place]);
  balls_[place].is_placed = true;
}

// Loads a body that does not move.
void Rigid::load(const State& from, std::uint32_t place) {
  Body& body = bodies_[place];
  const Slot s = body.slot;
  body.solid.solid = &solids_[std::min<std::size_t>(from.type()[s], solids_.size() - 1)];
  for (std::size_t i = 0; i < 3; ++i) body.solid.p[i] = from.p(i)[s];
  body.q = from.groups().orientation ? from.quaternion(s) : kNoTurn;
  body.v = body.change = body.w = {};
  body.way = 0;
  body.start = now_[place] = fall_[place] = {};
  moved_[place] = {};
  masses_[place] = {};
  balls_[place].is_placed = false;
}

void Rigid::set_in_motion(const State& from, const StepInput& input, std::uint32_t place) {
  Body& body = bodies_[place];
  const Slot s = body.slot;
  const std::int64_t radius = body.solid.solid->radius;
  if (from.groups().orientation) body.w = from.spin(s);
  for (std::size_t i = 0; i < 3; ++i) {
    const std::int32_t v = from.v(i)[s];
    std::int64_t next = std::int64_t{v} + input.drive.gravity[i] + from.c(i)[s];
    next -= share_of(next, input.drive.damping);
    body.v[i] = v;
    body.change[i] = limited(next, kVelocityLimit) - v;
    const auto word = [this](std::int64_t x, std::int32_t most) {
      return static_cast<std::int16_t>(limited(x >> shift_, most));
    };
    body.start.v[i] = word(v, S::kMaxStart);
    body.start.w[i] = word(body.w[i] * radius >> (28 - R::kLengthBits), S::kMaxStart);
    fall_[place].v[i] = word(body.change[i], S::kMaxFall);
  }
  now_[place] = body.start;
  const std::int64_t way = (sum_of(body.v) >> R::kLengthBits) + (sum_of(body.w) * radius >> 28);
  body.way = std::min(way, R::kMaxMargin / 4);
  place_solid(place);
  const Inertia inertia = inertia_of(body.solid);
  for (std::size_t i = 0; i < inertia.size(); ++i)
    masses_[place].inertia[i] = static_cast<std::int32_t>(inertia[i] >> (R::kInertiaBits - S::kInertiaBits));
}

void Rigid::place_ball(std::uint32_t place, std::int32_t mobility) {
  const Body& body = bodies_[place];
  const std::int64_t radius = body.solid.solid->radius;
  const std::int64_t to_pairs = std::min(body.way, largest_radius_ / 2);
  Ball& ball = balls_[place];
  ball.p = body.solid.p;
  ball.radius = static_cast<std::int32_t>(radius + to_pairs);
  ball.way = static_cast<std::int32_t>(to_pairs);
  ball.wall_radius = static_cast<std::int32_t>(radius + body.way + std::min(reach_, R::kMaxMargin / 2));
  ball.mobility = mobility;
  const auto coarse = [this](std::int64_t x) {
    return static_cast<std::uint32_t>(x >> ball_shift_) & 0xFFFF;
  };
  const auto two = [](std::uint32_t low, std::uint32_t high) {
    return static_cast<std::int32_t>(low | high << 16U);
  };
  balls_xy_[place] = two(coarse(ball.p[0]), coarse(ball.p[1]));
  balls_z_radius_[place] = two(coarse(ball.p[2]), coarse(radius + to_pairs + reach_ / 2));
}

// Marks bodies that rouse nobody, because they hardly move.
void Rigid::find_slow(const State& from, const StepInput& input) {
  const bool turns = from.groups().orientation;
  const std::int64_t most = kRousingShare * std::int64_t{input.threshold} << R::kLengthBits;
  for (Slot s = 0; s < from.capacity(); ++s) {
    const SizedSolid& solid = solids_[std::min<std::size_t>(from.type()[s], solids_.size() - 1)];
    slow_[s] = static_cast<std::uint8_t>(
        is_slow({from.v(0)[s], from.v(1)[s], from.v(2)[s]}, turns ? from.spin(s) : Spin{}, solid, most));
  }
}

void Rigid::load(const State& from, const State& to, const StepInput& input) {
  const auto cells = order_.number(from, grid_shift_, (2 * largest_radius_ + reach_) >> grid_shift_);
  find_slow(from, input);
  any_held_ = sleep_.find(from, input, to.rest(), cells, slow_);
  const std::span<const Slot> slots =
      order_.sort(any_held_ ? sleep_.left_out() : std::span<const std::uint8_t>{});
  count_ = static_cast<std::uint32_t>(slots.size());
  TANDEM_ASSERT(order_.paired() <= count_);
  crowded_ = count_ - order_.paired();
  for (std::uint32_t place = 0; place < count_; ++place) {
    const Slot s = bodies_[place].slot = slots[place];
    held_[place] = sleep_.held()[s];
    signs_[place] = held_[place] != 0 ? kSlow : std::uint8_t{0};
    load(from, place);
    balls_[place].is_box = bodies_[place].solid.solid->kind == Solid::Kind::kBox;
    if (held_[place] == 0) set_in_motion(from, input, place);
    place_ball(place, held_[place] != 0 ? 0 : constants_.contact.type_of(from.type()[s]).mobility);
  }
  signs_[count_] = kSlow;
  masses_[count_] = {};
  now_[count_] = fall_[count_] = {};
  moved_[count_] = {};
}

// Makes groups of the pairs, wave by wave, and in a wave those of most points first, and of these those of
// which most press: what does not press in a whole group takes little time.
void Rigid::put_in_order() {
  constexpr std::size_t kPairs = RigidGroup::kPairs;
  constexpr std::size_t kRuns = S::kMaxPoints * (S::kMaxPoints + 1);  // of a wave
  const auto run_of = [](const RigidTouch& touch) {
    return kRuns * touch.wave + (S::kMaxPoints + 1) * (S::kMaxPoints - touch.count) + S::kMaxPoints -
           touch.pressing;
  };
  std::array<std::uint32_t, kRuns * S::kWaves> next{};
  for (const RigidTouch& touch : touches_) ++next[run_of(touch)];
  nobody_ = {count_, count_, 0, 0, 0, 0, 0, 0};
  std::uint32_t end = 0;
  for (std::size_t wave = 0; wave < S::kWaves; ++wave) {
    for (std::size_t run = kRuns * wave; run < kRuns * (wave + 1); ++run)
      end += std::exchange(next[run], end);
    while (end % kPairs != 0) by_wave_[end++] = &nobody_;
  }
  for (const RigidTouch& touch : touches_) by_wave_[next[run_of(touch)]++] = &touch;
  TANDEM_ASSERT(end <= by_wave_.size());
  group_count_ = end / kPairs;
  std::uint32_t first = 0;
  for (std::size_t i = 0; i < group_count_; ++i) {
    // Points come in the order of waves: the next ones are asked for in time.
    for (std::size_t k = kPairs * (i + 1); k < std::min<std::size_t>(kPairs * (i + 2), end); ++k) {
      const RigidFound* const points = found_.data() + by_wave_[k]->first;
      __builtin_prefetch(points);
      __builtin_prefetch(points + 2);
    }
    groups_[i].first = first;
    kernels_.put(&by_wave_[kPairs * i], found_.data(), masses_.data(), now_.data(), fall_.data(),
                 substep_bits_, groups_[i], &contacts_[first]);
    first += groups_[i].count;
    TANDEM_ASSERT(first <= contacts_.size());
  }
}

// Computes the motion of bodies after the frame, and by what they turn in it.
void Rigid::move(bool turns, const StepInput& input) {
  const std::int64_t unit = std::int64_t{1} << shift_;
  const std::int64_t threshold = std::int64_t{input.threshold} << R::kLengthBits;
  const std::int64_t substeps = std::int64_t{1} << substep_bits_;
  for (std::uint32_t place = 0; place < count_; ++place) {
    Body& body = bodies_[place];
    if (held_[place] != 0) continue;
    const RigidRow& now = now_[place];
    const RigidRow& start = body.start;
    const RigidMoved& moved = moved_[place];
    WideSpin w{}, turn{};
    const std::int64_t radius = body.solid.solid->radius;
    // 2^-28 rad a frame for a unit of the solver, in 2^-8.
    const std::int64_t per_unit =
        std::min<std::int64_t>((std::int64_t{1} << (30 + shift_)) / radius, std::int64_t{1} << 36);
    for (std::size_t i = 0; i < 3; ++i) {
      // What the solver changed, beyond the motion without contacts: exactly 0 for a body that touches
      // nothing.
      const std::int64_t fall = fall_[place].v[i];
      std::int64_t fallen = substeps * start.v[i];
      for (std::int64_t k = 1; k <= substeps; ++k) fallen += k * fall >> substep_bits_;
      const std::int64_t pushed = (now.v[i] - (start.v[i] + fall)) * unit;
      const std::int64_t way_moved = i == 1 ? moved.odd[0] : moved.even[i / 2];
      const std::int64_t way_turned = i == 1 ? moved.odd[2] : moved.even[2 + i / 2];
      const std::int64_t shifted = (way_moved - fallen) * unit >> substep_bits_;
      const std::int64_t v = std::int64_t{body.v[i]} + body.change[i] + pushed;
      const std::int64_t way =
          body.v[i] + ((substeps + 1) * std::int64_t{body.change[i]} >> (substep_bits_ + 1)) + shifted;
      const std::int64_t spun = now.w[i] - start.w[i];
      const std::int64_t turned = (way_turned - substeps * start.w[i]) >> substep_bits_;
      w[i] = body.w[i] + (spun * per_unit >> 8);
      turn[i] = body.w[i] + (turned * per_unit >> 8);
      body.next_v[i] = limited(v, kVelocityLimit);
      body.next_p[i] = limited(body.solid.p[i] + ((way + 32) >> 6), kPositionLimit);
    }
    body.next_w = {};
    if (turns) {
      body.next_w = limited_spin(w);
      const Spin by = limited_spin(turn);
      for (std::size_t i = 0; i < 3; ++i) turns_[i][place] = by[i];
    }
    if (is_slow(body.next_v, body.next_w, *body.solid.solid, threshold)) signs_[place] |= kSlow;
  }
}

// Fills turned_.
void Rigid::turn() {
  for (std::uint32_t place = 0; place < count_; ++place)
    for (std::size_t i = 0; i < kQuaternionChannels; ++i) turned_[i][place] = bodies_[place].q[i];
  turn_all({{turned_[0].data(), turned_[1].data(), turned_[2].data(), turned_[3].data()},
            {turned_[0].data(), turned_[1].data(), turned_[2].data(), turned_[3].data()},
            {turns_[0].data(), turns_[1].data(), turns_[2].data()}},
           std::span(held_).first(count_));
}

// A body is calm while it is slow, touches something, and all that it touches is slow. A heap that gets no
// corrections would creep, because the solver is never exact.
void Rigid::look_around() {
  const auto meet = [](std::uint8_t& one, std::uint8_t other) {
    one = static_cast<std::uint8_t>(one | kTouched | ((other & kSlow) != 0 ? 0U : kByRestless));
  };
  // The geometry stands behind the last body. It gets signs, too, of which only kSlow is read.
  for (const RigidTouch& contact : touches_) {
    meet(signs_[contact.a], signs_[contact.b]);
    meet(signs_[contact.b], signs_[contact.a]);
  }
}

// Writes a body to its slot. Where it falls asleep, it stays where it is.
void Rigid::write(const State& from, State& to, std::uint32_t place, int calm_frames) {
  const bool turns = from.groups().orientation;
  Body& body = bodies_[place];
  const Slot s = body.slot;
  const bool sleeps = calm_frames == kCalmFrames;
  moved_any_ |= calm_frames != from.own()[s];
  to.own()[s] = static_cast<std::uint8_t>(calm_frames);
  for (std::size_t i = 0; i < 3; ++i) {
    const std::int32_t p = sleeps ? body.solid.p[i] : body.next_p[i];
    const std::int32_t v = sleeps ? 0 : body.next_v[i];
    moved_any_ |= p != body.solid.p[i] || v != body.v[i];
    to.p(i)[s] = p;
    to.v(i)[s] = v;
  }
  if (!turns) return;
  for (std::size_t i = 0; i < kSpinChannels; ++i) {
    const std::int32_t w = sleeps ? 0 : body.next_w[i];
    moved_any_ |= w != body.w[i];
    to.w(i)[s] = w;
  }
  for (std::size_t i = 0; i < kQuaternionChannels; ++i) {
    const std::int32_t q = sleeps ? body.q[i] : turned_[i][place];
    moved_any_ |= q != body.q[i];
    to.q(i)[s] = q;
  }
}

// Writes all bodies. Those that hold still stay as they are.
void Rigid::write(const State& from, State& to, const StepInput& input) {
  if (any_held_) {
    if (&from != &to) {
      for (std::size_t i = 0; i < kColumns; ++i)
        std::copy(from.column(i).begin(), from.column(i).end(), to.column(i).begin());
    }
    for (Slot s = 0; s < from.capacity(); ++s) {
      const std::uint8_t calm = to.rest()[s] != 0 ? std::uint8_t{0} : from.own()[s];
      moved_any_ |= calm != from.own()[s];
      to.own()[s] = calm;
    }
  }
  const bool woken = has_turned(input.gravity_before, input.drive.gravity);
  constexpr std::uint8_t kAll = kSlow | kTouched | kByRestless;
  for (std::uint32_t place = 0; place < count_; ++place) {
    if (held_[place] != 0) continue;
    const Slot s = bodies_[place].slot;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::int32_t c = from.c(i)[s];
      const std::int32_t decayed = limited(c - share_of(c, input.parameters.decay), kVelocityLimit);
      moved_any_ |= decayed != c;
      to.c(i)[s] = decayed;
    }
    const bool calm = !woken && (signs_[place] & kAll) == (kSlow | kTouched);
    write(from, to, place, calm ? std::min<int>(from.own()[s] + 1, kCalmFrames) : 0);
  }
}

void Rigid::sum_pushes() {
  std::fill(pushes_.begin(), pushes_.end(), Push{});
  for (const RigidGroup& group : std::span(groups_).first(group_count_)) {
    for (std::size_t i = 0; i < group.count * RigidGroup::kPairs; ++i) {
      const RigidContact& contact = contacts_[group.first + i / RigidGroup::kPairs];
      const std::size_t lane = i % RigidGroup::kPairs;
      if (contact.normal.push[lane] == 0) continue;
      const Vec3i normal = impulse_of(contact.normal, lane);
      const Vec3i first = impulse_of(contact.tangents[0], lane);
      const Vec3i second = impulse_of(contact.tangents[1], lane);
      const std::uint32_t a = group.a[lane] / sizeof(RigidRow);
      const std::uint32_t b = group.b[lane] / sizeof(RigidRow);
      const bool is_wall = b == count_;
      const bool is_edge =
          !is_wall && is_at_edge(bodies_[a].solid, bodies_[b].solid, direction_of(contact.normal, lane));
      const auto add = [&](std::uint32_t place, std::int32_t share) {
        Push& push = pushes_[bodies_[place].slot];
        Vec3i& of = is_wall ? push.wall : is_edge ? push.edge : push.normal;
        for (std::size_t m = 0; m < 3; ++m) {
          of[m] += normal[m] * share >> S::kBits;
          push.across[m] += (first[m] + second[m]) * share >> S::kBits;
        }
      };
      add(a, group.share_a[lane]);
      if (!is_wall) add(b, -group.share_b[lane]);
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
  touches_.clear();
  std::fill(used_.begin(), used_.end(), 0U);
  find_pairs();
  find_walls(input);
  put_in_order();
  const auto threshold =
      static_cast<std::int32_t>((std::int64_t{input.threshold} << R::kLengthBits) >> shift_);
  kernels_.solve(
      {substep_bits_, slop_, threshold / kNearShare, input.parameters.contacts.friction, kMaxPushOut},
      groups_.data(), group_count_, contacts_.data(),
      {now_.data(), base_.data(), way_.data(), fall_.data(), moved_.data(), count_ + 1});
  if (!pushes_.empty()) sum_pushes();
  still_.copy_unmoved(from, to);
  const bool turns = from.groups().orientation;
  move(turns, input);
  if (turns) turn();
  look_around();
  write(from, to, input);
  if (!moved_any_) still_.remember(to, input);
}

void Rigid::step_slots(const State& from, State& to, const StepInput& input,
                       std::span<const Slot> /*slots*/) {
  step(from, to, input);
}

}  // namespace tandem
