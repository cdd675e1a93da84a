// The tier `field`: v += g + c + contact forces, then as `ballistic`.
#include "sdk/core/predict/field.hpp"

#include <bit>
#include <utility>

#include "sdk/core/lattice/fixed_point.hpp"
#include "sdk/core/lattice/vector_clones.hpp"

namespace tandem {
namespace {

// Eight cells a side or more, so that a way round the torus is a whole number of times 2^16 but for the edge.
std::uint32_t side_bits_for(std::uint32_t capacity) {
  std::uint32_t bits = 3;
  while ((1U << (3 * bits)) < 2 * capacity) ++bits;
  return bits;
}

FieldForces* fastest_forces() {
#ifdef TANDEM_FIELD_AVX2
  if (__builtin_cpu_supports("avx2") != 0) return set_field_forces_avx2;
#endif
  return set_field_forces;
}

std::int16_t gain16(std::int64_t x) { return static_cast<std::int16_t>(std::min<std::int64_t>(x, 32767)); }

// A frame is one step whatever the sub-steps of the world. A stiffer spring than this would shake in it: an
// overlap gives at most half of itself a frame.
constexpr std::int64_t kMostSpring = 1 << 15;  // in 2^-16

// Shear in 2^-(16 - bits), so that drag less shear, what slows bodies down along the normal, takes out at
// least what moving late (see `move`) puts in.
std::int64_t least_shear(std::int64_t shear, std::int64_t drag, std::int64_t spring, int bits,
                         std::int64_t substeps) {
  return substeps == 1 ? shear : std::min(shear, drag - (spring >> (3 + bits)));
}

// Gains of a frame.
ContactMaterial wall_gains(const ContactConstants& constants) {
  const std::int32_t substeps = constants.substeps;
  const ContactMaterial& wall = constants.wall;
  const std::int64_t spring = std::min<std::int64_t>(std::int64_t{wall.spring} * substeps, kMostSpring >> 2);
  const std::int32_t drag = (wall.damping + wall.shear) * substeps;
  const auto shear =
      static_cast<std::int32_t>(least_shear(wall.shear * substeps, drag, spring << 2, 3, substeps));
  return {static_cast<std::int32_t>(spring), drag - shear, shear};
}

FieldLaw pair_law(const ContactConstants& constants) {
  const std::int64_t substeps = constants.substeps;
  const ContactMaterial& pair = constants.pair;
  FieldLaw law;
  law.spring = gain16(std::min(4 * substeps * pair.spring, kMostSpring));
  law.drag = gain16(8 * substeps * (pair.damping + pair.shear));
  std::int64_t shear = least_shear(8 * substeps * pair.shear, law.drag, law.spring, 0, substeps);
  law.shear_shift = 4;
  for (; law.shear_shift > 0 && std::abs(shear) * 2 <= 32767; --law.shear_shift) shear *= 2;
  law.shear = gain16(shear);
  return law;
}

// Adds one axis to the cells' numbers.
TANDEM_VECTOR_CLONES void add_axis(const std::int32_t* __restrict p, std::uint32_t* __restrict cell,
                                   std::size_t count, std::uint32_t shift, std::int32_t cells_per,
                                   std::uint32_t side_bits, std::uint32_t axis) {
  const std::uint32_t mask = (1U << side_bits) - 1;
  for (std::size_t s = 0; s < count; ++s) {
    const auto along = static_cast<std::uint32_t>(std::int64_t{p[s] >> shift} * cells_per >> 32);
    cell[s] |= (along & mask) << (axis * side_bits);
  }
}

// As `ballistic`, plus the force. A dead slot is all zero; it stays so without gravity. A body that moved in
// several sub-steps did not move by all of the force: an eighth is left out where `late` is -1.
TANDEM_VECTOR_CLONES void move(std::int32_t* __restrict p, std::int32_t* __restrict v,
                               std::int32_t* __restrict c, const std::int32_t* __restrict force,
                               const std::uint8_t* __restrict alive, std::size_t count, std::int32_t gravity,
                               std::int64_t damping, std::int64_t decay, std::int32_t late) {
  for (std::size_t s = 0; s < count; ++s) {
    std::int32_t speed = v[s] + force[s] + c[s] + (gravity & -static_cast<std::int32_t>(alive[s]));
    c[s] -= static_cast<std::int32_t>((c[s] * decay + 32768) >> 16);
    speed -= static_cast<std::int32_t>((speed * damping + 32768) >> 16);
    speed = std::clamp(speed, -kVelocityLimit, kVelocityLimit);
    v[s] = speed;
    p[s] = std::clamp(p[s] + ((speed - ((force[s] >> 3) & late) + 32) >> 6), -kPositionLimit, kPositionLimit);
  }
}

}  // namespace

Result<std::unique_ptr<Predictor>> Field::create(std::uint32_t capacity,
                                                 std::span<const std::int32_t> constants) {
  return read_contact_constants(constants).map([&](ContactConstants&& read) {
    return std::unique_ptr<Predictor>(std::make_unique<Field>(capacity, std::move(read)));
  });
}

Field::Field(std::uint32_t capacity, ContactConstants constants)
    : constants_(std::move(constants)),
      set_forces_(fastest_forces()),
      walls_(constants_, wall_gains(constants_), capacity),
      law_(pair_law(constants_)),
      side_bits_(side_bits_for(capacity)),
      cell_(capacity),
      rank_(capacity),
      begin_((std::size_t{1} << (3 * side_bits_)) + 1),
      slot_(capacity) {
  for (auto* columns : {&p_, &v_})
    for (auto& column : *columns) column.resize(capacity + FieldGrid::kBeyond);
  for (auto& column : f_) column.resize(capacity);
  for (auto& column : force_) column.resize(capacity);
  for (const auto& type : constants_.types) {
    diameter_ = std::max(diameter_, 2 * type.radius);
    equal_masses_ = equal_masses_ && type.mobility == 65536;
  }
  const auto bits = static_cast<std::uint32_t>(std::bit_width(static_cast<std::uint32_t>(diameter_)));
  shift_ = bits > 14 ? bits - 14 : 0;
  const std::uint32_t width = static_cast<std::uint32_t>(diameter_) >> shift_;
  per_diameter_ = (std::uint32_t{1} << 29) / width;
  // A little wider than the largest bodies, so that bodies apart that share a cell of the torus do not share
  // the low bits of their positions as well.
  const std::uint64_t edge = 8192 + (26214U >> side_bits_);
  cells_per_ = static_cast<std::int32_t>((std::uint64_t{1} << 45) / (edge * width));
}

void Field::sort(const State& state) {
  const std::uint32_t capacity = state.capacity();
  const std::span<const std::uint8_t> alive = state.alive();
  std::fill(cell_.begin(), cell_.end(), 0U);
  for (std::uint32_t i = 0; i < 3; ++i)
    add_axis(state.p(i).data(), cell_.data(), capacity, shift_, cells_per_, side_bits_, i);
  std::fill(begin_.begin(), begin_.end(), 0U);
  for (Slot s = 0; s < capacity; ++s) rank_[s] = (begin_[cell_[s]] += alive[s]) - 1;
  std::uint32_t sum = 0;
  for (std::uint32_t& begin : begin_) {
    const std::uint32_t in_cell = std::min(begin, FieldGrid::kMostInCell);
    begin = sum;
    sum += in_cell;
  }
  count_ = sum;
  for (Slot s = 0; s < capacity; ++s) {
    if (alive[s] != 0 && rank_[s] < FieldGrid::kMostInCell) slot_[begin_[cell_[s]] + rank_[s]] = s;
  }
}

void Field::add_pairs(const State& state) {
  const std::int32_t* const p[3] = {state.p(0).data(), state.p(1).data(), state.p(2).data()};
  const std::int32_t* const v[3] = {state.v(0).data(), state.v(1).data(), state.v(2).data()};
  const std::uint32_t positions = per_diameter_;
  const auto speeds = static_cast<std::int32_t>(per_diameter_ >> 1);
  const std::int32_t most = INT32_MAX / speeds;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::uint32_t place = 0; place < count_; ++place) {
      const Slot s = slot_[place];
      p_[i][place] =
          static_cast<std::int16_t>((static_cast<std::uint32_t>(p[i][s] >> shift_) * positions) >> 16);
      const std::int32_t speed = std::clamp(v[i][s] >> (shift_ + 5), -most, most);
      v_[i][place] = static_cast<std::int16_t>(std::clamp((speed * speeds) >> 15, -32768, 32767));
    }
  }
  const FieldGrid grid{side_bits_,
                       begin_.data(),
                       {p_[0].data(), p_[1].data(), p_[2].data()},
                       {v_[0].data(), v_[1].data(), v_[2].data()}};
  set_forces_(law_, grid, {f_[0].data(), f_[1].data(), f_[2].data()});
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::uint32_t place = 0; place < count_; ++place)
      force_[i][slot_[place]] += limited((std::int64_t{f_[i][place]} * diameter_) >> 24, kVelocityLimit);
  }
}

void Field::step(const State& from, State& to, const Drive& drive) {
  if (&from != &to) to = from;
  sort(to);
  for (auto& column : force_) std::fill(column.begin(), column.end(), 0);
  walls_.add_forces(to, {force_[0], force_[1], force_[2]});
  add_pairs(to);
  const std::int32_t late = constants_.substeps > 1 ? -1 : 0;
  for (std::size_t i = 0; i < 3; ++i) {
    std::int32_t* const force = force_[i].data();
    if (!equal_masses_) {
      for (Slot s = 0; s < to.capacity(); ++s)
        force[s] = limited(share_of(force[s], type_of(to, s).mobility), kVelocityLimit);
    }
    move(to.p(i).data(), to.v(i).data(), to.c(i).data(), force, to.alive().data(), to.capacity(),
         drive.gravity[i], drive.damping, drive.decay, late);
  }
}

void Field::step_slots(const State& from, State& to, const Drive& drive, std::span<const Slot> /*slots*/) {
  step(from, to, drive);
}

}  // namespace tandem
