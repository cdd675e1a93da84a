#include "services/engines/particles/pile.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

namespace tandem::engine {
namespace {

// Rounding must not put touching bodies two cells apart.
constexpr float kCellSlack = 1.001F;
// The skin as a share of the largest radius. A larger one makes lists longer, a smaller one makes them last
// less.
constexpr float kSkin = 0.7F;

float largest_radius(const EngineWorld& world) {
  float radius = 0;
  for (const ParticleType& type : world.types) radius = std::max(radius, type.radius);
  return radius;
}

// Four floats, as one register of any processor; element-wise operations only.
using Four = float __attribute__((vector_size(16)));
Four load4(const float* from) {
  Four v;
  std::memcpy(&v, from, sizeof v);
  return v;
}

// One after the other, as the order of a sum decides its bits. Places without a body have no velocity.
Vec3f sum_of_velocities(std::span<const Record> records) {
  Four sum{};
  for (const Record& record : records) sum += load4(&record.vx);
  return {sum[0], sum[1], sum[2]};
}

}  // namespace

Pile::Pile(const EngineWorld& world, Workers& workers, std::uint32_t threads, Instructions instructions)
    : world_(&world),
      workers_(&workers),
      threads_(threads),
      kernels_(&kernels(instructions)),
      surfaces_(world),
      usual_skin_(kSkin * largest_radius(world)),
      sleep_speed_(world.sleep_speed),
      grid_(world.low, world.high, kCellSlack * (2 * largest_radius(world) + usual_skin_), world.capacity),
      most_places_((world.capacity + world.capacity / 8 + 2 * kBlock) / kBlock * kBlock),
      place_of_(world.capacity, kNoPlace),
      strays_(most_places_ / kMaxAdopted) {
  constexpr std::size_t kBeyond = 16;  // for loads of many elements at once
  for (auto* records : {&records_, &spare_records_})
    records->assign(most_places_ + 1, {kNowhere, kNowhere, kNowhere, 0, 0, 0, 0, kNoSlot});
  for (auto* masses : {&inverse_mass_, &spare_inverse_mass_}) masses->assign(most_places_, 0);
  for (auto* states : {&state_, &spare_state_}) states->assign(most_places_, kQuietSteps);
  for (auto& column : anchor_) column.assign(most_places_ + kBeyond, 0);
  anchor_radius_.assign(most_places_ + kBeyond, kNotFound);
  cell_.resize(most_places_);
  to_.resize(most_places_);
  const std::size_t groups = most_places_ / kGroup, blocks = most_places_ / kBlock;
  entries_ = std::make_unique_for_overwrite<std::uint32_t[]>(groups * kRows * kGroup);
  forces_.resize(groups);
  rows_.assign(groups, kUnlisted);
  locks_.assign(groups, 0);
  for (auto* bytes : {&asleep_, &marked_, &changed_, &quiet_, &touching_}) bytes->assign(blocks, 0);
  for (auto* bits : {&outside_, &loose_}) bits->assign(blocks, 0);
  velocity_sum_.resize(blocks);
  awake_.reserve(blocks);
  woken_.reserve(blocks);
  leavers_.reserve(world.capacity);
  moved_.reserve(most_places_);
  strange_.reserve(most_places_);
  left_.reserve(most_places_ / kMaxMoved);
}

void Pile::fill(std::uint32_t place, std::uint32_t slot, const Vec3f& at, const Vec3f& velocity,
                std::uint16_t type) {
  records_[place] = {at[0],       at[1],       at[2],       world_->types[type].radius,
                     velocity[0], velocity[1], velocity[2], slot};
  inverse_mass_[place] = 1.0F / world_->types[type].mass;
  state_[place] = 0;
  set_force(place, {});
  place_of_[slot] = place;
}

void Pile::clear_place(std::uint32_t place) {
  records_[place] = records_[most_places_];
  state_[place] = kQuietSteps;
  set_force(place, {});
  for (auto& column : anchor_) column[place] = 0;
  anchor_radius_[place] = kNotFound;
}

void Pile::set_force(std::uint32_t place, const Float3& force) {
  Forces& forces = forces_[place / kGroup];
  forces.x[place % kGroup] = force.x;
  forces.y[place % kGroup] = force.y;
  forces.z[place % kGroup] = force.z;
}

void Pile::set_anchor(std::uint32_t place) {
  anchor_[0][place] = records_[place].x - drift_[0];
  anchor_[1][place] = records_[place].y - drift_[1];
  anchor_[2][place] = records_[place].z - drift_[2];
}

void Pile::start(const Columns& columns) {
  drift_ = mean_velocity_ = {};
  std::fill(place_of_.begin(), place_of_.end(), kNoPlace);
  strays_.clear();
  count_ = 0;
  for (std::uint32_t slot = 0; slot < columns.alive.size(); ++slot) {
    if (columns.alive[slot] == 0) continue;
    fill(count_, slot, {columns.position[0][slot], columns.position[1][slot], columns.position[2][slot]},
         {columns.velocity[0][slot], columns.velocity[1][slot], columns.velocity[2][slot]},
         columns.type[slot]);
    set_anchor(count_);
    ++count_;
  }
  for (std::uint32_t place = count_; place < most_places_; ++place) clear_place(place);
  for (auto* bytes : {&asleep_, &marked_, &touching_})
    std::fill(bytes->begin(), bytes->end(), std::uint8_t{0});
  std::fill(rows_.begin(), rows_.end(), kUnlisted);
  sorted_ = crowded_ = any_marked_ = false;
  skin_ = 0;
  sleeping_blocks_ = 0;
  moved_.clear();
  strange_.clear();
  felt_gravity_ = columns.gravity;
  all_changed_ = true;
  list_awake();
}

Vec3f Pile::position(std::uint32_t slot) const {
  const Record& r = records_[place_of_[slot]];
  return {r.x, r.y, r.z};
}

void Pile::push(std::uint32_t slot, const Vec3f& change) {
  const std::uint32_t place = place_of_[slot];
  Record& r = records_[place];
  r.vx += change[0];
  r.vy += change[1];
  r.vz += change[2];
  mark(place / kBlock);
}

void Pile::feel(const Vec3& gravity) {
  if (gravity != felt_gravity_) {
    for (std::uint32_t block = 0; sleeping_blocks_ > 0 && block < blocks(); ++block) mark(block);
  }
  felt_gravity_ = gravity;
  // Forces of bodies that slept are not kept.
  if (wake_marked()) sum_blocks(woken_, false, false);
}

void Pile::integrate(float h, float keep, const Vec3f& kick) {
  const bool drifts = sleeping_blocks_ == 0;
  for (std::size_t i = 0; i < 3 && drifts; ++i) {
    // What the mean velocity will be, but for the forces.
    drift_[i] += h * ((mean_velocity_[i] + kick[i]) * keep);
  }
  const Advance motion{h, keep, kick, drift_, world_->low, world_->high, 0.25F * skin_ * skin_};
  const Anchors anchors{anchor_[0].data(), anchor_[1].data(), anchor_[2].data(), anchor_radius_.data()};
  constexpr std::uint32_t kBlocksAtOnce = 16;
  workers_->run(static_cast<std::uint32_t>(awake_.size()), kBlocksAtOnce,
                [&](std::uint32_t begin, std::uint32_t end) {
                  for (std::uint32_t i = begin; i < end; ++i) {
                    const std::uint32_t block = awake_[i], first = block * kBlock;
                    std::uint64_t outside = 0, loose = 0;
                    for (std::uint32_t at = 0; at < kBlock; at += kGroup) {
                      Gone gone;
                      kernels_->integrate(records_.data(), forces_[(first + at) / kGroup],
                                          inverse_mass_.data(), anchors, first + at, motion, gone);
                      outside |= std::uint64_t{gone.outside} << at;
                      loose |= std::uint64_t{gone.loose} << at;
                    }
                    outside_[block] = outside;
                    loose_[block] = loose;
                    if (drifts) velocity_sum_[block] = sum_of_velocities({&records_[first], kBlock});
                    changed_[block] = 1;
                  }
                });
  mean_velocity_ = {};
  for (const std::uint32_t block : awake_) {
    if (sleeping_blocks_ > 0) break;
    for (std::size_t i = 0; i < 3; ++i)
      mean_velocity_[i] += velocity_sum_[block][i] / static_cast<float>(count_);
  }
  leavers_.clear();
  for (const std::uint32_t block : awake_) {
    for (std::uint64_t bits = outside_[block]; bits != 0; bits &= bits - 1)
      leavers_.push_back(records_[block * kBlock + static_cast<std::uint32_t>(std::countr_zero(bits))].slot);
  }
}

void Pile::remove(std::uint32_t slot) {
  const std::uint32_t place = place_of_[slot];
  if (sleeping_blocks_ > 0)
    wake_near({anchor_[0][place], anchor_[1][place], anchor_[2][place]}, records_[place].radius);
  if ((state_[place] & kAdopted) != 0) {
    const std::uint32_t last = strays_.remove(to_[place]);
    if (last != kNoPlace) to_[last] = to_[place];
  }
  clear_place(place);
  place_of_[slot] = kNoPlace;
  mark(place / kBlock);
}

void Pile::add(std::uint32_t slot, const Vec3f& at, const Vec3f& velocity, std::uint16_t type) {
  if (count_ == most_places_) sort();
  const std::uint32_t place = count_++;
  if (place % kBlock == 0) {
    const std::uint32_t block = place / kBlock;
    asleep_[block] = touching_[block] = 0;
    for (std::uint32_t g = 0; g < kGroupsInBlock; ++g) rows_[block * kGroupsInBlock + g] = kUnlisted;
  }
  fill(place, slot, at, velocity, type);
  set_anchor(place);
  moved_.push_back(place);
  changed_[place / kBlock] = 1;
  mark(place / kBlock);
}

void Pile::move(std::uint32_t slot, const Vec3f& to) {
  const std::uint32_t place = place_of_[slot];
  Record& r = records_[place];
  if (sleeping_blocks_ > 0) wake_near({anchor_[0][place], anchor_[1][place], anchor_[2][place]}, r.radius);
  r.x = to[0], r.y = to[1], r.z = to[2];
  moved_.push_back(place);
  changed_[place / kBlock] = 1;
  mark(place / kBlock);
}

void Pile::set_type(std::uint32_t slot, std::uint16_t type) {
  const std::uint32_t place = place_of_[slot];
  records_[place].radius = world_->types[type].radius;
  inverse_mass_[place] = 1.0F / world_->types[type].mass;
  moved_.push_back(place);
  mark(place / kBlock);
}

void Pile::publish(Columns& columns) {
  const auto put = [&](std::uint32_t slot, const Record& r) {
    columns.position[0][slot] = r.x;
    columns.position[1][slot] = r.y;
    columns.position[2][slot] = r.z;
    columns.velocity[0][slot] = r.vx;
    columns.velocity[1][slot] = r.vy;
    columns.velocity[2][slot] = r.vz;
  };
  const auto changed = static_cast<std::size_t>(std::count(changed_.begin(), changed_.begin() + blocks(), 1));
  if (all_changed_ || changed * 3 > blocks()) {
    constexpr std::uint32_t kSlotsAtOnce = 4096;
    std::fill(columns.moved.begin(), columns.moved.end(), std::uint8_t{1});
    workers_->run(world_->capacity, kSlotsAtOnce, [&](std::uint32_t begin, std::uint32_t end) {
      constexpr std::uint32_t kAhead = 16;
      for (std::uint32_t slot = begin; slot < end; ++slot) {
        if (slot + kAhead < end && place_of_[slot + kAhead] != kNoPlace)
          __builtin_prefetch(&records_[place_of_[slot + kAhead]]);
        if (place_of_[slot] != kNoPlace) put(slot, records_[place_of_[slot]]);
      }
    });
  } else {
    for (std::uint32_t block = 0; block < blocks(); ++block) {
      if (changed_[block] == 0) continue;
      for (std::uint32_t place = block * kBlock; place < (block + 1) * kBlock; ++place) {
        const std::uint32_t slot = records_[place].slot;
        if (slot == kNoSlot) continue;
        put(slot, records_[place]);
        columns.moved[slot / kMovedSlots] = 1;
      }
    }
  }
  all_changed_ = false;
  std::fill(changed_.begin(), changed_.end(), std::uint8_t{0});
}

std::uint32_t Pile::touching() const {
  std::uint32_t sum = 0;
  for (std::uint32_t block = 0; block < blocks(); ++block) sum += touching_[block];
  return sum;
}

std::uint32_t Pile::asleep() const {
  std::uint32_t sum = 0;
  for (std::uint32_t place = 0; place < count_; ++place)
    sum += static_cast<std::uint32_t>(asleep_[place / kBlock] != 0 && records_[place].slot != kNoSlot);
  return sum;
}

void Pile::save(PileImage& out) const {
  out.slot.resize(count_);
  for (std::size_t i = 0; i < 3; ++i) {
    out.anchor[i].assign(anchor_[i].begin(), anchor_[i].begin() + count_);
    out.force[i].resize(count_);
  }
  for (std::uint32_t place = 0; place < count_; ++place) {
    out.slot[place] = records_[place].slot;
    const Forces& forces = forces_[place / kGroup];
    out.force[0][place] = forces.x[place % kGroup];
    out.force[1][place] = forces.y[place % kGroup];
    out.force[2][place] = forces.z[place % kGroup];
  }
  out.state.assign(state_.begin(), state_.begin() + count_);
  out.felt_gravity = felt_gravity_;
  out.skin = skin_;
  out.sleep_speed = sleep_speed_;
  out.drift = drift_;
  out.mean_velocity = mean_velocity_;
  out.sorted = sorted_ ? 1 : 0;
  out.crowded = crowded_ ? 1 : 0;
}

bool Pile::load(const Columns& columns, const PileImage& image) {
  if (image.sleep_speed != sleep_speed_ || image.slot.size() > most_places_ ||
      (image.skin != 0 && image.skin != usual_skin_))
    return false;
  Columns nobody(0);
  nobody.gravity = image.felt_gravity;
  start(nobody);
  count_ = static_cast<std::uint32_t>(image.slot.size());
  std::uint32_t bodies = 0;
  for (std::uint32_t place = 0; place < count_; ++place) {
    const std::uint32_t slot = image.slot[place];
    if (slot == kNoSlot) {
      cell_[place] = kNoCell;
      continue;
    }
    if (slot >= columns.alive.size() || columns.alive[slot] == 0 || place_of_[slot] != kNoPlace) return false;
    const Vec3f at{columns.position[0][slot], columns.position[1][slot], columns.position[2][slot]};
    fill(place, slot, at, {columns.velocity[0][slot], columns.velocity[1][slot], columns.velocity[2][slot]},
         columns.type[slot]);
    ++bodies;
    set_force(place, {image.force[0][place], image.force[1][place], image.force[2][place]});
    state_[place] = image.state[place];
    for (std::size_t i = 0; i < 3; ++i) {
      anchor_[i][place] = image.anchor[i][place];
      if (!std::isfinite(anchor_[i][place])) return false;
    }
    const bool adopted = (state_[place] & kAdopted) != 0;
    cell_[place] = adopted ? kNoCell : anchor_cell(place);
    anchor_radius_[place] = adopted ? kNotFound : records_[place].radius;
  }
  if (bodies != static_cast<std::uint32_t>(std::count(columns.alive.begin(), columns.alive.end(), 1)))
    return false;
  skin_ = image.skin;
  drift_ = image.drift;
  mean_velocity_ = image.mean_velocity;
  sorted_ = image.sorted != 0;
  crowded_ = image.crowded != 0;
  if (sorted_ && !crowded_) {  // otherwise the next step sorts before it looks for anybody
    if (!grid_.adopt_order({cell_.data(), count_})) return false;
    for (std::uint32_t place = 0; place < count_; ++place) {
      if ((state_[place] & kAdopted) == 0) continue;
      if (strays_.full()) return false;
      to_[place] = strays_.add(stray(place));
    }
    strays_.arrange();
  } else {
    for (std::uint32_t place = 0; place < count_; ++place)
      state_[place] &= static_cast<std::uint8_t>(~kAdopted);
  }
  settle_blocks();
  return true;
}

}  // namespace tandem::engine
