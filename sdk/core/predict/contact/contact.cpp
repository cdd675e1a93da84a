// The predictors `contact` and `field`: v += g + c + contact forces, then as `ballistic`. Forces are computed
// from the state at the start of a sub-step, after S. Green, "Particle Simulation using CUDA" (2008):
//   (damping + shear) * u - (spring * overlap + shear * (u.n)) * n
#include "sdk/core/predict/contact/contact.hpp"

#include <algorithm>
#include <bit>
#include <utility>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/lattice/fixed_point.hpp"
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
constexpr std::uint32_t kRoomForPairs = kPairsAtOnce + ContactPairs::kMaxAtOnce + ContactPairs::kBatch;
constexpr std::uint32_t kPlaces = 4096;  // places that are worked on in a block
constexpr std::uint32_t kSlotsAtOnce = BlockLedger::kRunSlots;
constexpr std::uint32_t kMostlyAtRest = 8;  // fewer than one in so many moves

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

// Calls work(first, count) for parts of [0, count) of `at_once` each.
template <class Work>
void run_parts(const RunBlocks& run, std::size_t count, std::uint32_t at_once, const Work& work) {
  const auto parts = static_cast<std::uint32_t>((count + at_once - 1) / at_once);
  run_jobs(parts, run, [&](std::uint32_t part) {
    const std::size_t first = std::size_t{part} * at_once;
    work(first, std::min<std::size_t>(at_once, count - first));
  });
}

std::uint32_t sum_of(std::span<const std::uint8_t> flags) {
  std::uint32_t sum = 0;
  for (const std::uint8_t flag : flags) sum += flag;
  return sum;
}

// Copies what no step changes.
void copy_still_columns(const State& from, State& to, Slot first, std::uint32_t count) {
  std::copy_n(&from.alive()[first], count, &to.alive()[first]);
  std::copy_n(&from.reuse()[first], count, &to.reuse()[first]);
  std::copy_n(&from.type()[first], count, &to.type()[first]);
}

void copy_columns(const State& from, State& to, Slot first, std::uint32_t count) {
  copy_still_columns(from, to, first, count);
  copy_motion(from, to, first, count);
}

}  // namespace

Contact::Contact(std::uint32_t capacity, ContactConstants constants, const ContactKernels& kernels)
    : constants_(std::move(constants)),
      largest_radius_(largest_radius_of(constants_)),
      shift_(shift_for(largest_radius_)),
      pair_law_(law_of(constants_.pair, shift_)),
      kernels_(kernels),
      walls_(constants_, law_of(constants_.wall, shift_), largest_radius_),
      present_(block_count(capacity)),
      still_(present_.size()),
      order_(capacity),
      own_touches_(constants_.substeps > 1 ? capacity : 0),
      touches_(own_touches_.empty() ? reinterpret_cast<ContactTouch*>(order_.room().data())
                                    : own_touches_.data()),
      near_xy_(capacity + ContactOrder::kBeyond),
      later_xy_(constants_.substeps > 1 ? near_xy_.size() : 0),
      near_z_(near_xy_.size()),
      first_(constants_.substeps > 1 ? kPairsPerBody * capacity + kRoomForPairs : 0),
      second_(first_.size()),
      inverse_root_(kRoots) {
  TANDEM_ASSERT(!constants_.types.empty() && constants_.substeps >= 1);
  const std::uint32_t width = 2 * static_cast<std::uint32_t>(largest_radius_) >> shift_;
  cells_per_ = static_cast<std::int32_t>((std::uint64_t{1} << 32) / (width + 1));
  near_ = ((width + (constants_.substeps > 1 ? width >> 5 : 0)) >> kNearShift) + 3;
  later_share_ = 32768 - (32768 + constants_.substeps / 2) / constants_.substeps;
  one_mobility_ = std::all_of(constants_.types.begin(), constants_.types.end(),
                              [](const auto& type) { return type.mobility == 65536; });
  for (std::size_t i = 0; i < kRoots; ++i) {
    // r at the middle of the entry, in 2^-8.
    const std::int64_t r = length_of(((2 * std::uint64_t{i} + 1) << (kRootShift - 1)) << 16U);
    inverse_root_[i] = static_cast<std::uint32_t>((std::int64_t{1} << 38) / r);
  }
}

// Blocks that stay as they are are not read: they are still those that were counted when they came to rest,
// or when the state was another, which matters little, as the numbers only decide what is faster.
Contact::Present Contact::keep_at_rest_in_blocks(const State& from, State& to, const StepInput& input,
                                                 const StepLedgers* ledgers) {
  const bool lasts = ledgers != nullptr && rest_lasts(input);
  run_parts(run_, from.capacity(), kBlockSlots, [&](std::size_t first, std::size_t count) {
    const std::size_t block = first / kBlockSlots;
    Present& present = present_[block];
    present.stays = lasts && ledgers->from.at_rest[block] != 0;
    if (present.stays) {
      present.at_rest = present.alive;
      keep_block(from, to, static_cast<std::uint32_t>(block), *ledgers);
    } else {
      present.alive = sum_of(from.alive().subspan(first, count));
      present.at_rest =
          keep_at_rest(from, to, input.drive, static_cast<Slot>(first), static_cast<std::uint32_t>(count));
    }
    still_[block] = static_cast<std::uint8_t>(present.at_rest == present.alive);
  });
  Present all;
  for (const Present& block : present_) {
    all.alive += block.alive;
    all.at_rest += block.at_rest;
  }
  return all;
}

ContactOrder::Input Contact::what_to_sort(const State& from, const State& to, const Present& all,
                                          const StepLedgers* ledgers) const {
  ContactOrder::Input input{from, constants_.types, {shift_, cells_per_}, run_};
  // Pairs of several sub-steps include bodies that are far from each other when they are sorted.
  input.any_cells = constants_.substeps == 1;
  if (all.alive - all.at_rest >= all.alive / kMostlyAtRest) return input;
  input.at_rest = to.rest();
  if (ledgers == nullptr) return input;
  input.still = still_;
  input.numbers = ledgers->from.numbers;
  return input;
}

// Writes what pairs need to know of bodies, and the forces of the static geometry on them.
void Contact::take(std::span<const ContactBody> bodies, const std::uint32_t* places) {
  std::array<ContactForce, kAtOnce> forces;
  forces.fill({{}, 65536});
  for (std::size_t k = 0; !one_mobility_ && k < bodies.size(); ++k)
    forces[k].mobility = constants_.type_of(from_->type()[bodies[k].slot]).mobility;
  walls_.add_forces(bodies, forces);
  place_bodies(bodies, places, forces,
               {shift_, shift_ + kNearShift, later_share_, near_xy_.data(),
                later_xy_.empty() ? nullptr : later_xy_.data(), near_z_.data()},
               touches_);
  if (constants_.substeps == 1) return;
  for (std::size_t k = 0; k < bodies.size(); ++k) order_.room()[places[k]] = bodies[k];
}

void Contact::move(std::uint32_t from, std::uint32_t to, std::uint32_t count) {
  std::copy_n(touches_ + from, count, touches_ + to);
  std::copy_n(&near_xy_[from], count, &near_xy_[to]);
  std::copy_n(&near_z_[from], count, &near_z_[to]);
  if (constants_.substeps == 1) return;
  std::copy_n(&later_xy_[from], count, &later_xy_[to]);
  std::copy_n(&order_.room()[from], count, &order_.room()[to]);
}

void Contact::add_all_pairs(bool first) {
  const std::span<const ContactSlab> slabs = slabs_.all();
  const auto count = static_cast<std::uint32_t>(slabs.size());
  if (count == 1) return add_pairs(slabs[0], kept_[0], first);
  for (std::uint32_t odd = 0; odd < 2; ++odd) {
    run_jobs(count / 2, run_,
             [&](std::uint32_t i) { add_pairs(slabs[2 * i + odd], kept_[2 * i + odd], first); });
  }
}

// Pairs are processed while they are in the cache; those left over from a batch go with the next. They are
// kept for the later sub-steps while there is room; otherwise they are found again.
void Contact::add_pairs(const ContactSlab& slab, Kept& kept, bool first) {
  if (slab.first == slab.end) return;
  constexpr std::uint32_t kBatch = ContactPairs::kBatch;
  std::array<std::uint32_t, kRoomForPairs> some_first, some_second;  // of one sub-step
  std::uint32_t* found_first = some_first.data();
  std::uint32_t* found_second = some_second.data();
  std::uint32_t room = kRoomForPairs;
  const std::uint32_t begin = kPairsPerBody * slab.first;
  const std::uint32_t own_room =
      kPairsPerBody * (slab.end - slab.first) + (slab.end == order_.begin().back() ? kRoomForPairs : 0);
  if (constants_.substeps > 1 && own_room >= kRoomForPairs) {
    found_first = &first_[begin];
    found_second = &second_[begin];
    room = own_room;
  }
  const auto add_forces = [&](std::uint32_t from, std::uint32_t to) {
    kernels_.add_forces(pair_law_, inverse_root_.data(), {found_first + from, found_second + from, to - from},
                        touches_);
  };
  if (!first && kept.all) return add_forces(0, kept.count);
  const ContactGrid grid{order_.bits(),
                         order_.begin().data(),
                         order_.place_cell().data(),
                         near_xy_.data(),
                         later_xy_.empty() ? nullptr : later_xy_.data(),
                         near_z_.data(),
                         near_ * near_,
                         slab.end};
  ContactPairs pairs{found_first, found_second, 0};
  std::uint32_t done = 0;
  kept.all = room > kRoomForPairs;
  for (std::uint32_t place = slab.first; place < slab.end;) {
    place = kernels_.find(grid, place, done + kPairsAtOnce, pairs);
    TANDEM_ASSERT(pairs.count <= done + kPairsAtOnce + ContactPairs::kMaxAtOnce && pairs.count <= room);
    const std::uint32_t whole = pairs.count - pairs.count % kBatch;
    add_forces(done, whole);
    done = whole;
    if (room - done >= kRoomForPairs) continue;
    if (done > 0) {
      std::copy(&found_first[done], &found_first[pairs.count], found_first);
      std::copy(&found_second[done], &found_second[pairs.count], found_second);
      pairs.count -= done;
      done = 0;
    }
    kept.all = false;
  }
  // A pair of a body and itself adds nothing. Nobody else changes this body now.
  for (; pairs.count % kBatch != 0; ++pairs.count)
    found_first[pairs.count] = found_second[pairs.count] = slab.first;
  add_forces(done, pairs.count);
  kept.count = pairs.count;
}

void Contact::move_to_next_substep(const ContactMove& move, std::span<ContactBody> bodies) {
  run_parts(run_, bodies.size(), kPlaces, [&](std::size_t begin, std::size_t places) {
    move_bodies(move, bodies.subspan(begin, places), touches_ + begin);
    for (std::size_t first = begin; first < begin + places; first += kAtOnce) {
      const auto some = bodies.subspan(first, std::min<std::size_t>(kAtOnce, begin + places - first));
      std::array<ContactForce, kAtOnce> forces{};
      walls_.add_forces(some, forces);
      for (std::size_t k = 0; k < some.size(); ++k) touches_[first + k].force.f = forces[k].f;
    }
  });
}

// Moves bodies by slot into the next state, and copies what does not move.
void Contact::finish(const ContactMove& move, std::span<const ContactBody> bodies, const State& from,
                     State& to, const StepLedgers* ledgers) {
  const bool apart = &from != &to;
  run_parts(run_, from.capacity(), kBlockSlots, [&](std::size_t begin, std::size_t slots) {
    const auto block = static_cast<std::uint32_t>(begin / kBlockSlots);
    if (present_[block].stays) return;
    const bool all_still = still_[block] != 0;
    for (std::size_t at = begin; (apart || !all_still) && at < begin + slots; at += kSlotsAtOnce) {
      const auto first = static_cast<Slot>(at);
      const auto count = static_cast<std::uint32_t>(std::min<std::size_t>(kSlotsAtOnce, begin + slots - at));
      const std::size_t run = at / BlockLedger::kRunSlots;
      if (!all_still && any_moves(from, to, first, count)) {
        // Places are in another order than slots: those of the next slots are fetched meanwhile.
        for (std::size_t s = at + kSlotsAtOnce; s < std::min(at + 2 * kSlotsAtOnce, begin + slots); ++s)
          __builtin_prefetch(&touches_[order_.place()[s]].force);
        move_slots(move, bodies, touches_, order_.place(), first, count, from, to);
        if (apart) copy_still_columns(from, to, first, count);
        if (ledgers != nullptr) ledgers->to.runs[run] = ledgers->number;
      } else if (apart) {
        const std::uint64_t number = ledgers != nullptr ? ledgers->from.runs[run] : 0;
        if (number == 0 || number != ledgers->to.runs[run]) copy_columns(from, to, first, count);
        if (ledgers != nullptr) ledgers->to.runs[run] = number;
      }
    }
    if (ledgers == nullptr) return;
    ledgers->to.numbers[block] = all_still ? ledgers->from.numbers[block] : ledgers->number;
    ledgers->to.at_rest[block] = static_cast<std::uint8_t>(all_still);
  });
}

void Contact::step(const State& from, State& to, const StepInput& input, const StepLedgers* ledgers) {
  TANDEM_ASSERT(block_count(from.capacity()) == present_.size());
  const Present present = keep_at_rest_in_blocks(from, to, input, ledgers);
  const std::uint32_t moving = present.alive - present.at_rest;
  std::span<ContactBody> bodies;
  if (moving > 0) {
    from_ = &from;
    bodies = order_.room().first(order_.sort(what_to_sort(from, to, present, ledgers), *this));
    TANDEM_ASSERT(order_.begin().back() <= bodies.size());
    crowded_ = static_cast<std::uint32_t>(bodies.size()) - order_.begin().back();
    slabs_.cut(order_.begin(), order_.bits());
    add_all_pairs(true);
  }
  ContactMove move{shift_, constants_.substeps,   input.drive.gravity, input.drive.damping, to.rest(),
                   &from,  input.parameters.decay};
  for (std::int32_t i = 1; moving > 0 && i < constants_.substeps; ++i) {
    move_to_next_substep(move, bodies);
    add_all_pairs(false);
    move.gravity = {};
    move.damping = 0;
    move.accelerated = nullptr;
  }
  finish(move, bodies, from, to, ledgers);
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
  step(from, to, input, &ledgers);
}

void Contact::step_slots(const State& from, State& to, const StepInput& input,
                         std::span<const Slot> /*slots*/) {
  step(from, to, input);
}

}  // namespace tandem
