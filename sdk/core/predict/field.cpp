// The tier `field`: v += g + c + contact forces, then as `ballistic`.
#include "sdk/core/predict/field.hpp"

#include <bit>
#include <utility>

#include "sdk/core/lattice/fixed_point.hpp"
#include "sdk/core/predict/contact_walls.hpp"

namespace tandem {
namespace {

constexpr std::uint32_t kDiameterBits = 13;

// Every grid needs four cells a side, or the cells before and behind one would be the same.
std::uint32_t side_bits_for(std::uint32_t capacity) {
  std::uint32_t bits = 2;
  while ((1U << (3 * bits)) < 2 * capacity) ++bits;
  return bits;
}

std::int16_t gain16(std::int64_t x) { return static_cast<std::int16_t>(std::min<std::int64_t>(x, 32767)); }

constexpr std::int32_t kMostPasses = 2;

}  // namespace

Result<std::unique_ptr<Predictor>> Field::create(std::uint32_t capacity,
                                                 std::span<const std::int32_t> constants) {
  return read_contact_constants(constants).map([&](ContactConstants&& read) {
    return std::unique_ptr<Predictor>(std::make_unique<Field>(capacity, std::move(read)));
  });
}

Field::Field(std::uint32_t capacity, ContactConstants constants)
    : constants_(std::move(constants)),
      side_bits_(side_bits_for(capacity)),
      cell_(capacity),
      rank_(capacity),
      begin_((std::size_t{1} << (3 * side_bits_)) + 1),
      slot_(capacity) {
  for (auto* columns : {&p_, &v_, &f_})
    for (auto& column : *columns) column.resize(capacity + 8);
  for (auto& column : wall_force_) column.resize(capacity);
  for (const auto& type : constants_.types) diameter_ = std::max(diameter_, 2 * type.radius);
  const auto bits = static_cast<std::uint32_t>(std::bit_width(static_cast<std::uint32_t>(diameter_)));
  shift_ = bits > 14 ? bits - 14 : 0;
  const std::int64_t width = diameter_ >> shift_;
  per_diameter_ = (std::int64_t{1} << (kDiameterBits + 16)) / width;
  // Bodies apart that share a cell of the torus must not share the low bits of their positions.
  const std::int64_t edge = 8192 + (26214 >> side_bits_);
  cells_per_ = (std::int64_t{1} << 32) / edge;
  passes_ = std::min(kMostPasses, constants_.substeps);
  move_ = (65536 + passes_ / 2) / passes_;
  const std::int64_t substeps = constants_.substeps / passes_;  // in a pass
  const auto& pair = constants_.pair;
  law_.spring = gain16(4 * substeps * pair.spring);
  law_.drag = gain16(8 * substeps * (pair.damping + pair.shear));
  std::int64_t shear = 8 * substeps * pair.shear;
  law_.shear_shift = 4;
  for (; law_.shear_shift > 0 && shear * 2 < 32768; --law_.shear_shift) shear *= 2;
  law_.shear = gain16(shear);
  const auto gain = [&](std::int32_t per_substep) {
    return static_cast<std::int32_t>(per_substep * substeps);
  };
  wall_ = {gain(constants_.wall.spring), gain(constants_.wall.damping), gain(constants_.wall.shear)};
}

void Field::sort(const State& state) {
  std::fill(begin_.begin(), begin_.end(), 0U);
  const std::uint32_t mask = (1U << side_bits_) - 1;
  for (Slot s = 0; s < state.capacity(); ++s) {
    if (state.alive()[s] == 0) continue;
    std::uint32_t cell = 0;
    for (std::size_t i = 3; i-- > 0;) {
      const std::int64_t at = ((state.p(i)[s] >> shift_) * per_diameter_) >> 16;
      cell = (cell << side_bits_) | (static_cast<std::uint32_t>(at * cells_per_ >> 32) & mask);
    }
    cell_[s] = cell;
    rank_[s] = begin_[cell]++;
  }
  std::uint32_t sum = 0;
  for (std::uint32_t& begin : begin_) {
    const std::uint32_t in_cell = std::min(begin, FieldGrid::kMostInCell);
    begin = sum;
    sum += in_cell;
  }
  count_ = sum;
  for (Slot s = 0; s < state.capacity(); ++s) {
    if (state.alive()[s] == 0) continue;
    const std::uint32_t place = rank_[s] < FieldGrid::kMostInCell ? begin_[cell_[s]] + rank_[s] : count_++;
    slot_[place] = s;
  }
}

void Field::put_into_lanes(const State& state) {
  for (std::size_t i = 0; i < 3; ++i) {
    const std::int32_t* const p = state.p(i).data();
    const std::int32_t* const v = state.v(i).data();
    for (std::uint32_t place = 0; place < count_; ++place) {
      const Slot s = slot_[place];
      p_[i][place] = static_cast<std::int16_t>((p[s] >> shift_) * per_diameter_ >> 16);
      const std::int64_t speed = (v[s] >> shift_) * per_diameter_ >> 21;
      v_[i][place] = static_cast<std::int16_t>(std::clamp<std::int64_t>(speed, -32768, 32767));
      f_[i][place] = 0;
    }
  }
}

template <class Shape>
void Field::add_wall(const State& state, const Shape& shape, std::uint32_t place) {
  const Slot s = slot_[place];
  const WallTouch t = touch(shape, {state.p(0)[s], state.p(1)[s], state.p(2)[s]}, type_of(state, s).radius);
  if (t.overlap <= 0) return;
  std::int64_t closing = 0;
  for (std::size_t i = 0; i < 3; ++i) closing -= std::int64_t{state.v(i)[s]} * t.out[i];
  closing >>= 14;
  const std::int64_t push = (wall_.spring * t.overlap >> 8) - (wall_.shear * closing >> 13);
  const std::int64_t drag = std::int64_t{wall_.damping} + wall_.shear;
  for (std::size_t i = 0; i < 3; ++i)
    wall_force_[i][place] += ((push * t.out[i]) >> 14) - ((drag * state.v(i)[s]) >> 13);
}

void Field::add_walls(const State& state) {
  for (auto& column : wall_force_) std::fill_n(column.begin(), count_, 0);
  const auto add = [&](const auto& shapes) {
    for (const auto& shape : shapes)
      for (std::uint32_t place = 0; place < count_; ++place) add_wall(state, shape, place);
  };
  add(constants_.planes);
  add(constants_.boxes);
  add(constants_.balls);
}

void Field::integrate(State& state, const Drive& drive, bool first) const {
  for (std::uint32_t place = 0; place < count_; ++place) {
    const Slot s = slot_[place];
    const std::int64_t mobility = type_of(state, s).mobility;
    for (std::size_t i = 0; i < 3; ++i) {
      std::int32_t& p = state.p(i)[s];
      std::int32_t& v = state.v(i)[s];
      std::int32_t& c = state.c(i)[s];
      const std::int64_t force = ((std::int64_t{f_[i][place]} * diameter_) >> 8) + wall_force_[i][place];
      std::int64_t speed = v + share_of(limited(force, kVelocityLimit), mobility);
      if (first) {
        speed += std::int64_t{drive.gravity[i]} + c;
        c = limited(c - share_of(c, drive.decay), kVelocityLimit);
        speed -= share_of(speed, drive.damping);
      }
      v = limited(speed, kVelocityLimit);
      p = limited(p + ((std::int64_t{v} * move_ + (1 << 21)) >> 22), kPositionLimit);
    }
  }
}

void Field::step(const State& from, State& to, const Drive& drive) {
  if (&from != &to) to = from;
  sort(to);
  for (std::int32_t pass = 0; pass < passes_; ++pass) {
    add_walls(to);
    put_into_lanes(to);
    add_field_forces(law_,
                     {side_bits_,
                      begin_.data(),
                      {p_[0].data(), p_[1].data(), p_[2].data()},
                      {v_[0].data(), v_[1].data(), v_[2].data()}},
                     {f_[0].data(), f_[1].data(), f_[2].data()});
    integrate(to, drive, pass == 0);
  }
}

void Field::step_slots(const State& from, State& to, const Drive& drive, std::span<const Slot> /*slots*/) {
  step(from, to, drive);
}

}  // namespace tandem
