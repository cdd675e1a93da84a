// Where bodies touch each other and the static geometry.
#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstring>
#include <type_traits>

#include "sdk/core/lattice/fixed_point.hpp"
#include "sdk/core/predict/rigid/rigid.hpp"
#include "sdk/core/predict/rigid/word_pairs.hpp"

namespace tandem {
namespace {

using R = RigidLaw;
using S = RigidSolverLaw;

constexpr std::uint64_t kOfPairs = (std::uint64_t{1} << S::kPairWaves) - 1;

// The speed at which points of a pair that have one normal come nearer: a's minus b's along the normal.
class ClosingSpeed {
 public:
  ClosingSpeed(const std::int16_t* n, const RigidRow& a, const RigidRow& b)
      : n_{words_of<std::int32_t>(n[2], -n[1]), words_of<std::int32_t>(n[0], -n[2]),
           words_of<std::int32_t>(n[1], -n[0]), 0},
        w_a_(spin_of(a)),
        w_b_(spin_of(b)) {
    const Four along = dot16(sub_sat16(read<Four>(&a), read<Four>(&b)),
                             Four{words_of<std::int32_t>(n[0], n[1]), n[2], 0, 0});
    of_v_ = along[0] + along[1];
  }

  // Reads four words of each arm.
  [[nodiscard]] std::int32_t at(const std::int16_t* arm_a, const std::int16_t* arm_b) const {
    const Four sum = along(arm_a, w_a_) - along(arm_b, w_b_);
    return (of_v_ + sum[0] + sum[1] + sum[2]) >> S::kBits;
  }

 private:
  static Four spin_of(const RigidRow& row) {
    const EightWords words = read<EightWords>(&row);
    return reinterpret_cast<Four>(__builtin_shufflevector(words, EightWords{}, 4, 12, 5, 13, 6, 14, 7, 15));
  }
  // The components of arm x n, each times that of w.
  [[nodiscard]] Four along(const std::int16_t* arm, Four w) const {
    using Two = std::int64_t __attribute__((vector_size(16)));
    const std::int64_t words = read<std::int64_t>(arm);
    const EightWords twice = reinterpret_cast<EightWords>(Two{words, words});
    const EightWords pairs = __builtin_shufflevector(twice, twice, 1, 2, 2, 0, 4, 5, 6, 7);
    return dot16(dot16(reinterpret_cast<Four>(pairs), n_) >> S::kBits, w);
  }

  Four n_;  // words that make arm x n
  Four w_a_, w_b_;
  std::int32_t of_v_;
};

// Whether a ball touches a shape.
bool reaches(const auto& shape, const Vec3i& p, std::int32_t radius) {
  return touch(shape, p, radius).overlap > 0;
}
bool reaches(const ContactConstants::Plane& plane, const Vec3i& p, std::int32_t radius) {
  return height_above(plane, p) < radius;
}

}  // namespace

// Lengths in lattice units in the unit of pairs, as word_of().
Four Rigid::in_words(Four lengths) const {
  const int up = pair_shift_ < R::kLengthBits ? static_cast<int>(R::kLengthBits - pair_shift_) : 0;
  const int down = pair_shift_ > R::kLengthBits ? static_cast<int>(pair_shift_ - R::kLengthBits) : 0;
  return within(((lengths << up) + (1 << down >> 1)) >> down, same(S::kMaxWord));
}

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
  const std::int64_t reach = std::min(reach_, R::kMaxMargin / 2);
  const std::int64_t most = a.radius + b.radius + reach;  // below 2^26
  // Differences of positions are at most 2^31, which wraps to a number that is far, too.
  Four d = value_of(read<FourBits>(&b.p) - read<FourBits>(&a.p));
  const auto far = [most](std::int32_t x) {
    return bits_of(x) + static_cast<std::uint32_t>(most - 1) > static_cast<std::uint32_t>(2 * most - 2);
  };
  const Vec3i to_b{d[0], d[1], d[2]};
  if (far(to_b[0]) || far(to_b[1]) || far(to_b[2]) || product(to_b, to_b) >= most * most ||
      (a.mobility | b.mobility) == 0)
    return;
  if (!a.is_placed) place_solid(place_a);
  if (!b.is_placed) place_solid(place_b);
  const auto margin = static_cast<std::int32_t>(reach + a.way + b.way);
  Near& near = near_[near_count_];
  near.a = place_a;
  near.b = place_b;
  near.boxes = a.is_box && b.is_box;
  if (near.boxes) {
    RigidBoxPair& pair = box_pairs_[box_count_++];
    d[3] = margin;
    write_words(pair.d, in_words(d));
    pair.a = static_cast<std::uint16_t>(place_a);
    pair.b = static_cast<std::uint16_t>(place_b);
    pair.of = static_cast<std::uint32_t>(near_count_);
  } else {
    near.margin = margin;
    near.d = to_b;
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
      for (std::size_t m = 0; m < 3; ++m) d[m] = std::int64_t{near.d[m]} << R::kLengthBits;
      points_.clear();
      touch_solids(bodies_[near.a].solid, bodies_[near.b].solid, d,
                   std::int64_t{near.margin} << R::kLengthBits, points_);
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
  const std::int64_t reach = reach_ << R::kLengthBits >> shift_;
  const ClosingSpeed speed(pair.n, now_[near.a], now_[near.b]);
  RigidFound found{};
  std::copy_n(pair.n, 3, found.n);
  for (std::size_t m = 0; m < count; ++m) {
    const RigidBoxPoints::Point& point = points.points[m][lane];
    static_assert(offsetof(RigidBoxPoints::Point, arm_b) == offsetof(RigidFound, arm_b));
    std::memcpy(found.arm_a, point.arm_a, offsetof(RigidFound, unused));
    found.gap = limited(std::int64_t{point.gap} << (pair_shift_ - shift_), S::kMaxGap);
    if (found.gap < reach || found.gap + speed.at(point.arm_a, point.arm_b) < reach) found_.push_back(found);
  }
}

// Finds those of points_ where the bodies touch in this frame. `to_b`: b's centre minus a's.
void Rigid::find_points(std::uint32_t a, std::uint32_t b, const Vec3l& to_b) {
  if (found_.size() + points_.all().size() > most_found_) return;
  const std::int64_t reach = reach_ << R::kLengthBits >> shift_;
  for (const RigidPoint& point : points_.all()) {
    RigidFound found{};
    found.gap = limited(point.gap >> shift_, S::kMaxGap);
    for (std::size_t i = 0; i < 3; ++i) {
      const auto arm = [](const Body& body, std::int64_t at) {
        const std::int64_t most = body.solid.solid->radius << R::kLengthBits;
        const std::int64_t x = std::clamp(at, -most, most);
        return static_cast<std::int16_t>(x * body.per_length >> (40 + R::kLengthBits - S::kBits));
      };
      constexpr std::int32_t kShift = R::kNormalBits - S::kBits;
      found.n[i] = static_cast<std::int16_t>(limited((point.n[i] + (1 << (kShift - 1))) >> kShift, S::kOne));
      found.arm_a[i] = arm(bodies_[a], point.at[i]);
      if (b != count_) found.arm_b[i] = arm(bodies_[b], point.at[i] - to_b[i]);
    }
    const auto speed = [&] { return ClosingSpeed(found.n, now_[a], now_[b]).at(found.arm_a, found.arm_b); };
    if (found.gap < reach || found.gap + speed() < reach) found_.push_back(found);
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

void Rigid::find_wall(const Wall& shape, std::uint32_t place, std::int64_t wall) {
  const Ball& ball = balls_[place];
  const Body& body = bodies_[place];
  const SizedSolid& solid = *body.solid.solid;
  const std::int64_t margin = ball.wall_radius + wall - solid.radius;
  const auto wave = static_cast<std::uint32_t>(std::countr_one(used_[place] | kOfPairs));
  if (wave >= S::kWaves) return;
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
    for (std::int64_t& x : at) x >>= R::kAxisBits;
    Vec3i p{};
    for (std::size_t i = 0; i < 3; ++i)
      p[i] = limited(body.solid.p[i] + (at[i] >> R::kLengthBits), kPositionLimit);
    const std::int32_t most = limited((radius >> R::kLengthBits) + margin, kPositionLimit);
    const WallTouch near = shape.touch(shape.of, p, most);
    if (near.overlap <= 0) continue;
    RigidPoint point{.n = {}, .gap = 0, .at = {}};
    point.gap = ((most - near.overlap - wall) << R::kLengthBits) - radius;
    for (std::size_t i = 0; i < 3; ++i) {
      point.n[i] = std::clamp(near.out[i], -(1 << R::kNormalBits), 1 << R::kNormalBits);
      point.at[i] = at[i] - (point.n[i] * radius >> R::kNormalBits);
    }
    points_.add(point);
  }
  const std::size_t first = found_.size();
  find_points(place, count_, {});
  if (add(place, count_, wave, first)) used_[place] |= std::uint64_t{1} << wave;
}

void Rigid::find_walls(const StepInput& input) {
  const std::int64_t wall = input.parameters.contacts.wall;
  const auto each = [&](const auto& shapes) {
    for (const auto& shape : shapes) {
      using Shape = std::remove_cvref_t<decltype(shape)>;
      const Wall of{&shape, [](const void* it, const Vec3i& p, std::int32_t radius) {
                      return touch(*static_cast<const Shape*>(it), p, radius);
                    }};
      for (std::uint32_t place = 0; place < count_; ++place) {
        const Ball& ball = balls_[place];
        if (ball.mobility != 0 && reaches(shape, ball.p, limited(ball.wall_radius + wall, kPositionLimit)))
          find_wall(of, place, wall);
      }
    }
  };
  each(constants_.contact.planes);
  each(constants_.contact.boxes);
  each(constants_.contact.balls);
}

}  // namespace tandem
