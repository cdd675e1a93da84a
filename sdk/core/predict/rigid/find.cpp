// Where bodies touch each other and the static geometry.
#include <algorithm>
#include <array>
#include <bit>
#include <type_traits>

#include "sdk/core/lattice/fixed_point.hpp"
#include "sdk/core/predict/rigid/rigid.hpp"

namespace tandem {
namespace {

using L = RigidLaw;
using S = RigidSolverLaw;

constexpr std::uint64_t kOfPairs = (std::uint64_t{1} << S::kPairWaves) - 1;

// a's speed minus b's along the normal at a point.
std::int32_t closing_speed(const RigidFound& at, const RigidRow& a, const RigidRow& b) {
  std::int32_t sum = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = i == 2 ? 0 : i + 1;
    const std::size_t k = j == 2 ? 0 : j + 1;
    const auto arm = [&](const std::int16_t* of) { return (of[j] * at.n[k] - of[k] * at.n[j]) >> S::kBits; };
    sum += at.n[i] * std::clamp(a.v[i] - b.v[i], -S::kMostWord - 1, S::kMostWord);
    sum += arm(at.arm_a) * a.w[i] - arm(at.arm_b) * b.w[i];
  }
  return sum >> S::kBits;
}

}  // namespace

void Rigid::find_pairs() {
  const RigidBalls balls{balls_xy_.data(), balls_z_radius_.data()};
  for (std::uint32_t a = 0; a < order_.paired(); ++a) {
    order_.each_range(a, [&](std::uint32_t from, std::uint32_t to) {
      const std::size_t count = pair_kernels_.find_near(balls, a, from, to, maybe_near_.data());
      for (std::size_t i = 0; i < count; ++i) look_at(a, maybe_near_[i]);
    });
  }
  touch_near();
}

// Puts a pair into near_ if it is near. Pairs come in blocks, because boxes are compared many at a time.
void Rigid::look_at(std::uint32_t place_a, std::uint32_t place_b) {
  const Ball& a = balls_[place_a];
  const Ball& b = balls_[place_b];
  const std::int64_t reach = std::min(reach_, L::kMostMargin / 2);
  const std::int64_t most = a.radius + b.radius + reach;
  Vec3l d{};
  bool far = false;
  for (std::size_t i = 0; i < 3; ++i) {
    d[i] = std::int64_t{b.p[i]} - a.p[i];
    far |= static_cast<std::uint64_t>(d[i] + most - 1) > static_cast<std::uint64_t>(2 * most - 2);
  }
  if (far || product(d, d) >= most * most || (a.mobility | b.mobility) == 0) return;
  if (!a.is_placed) place_solid(place_a);
  if (!b.is_placed) place_solid(place_b);
  const std::int64_t margin = reach + a.way + b.way;
  Near& near = near_[near_count_];
  near.a = place_a;
  near.b = place_b;
  near.boxes = a.is_box && b.is_box;
  if (near.boxes) {
    RigidBoxPair& pair = box_pairs_[box_count_++];
    for (std::size_t i = 0; i < 3; ++i) pair.d[i] = word_of(d[i]);
    pair.margin = word_of(margin);
    pair.a = static_cast<std::uint16_t>(place_a);
    pair.b = static_cast<std::uint16_t>(place_b);
    pair.of = static_cast<std::uint32_t>(near_count_);
  } else {
    near.margin = static_cast<std::int32_t>(margin);
    for (std::size_t i = 0; i < 3; ++i) near.d[i] = static_cast<std::int32_t>(d[i]);
  }
  ++near_count_;
  if (near_count_ == near_.size()) touch_near();
}

// Fills box_points_ for those of box_pairs_ that may touch, which move to the front. Returns how many.
std::size_t Rigid::touch_boxes() {
  constexpr std::size_t kPairs = RigidBoxPoints::kPairs;
  const auto fill_up = [this](std::size_t end) {
    for (; end % kPairs != 0; ++end) box_pairs_[end] = {{}, INT16_MIN, 0, 0, 0};  // these do not touch
    return end;
  };
  RigidBoxPair* const pairs = box_pairs_.data();
  const std::size_t count = pair_kernels_.keep_near(pairs, fill_up(box_count_), solids_in_words_.data());
  const std::size_t end = fill_up(count);
  for (std::size_t i = 0; i < end / kPairs; ++i)
    pair_kernels_.touch_boxes(pairs + i * kPairs, solids_in_words_.data(), box_points_[i]);
  box_count_ = 0;
  return count;
}

// Finds the points of the pairs in near_, in their order.
void Rigid::touch_near() {
  constexpr std::size_t kPairs = RigidBoxPoints::kPairs;
  const std::size_t boxes = touch_boxes();
  std::size_t box = 0;
  for (std::uint32_t i = 0; i < near_count_; ++i) {
    const Near& near = near_[i];
    if (near.boxes && (box == boxes || box_pairs_[box].of != i)) continue;
    const std::size_t block = box / kPairs;
    const std::size_t lane = box % kPairs;
    box += near.boxes ? 1U : 0U;
    if (near.boxes && box_points_[block].pairs[lane].count == 0) continue;
    const std::uint64_t used = (balls_[near.a].mobility != 0 ? used_[near.a] : 0) |
                               (balls_[near.b].mobility != 0 ? used_[near.b] : 0);
    const auto wave = static_cast<std::uint32_t>(std::countr_one(used));
    if (wave >= S::kPairWaves) continue;
    const std::size_t first = found_.size();
    if (near.boxes) {
      find_points(near, box_points_[block], lane);
    } else {
      Vec3l d{};
      for (std::size_t m = 0; m < 3; ++m) d[m] = std::int64_t{near.d[m]} << L::kLengthBits;
      points_.clear();
      touch_solids(bodies_[near.a].solid, bodies_[near.b].solid, d,
                   std::int64_t{near.margin} << L::kLengthBits, points_);
      find_points(near.a, near.b, d);
    }
    if (!add(near.a, near.b, wave, first)) continue;
    used_[near.a] |= std::uint64_t{1} << wave;
    used_[near.b] |= std::uint64_t{1} << wave;
  }
  near_count_ = 0;
}

// Finds those points of a pair of boxes where they touch in this frame.
void Rigid::find_points(const Near& near, const RigidBoxPoints& points, std::size_t lane) {
  const auto& pair = points.pairs[lane];
  const auto count = static_cast<std::size_t>(pair.count);
  if (found_.size() + count > most_found_) return;
  const std::int64_t reach = reach_ << L::kLengthBits >> shift_;
  RigidFound found{};
  std::copy_n(pair.n, 3, found.n);
  for (std::size_t m = 0; m < count; ++m) {
    const auto& point = points.points[m][lane];
    std::copy_n(point.arm_a, 3, found.arm_a);
    std::copy_n(point.arm_b, 3, found.arm_b);
    found.gap = limited(std::int64_t{point.gap} << (pair_shift_ - shift_), S::kMostGap);
    if (found.gap < reach || touches(found, near.a, near.b)) found_.push_back(found);
  }
}

bool Rigid::touches(const RigidFound& at, std::uint32_t a, std::uint32_t b) const {
  const std::int64_t reach = reach_ << L::kLengthBits >> shift_;
  return at.gap < reach || at.gap + closing_speed(at, now_[a], now_[b]) < reach;
}

// Finds those of points_ where the bodies touch in this frame. `to_b`: b's centre minus a's.
void Rigid::find_points(std::uint32_t a, std::uint32_t b, const Vec3l& to_b) {
  if (found_.size() + points_.all().size() > most_found_) return;
  for (const RigidPoint& point : points_.all()) {
    RigidFound found{};
    found.gap = limited(point.gap >> shift_, S::kMostGap);
    for (std::size_t i = 0; i < 3; ++i) {
      const auto arm = [](const Body& body, std::int64_t at) {
        const std::int64_t most = body.solid.solid->radius << L::kLengthBits;
        const std::int64_t x = std::clamp(at, -most, most);
        return static_cast<std::int16_t>(x * body.per_length >> (40 + L::kLengthBits - S::kBits));
      };
      constexpr std::int32_t kShift = L::kNormalBits - S::kBits;
      found.n[i] = static_cast<std::int16_t>(limited((point.n[i] + (1 << (kShift - 1))) >> kShift, S::kOne));
      found.arm_a[i] = arm(bodies_[a], point.at[i]);
      if (b != count_) found.arm_b[i] = arm(bodies_[b], point.at[i] - to_b[i]);
    }
    if (touches(found, a, b)) found_.push_back(found);
  }
}

// Makes one contact of the points from `first` on; false if there are none.
bool Rigid::add(std::uint32_t a, std::uint32_t b, std::uint32_t wave, std::size_t first) {
  const auto count = static_cast<std::uint16_t>(found_.size() - first);
  if (count == 0) return false;
  const std::int64_t of_a = balls_[a].mobility;
  const std::int64_t of_b = b == count_ ? 0 : balls_[b].mobility;
  const auto share = [most = std::max(of_a, of_b)](std::int64_t of) {
    return static_cast<std::int16_t>(of == most ? S::kOne : of * S::kOne / most);
  };
  const auto pressing = static_cast<std::uint16_t>(std::count_if(
      found_.end() - count, found_.end(), [this](const RigidFound& x) { return x.gap < 2 * slop_; }));
  touches_.push_back({a, b, static_cast<std::uint32_t>(first), static_cast<std::uint16_t>(wave), count,
                      share(of_a), share(of_b), pressing});
  return true;
}

void Rigid::find_wall(const Wall& shape, std::int64_t wall) {
  for (std::uint32_t place = 0; place < count_; ++place) {
    const Ball& ball = balls_[place];
    if (ball.mobility == 0) continue;
    if (shape.touch(shape.of, ball.p, limited(ball.wall_radius + wall, kPositionLimit)).overlap <= 0)
      continue;
    const Body& body = bodies_[place];
    const SizedSolid& solid = *body.solid.solid;
    const std::int64_t margin = ball.wall_radius + wall - solid.radius;
    const auto wave = static_cast<std::uint32_t>(std::countr_one(used_[place] | kOfPairs));
    if (wave >= S::kWaves) continue;
    points_.clear();
    const bool is_box = solid.kind == Solid::Kind::kBox;
    const std::int64_t radius = is_box ? 0 : solid.size[0];
    const std::uint32_t corners = is_box ? 8 : solid.size[1] > 0 ? 2 : 1;
    std::array<Vec3l, 3> halves{};  // half sizes along the axes, in the world, in 2^-24
    for (std::size_t k = 0; k < 3; ++k) {
      if (!is_box && k != 1) continue;
      for (std::size_t i = 0; i < 3; ++i) halves[k][i] = body.solid.axes[k][i] * solid.size[k];
    }
    for (std::uint32_t corner = 0; corner < corners; ++corner) {
      const std::uint32_t below = is_box ? corner : corner << 1U;  // bit k: on the other side along axis k
      Vec3l at{};
      for (std::size_t k = 0; k < 3; ++k) {
        for (std::size_t i = 0; i < 3; ++i) at[i] += (below >> k & 1U) != 0 ? -halves[k][i] : halves[k][i];
      }
      for (std::int64_t& x : at) x >>= L::kAxisBits;
      Vec3i p{};
      for (std::size_t i = 0; i < 3; ++i)
        p[i] = limited(body.solid.p[i] + (at[i] >> L::kLengthBits), kPositionLimit);
      const std::int32_t most = limited((radius >> L::kLengthBits) + margin, kPositionLimit);
      const WallTouch near = shape.touch(shape.of, p, most);
      if (near.overlap <= 0) continue;
      RigidPoint point{.n = {}, .gap = 0, .at = {}};
      point.gap = ((most - near.overlap - wall) << L::kLengthBits) - radius;
      for (std::size_t i = 0; i < 3; ++i) {
        point.n[i] = std::clamp(near.out[i], -(1 << L::kNormalBits), 1 << L::kNormalBits);
        point.at[i] = at[i] - (point.n[i] * radius >> L::kNormalBits);
      }
      points_.add(point);
    }
    const std::size_t first = found_.size();
    find_points(place, count_, {});
    if (add(place, count_, wave, first)) used_[place] |= std::uint64_t{1} << wave;
  }
}

void Rigid::find_walls(const StepInput& input) {
  const std::int64_t wall = input.parameters.contacts.wall;
  const auto each = [&](const auto& shapes) {
    for (const auto& shape : shapes) {
      using Shape = std::remove_cvref_t<decltype(shape)>;
      find_wall(
          {&shape, [](const void* of, const Vec3i& p,
                      std::int32_t radius) { return touch(*static_cast<const Shape*>(of), p, radius); }},
          wall);
    }
  };
  each(constants_.contact.planes);
  each(constants_.contact.boxes);
  each(constants_.contact.balls);
}

}  // namespace tandem
