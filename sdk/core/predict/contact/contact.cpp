// The predictors `contact` and `field`: v += g + c + contact forces, then as `ballistic`. Forces are computed
// from the state at the start of a sub-step, after S. Green, "Particle Simulation using CUDA" (2008):
//   (damping + shear) * u - (spring * overlap + shear * (u.n)) * n
#include "sdk/core/predict/contact/contact.hpp"

#include <algorithm>
#include <bit>
#include <utility>

#include "sdk/core/lattice/vector_clones.hpp"
#include "sdk/core/predict/blocks_at_rest.hpp"
#include "sdk/core/predict/contact/move.hpp"
#include "sdk/core/predict/rest.hpp"

namespace tandem {
namespace {

constexpr std::uint32_t kReachBits = 14;
constexpr std::uint32_t kRootShift = 16;
constexpr std::size_t kRoots = std::size_t{1} << (2 * kReachBits - kRootShift);
constexpr std::uint32_t kNearShift = 5;
constexpr std::uint32_t kPairsPerBody = 6;
constexpr std::uint32_t kPairsAtOnce = 1024;
constexpr std::uint32_t kRoomForPairs = kPairsAtOnce + ContactPairs::kMostAtOnce + ContactPairs::kBatch;

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

}  // namespace

Contact::Contact(std::uint32_t capacity, ContactConstants constants)
    : constants_(std::move(constants)),
      largest_radius_(largest_radius_of(constants_)),
      shift_(shift_for(largest_radius_)),
      pair_law_(law_of(constants_.pair, shift_)),
      kernels_(fastest_contact_kernels()),
      walls_(constants_, law_of(constants_.wall, shift_), largest_radius_),
      order_(capacity),
      views_(capacity),
      forces_(capacity, ContactForce{{}, 65536}),
      near_xy_(capacity + ContactOrder::kBeyond),
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

// Pairs are processed while they are in the cache; those left over from a batch go with the next. They are
// kept for the later sub-steps while there is room; otherwise they are found again.
void Contact::add_pairs(bool first) {
  constexpr std::uint32_t kBatch = ContactPairs::kBatch;
  const auto add_forces = [this](std::uint32_t begin, std::uint32_t end) {
    kernels_.add_forces(pair_law_, inverse_root_.data(), views_.data(),
                        {first_.data() + begin, second_.data() + begin, end - begin}, forces_.data());
  };
  if (!first && all_kept_) return add_forces(0, kept_);
  const ContactGrid grid{order_.side_bits(),
                         order_.begin().data(),
                         order_.place_cell().data(),
                         near_xy_.data(),
                         later_xy_.empty() ? nullptr : later_xy_.data(),
                         near_z_.data(),
                         near_ * near_};
  const auto room = static_cast<std::uint32_t>(first_.size());
  ContactPairs pairs{first_.data(), second_.data(), 0};
  std::uint32_t done = 0;
  all_kept_ = true;
  for (std::uint32_t place = 0; place < order_.begin().back();) {
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
  const std::span<ContactBody> bodies = order_.sort(from, constants_.types, {shift_, cells_per_});
  for (std::size_t place = 0; !one_mobility_ && place < bodies.size(); ++place)
    forces_[place].mobility = constants_.type_of(from.type()[bodies[place].slot]).mobility;
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
      move_bodies(move, bodies, forces_, order_.place(), from, to);
    }
  }
  step_groups(from, to);
}

void Contact::step_blocks(const State& from, State& to, const StepInput& input, const StepLedgers& ledgers) {
  const std::uint32_t blocks = block_count(from.capacity());
  const auto& at_rest = ledgers.from.at_rest;
  if (rest_lasts(input) &&
      std::all_of(at_rest.begin(), at_rest.end(), [](std::uint8_t is) { return is != 0; })) {
    for (std::uint32_t block = 0; block < blocks; ++block) keep_block(from, to, block, ledgers);
    return;
  }
  step(from, to, input);
  ledgers.to.renew_all(ledgers.number);
  for (std::uint32_t block = 0; block < blocks; ++block) {
    const Slot first = block * kBlockSlots;
    const bool rests = all_at_rest(to, first, std::min(kBlockSlots, to.capacity() - first));
    ledgers.to.at_rest[block] = static_cast<std::uint8_t>(rests);
  }
}

void Contact::step_slots(const State& from, State& to, const StepInput& input,
                         std::span<const Slot> /*slots*/) {
  step(from, to, input);
}

}  // namespace tandem
