// The predictors `contact` and `field`: v += g + c + contact forces, then as `ballistic`. Forces are computed
// from the state at the start of a sub-step, after S. Green, "Particle Simulation using CUDA" (2008):
//   (damping + shear) * u - (spring * overlap + shear * (u.n)) * n
#include "sdk/core/predict/contact/contact.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>

#include "sdk/core/lattice/vector_clones.hpp"
#include "sdk/core/predict/contact/move.hpp"
#include "sdk/core/predict/rest.hpp"

namespace tandem {
namespace {

constexpr std::uint32_t kReachBits = 14;
constexpr std::uint32_t kRootShift = 16;
constexpr std::size_t kRoots = std::size_t{1} << (2 * kReachBits - kRootShift);
constexpr std::uint32_t kNearShift = 5;
constexpr std::uint32_t kBeyond = 8;  // number of places that a vector may read behind the last body
constexpr std::uint32_t kPairsPerBody = 6;
constexpr std::uint32_t kPairsAtOnce = 1024;
constexpr std::uint32_t kRoomForPairs = kPairsAtOnce + ContactPairs::kMostAtOnce + ContactPairs::kBatch;

// Every grid needs four cells per side; otherwise the cells before and behind one would be the same.
std::uint32_t side_bits_for(std::uint32_t capacity) {
  std::uint32_t bits = 2;
  while ((1U << (3 * bits)) < 2 * capacity) ++bits;
  return bits;
}

std::int32_t largest_radius_of(const ContactConstants& constants) {
  std::int32_t largest = 1;
  for (const auto& type : constants.types) largest = std::max(largest, type.radius);
  return largest;
}

// The shift from lattice units to grid units: two touching bodies are less than 2^14 grid units apart.
std::uint32_t shift_for(std::int32_t largest_radius) {
  const auto bits =
      static_cast<std::uint32_t>(std::bit_width(2 * static_cast<std::uint32_t>(largest_radius)));
  return bits > kReachBits ? bits - kReachBits : 0;
}

ContactLaw law_of(const ContactMaterial& material, std::uint32_t shift) {
  return {material.spring, material.damping + material.shear, material.shear, shift};
}

struct CellNumbers {
  std::uint32_t shift, side_bits;
  std::int32_t cells_per;
};

TANDEM_VECTOR_CLONES void number_cells(const CellNumbers& how, const std::int32_t* __restrict x,
                                       const std::int32_t* __restrict y, const std::int32_t* __restrict z,
                                       std::uint32_t* __restrict cell, std::size_t count) {
  const std::uint32_t last = (1U << (3 * how.side_bits)) - 1;
  const auto along = [shift = how.shift, cells_per = how.cells_per](std::int32_t p) {
    return static_cast<std::uint32_t>(std::int64_t{p >> shift} * cells_per >> 32);
  };
  for (std::size_t s = 0; s < count; ++s) {
    cell[s] = (along(x[s]) + (along(y[s]) << how.side_bits) + (along(z[s]) << (2 * how.side_bits))) & last;
  }
}

TANDEM_VECTOR_CLONES bool any_of(const std::int32_t* c, std::size_t count) {
  std::int32_t all = 0;
  for (std::size_t s = 0; s < count; ++s) all |= c[s];
  return all != 0;
}

bool accelerated(const State& state) {
  const std::size_t count = state.capacity();
  return any_of(state.c(0).data(), count) || any_of(state.c(1).data(), count) ||
         any_of(state.c(2).data(), count);
}

// Computes the rank of each body among those of its cell, by slot; from kMostInCell on all have the same
// rank.
void rank_in_cells(std::span<const std::uint32_t> cells, std::span<const std::uint8_t> alive,
                   std::span<std::uint8_t> in_cell, std::span<std::uint32_t> ranks) {
  for (std::size_t s = 0; s < cells.size(); ++s) {
    std::uint8_t& count = in_cell[cells[s]];
    ranks[s] = count;
    count = static_cast<std::uint8_t>(count +
                                      (alive[s] & static_cast<unsigned>(count < ContactGrid::kMostInCell)));
  }
}

// The places of the cells' first bodies, and how many there are, eight cells at a time: the product has in
// each byte the sum of the bytes up to it.
TANDEM_VECTOR_CLONES std::uint32_t begin_cells(std::span<const std::uint8_t> in_cell,
                                               std::span<std::uint32_t> begin) {
  static_assert(8 * ContactGrid::kMostInCell < 256);
  std::uint32_t sum = 0;
  for (std::size_t cell = 0; cell < in_cell.size(); cell += 8) {
    std::uint64_t counts = 0;
    std::memcpy(&counts, &in_cell[cell], sizeof counts);
    const std::uint64_t sums = counts * 0x0101010101010101U;
    std::array<std::uint8_t, 8> before{};
    const std::uint64_t shifted = sums << 8U;
    std::memcpy(before.data(), &shifted, sizeof shifted);
    for (std::size_t i = 0; i < 8; ++i) begin[cell + i] = sum + before[i];
    sum += static_cast<std::uint32_t>(sums >> 56U);
  }
  begin[in_cell.size()] = sum;
  return sum;
}

}  // namespace

Contact::Contact(std::uint32_t capacity, ContactConstants constants)
    : constants_(std::move(constants)),
      largest_radius_(largest_radius_of(constants_)),
      shift_(shift_for(largest_radius_)),
      pair_law_(law_of(constants_.pair, shift_)),
      kernels_(fastest_contact_kernels()),
      walls_(constants_, law_of(constants_.wall, shift_), largest_radius_),
      side_bits_(side_bits_for(capacity)),
      cell_(capacity),
      place_(capacity + kBeyond),
      in_cell_(std::size_t{1} << (3 * side_bits_)),
      begin_(in_cell_.size() + 1),
      bodies_(capacity),
      views_(capacity),
      forces_(capacity, ContactForce{{}, 65536}),
      place_cell_(capacity),
      near_xy_(capacity + kBeyond),
      later_xy_(constants_.substeps > 1 ? near_xy_.size() : 0),
      near_z_(near_xy_.size()),
      first_((constants_.substeps > 1 ? kPairsPerBody * capacity : 0) + kRoomForPairs),
      second_(first_.size()),
      inverse_root_(kRoots) {
  const std::uint32_t width = 2 * static_cast<std::uint32_t>(largest_radius_) >> shift_;
  cells_per_ = static_cast<std::int32_t>((std::uint64_t{1} << 32) / (width + 1));
  near_ = ((width + (constants_.substeps > 1 ? width >> 5 : 0)) >> kNearShift) + 3;
  later_share_ = 32768 - (32768 + constants_.substeps / 2) / constants_.substeps;
  one_mobility_ = std::all_of(constants_.types.begin(), constants_.types.end(),
                              [](const auto& type) { return type.mobility == 65536; });
  for (std::size_t i = 0; i < kRoots; ++i) {
    // r at the middle of the entry, in 2^-8.
    const std::int64_t r = root(((2 * std::uint64_t{i} + 1) << (kRootShift - 1)) << 16U);
    inverse_root_[i] = static_cast<std::uint32_t>((std::int64_t{1} << 38) / r);
  }
}

void Contact::sort(const State& state) {
  const std::uint32_t capacity = state.capacity();
  number_cells({shift_, side_bits_, cells_per_}, state.p(0).data(), state.p(1).data(), state.p(2).data(),
               cell_.data(), capacity);
  std::fill(in_cell_.begin(), in_cell_.end(), std::uint8_t{0});
  rank_in_cells(cell_, state.alive(), in_cell_, place_);
  count_ = begin_cells(in_cell_, begin_);
  scatter(state);
}

// The loop reads nothing of this object, because the compiler would read it again after every write.
void Contact::scatter(const State& state) {
  const std::array<const std::int32_t*, 3> p{state.p(0).data(), state.p(1).data(), state.p(2).data()};
  const std::array<const std::int32_t*, 3> v{state.v(0).data(), state.v(1).data(), state.v(2).data()};
  const std::uint8_t* const alive = state.alive().data();
  const TypeId* const type = state.type().data();
  const std::uint32_t* const begin = begin_.data();
  const std::uint32_t* const cells = cell_.data();
  std::uint32_t* const places = place_.data();
  std::uint32_t* const place_cell = place_cell_.data();
  ContactBody* const bodies = bodies_.data();
  ContactForce* const forces = forces_.data();
  const bool one_mobility = one_mobility_;
  std::uint32_t count = count_;
  for (Slot s = 0, end = state.capacity(); s < end; ++s) {
    if (alive[s] == 0) {
      places[s] = 0;
      continue;
    }
    const std::uint32_t cell = cells[s];
    const std::uint32_t place = places[s] < ContactGrid::kMostInCell ? begin[cell] + places[s] : count++;
    const ContactConstants::Type& its = constants_.type_of(type[s]);
    places[s] = place;
    place_cell[place] = cell;
    bodies[place] = {{p[0][s], p[1][s], p[2][s]}, its.radius, {v[0][s], v[1][s], v[2][s]}, s};
    if (!one_mobility) forces[place].mobility = its.mobility;
  }
  count_ = count;
}

// Pairs are processed while they are in the cache; those left over from a batch go with the next. They are
// kept for the later sub-steps while there is room; otherwise they are found again.
void Contact::add_pairs(bool first) {
  constexpr std::uint32_t kBatch = ContactPairs::kBatch;
  const auto add_forces = [this](std::uint32_t begin, std::uint32_t end) {
    kernels_.add_forces(pair_law_, inverse_root_.data(), views_.data(),
                        {first_.data() + begin, second_.data() + begin, end - begin}, forces_.data());
  };
  if (!first && all_kept_) return add_forces(0, kept_);
  const ContactGrid grid{side_bits_,
                         begin_.data(),
                         place_cell_.data(),
                         near_xy_.data(),
                         later_xy_.empty() ? nullptr : later_xy_.data(),
                         near_z_.data(),
                         near_ * near_};
  const auto room = static_cast<std::uint32_t>(first_.size());
  ContactPairs pairs{first_.data(), second_.data(), 0};
  std::uint32_t done = 0;
  all_kept_ = true;
  for (std::uint32_t place = 0; place < begin_.back();) {
    place = kernels_.find(grid, place, done + kPairsAtOnce, pairs);
    const std::uint32_t whole = pairs.count - pairs.count % kBatch;
    add_forces(done, whole);
    done = whole;
    if (constants_.substeps > 1 && room - done >= kRoomForPairs) continue;
    if (done > 0) {
      std::copy(&first_[done], &first_[pairs.count], &first_[0]);
      std::copy(&second_[done], &second_[pairs.count], &second_[0]);
      pairs.count -= done;
      done = 0;
    }
    all_kept_ = false;
  }
  for (; pairs.count % kBatch != 0; ++pairs.count) first_[pairs.count] = second_[pairs.count] = 0;
  add_forces(done, pairs.count);
  kept_ = pairs.count;
}

// Copies all columns that do not move.
void Contact::copy(const State& from, State& to) const {
  if (&from == &to) return;
  const auto copy = [](const auto& column, const auto& column_to) {
    std::copy(column.begin(), column.end(), column_to.begin());
  };
  copy(from.alive(), to.alive());
  copy(from.reuse(), to.reuse());
  copy(from.type(), to.type());
}

void Contact::step(const State& from, State& to, const StepInput& input) {
  const bool some_rest = keep_at_rest(from, to, input.drive);
  sort(from);
  const auto bodies = std::span(bodies_).first(count_);
  place_bodies(bodies, {shift_, shift_ + kNearShift, later_share_, near_xy_, later_xy_, near_z_}, views_,
               forces_);
  copy(from, to);
  ContactMove move{shift_,
                   constants_.substeps,
                   input.drive.gravity,
                   input.drive.damping,
                   some_rest ? std::span<const std::uint8_t>(to.rest()) : std::span<const std::uint8_t>(),
                   constants_.substeps > 1 && accelerated(from) ? &from : nullptr,
                   input.parameters.decay};
  for (std::int32_t i = 0; i < constants_.substeps; ++i) {
    walls_.add_forces(bodies, forces_);
    add_pairs(i == 0);
    if (i + 1 < constants_.substeps) {
      move_bodies(move, bodies, forces_, views_);
      move.gravity = {};
      move.damping = 0;
      move.accelerated = nullptr;
    } else {
      move_bodies(move, bodies_, forces_, place_, from, to);
    }
  }
  step_groups(from, to);
}

void Contact::step_slots(const State& from, State& to, const StepInput& input,
                         std::span<const Slot> /*slots*/) {
  step(from, to, input);
}

}  // namespace tandem
