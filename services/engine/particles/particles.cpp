// The thesis's full simulation (section 3.2.1). Deviations: the damping of equation 3.1's forces is a factor
// on the velocity, exactly as in the predicted step; with sub-steps, gravity and damping act once.
#include "services/engine/particles/particles.hpp"

#include <algorithm>
#include <atomic>
#include <utility>

#include "services/engine/common/check.hpp"
#include "services/engine/particles/columns.hpp"
#include "services/engine/particles/float_environment.hpp"
#include "services/engine/particles/grid.hpp"
#include "services/workers/workers.hpp"

namespace tandem::engine {
namespace {

// Number of bodies; smaller blocks cost more to hand out than they gain.
constexpr std::uint32_t kIntegrationBlock = 4096;
constexpr float kCellSlack = 1.001F;  // rounding must not put touching bodies two cells apart

std::uint64_t splitmix64(std::uint64_t x) {
  x += 0x9E3779B97F4A7C15U;
  x = (x ^ (x >> 30U)) * 0xBF58476D1CE4E5B9U;
  x = (x ^ (x >> 27U)) * 0x94D049BB133111EBU;
  return x ^ (x >> 31U);
}

// Uniform in [0, 1), exact.
float unit_float(std::uint64_t bits) { return static_cast<float>(bits >> 40U) * 0x1p-24F; }

// Bodies in a block of the contact loop. One thread takes all at once, since pairs across blocks are computed
// twice; several get about eight blocks each, so that none waits long for another.
std::uint32_t contact_block(std::uint32_t capacity, std::uint32_t threads) {
  if (threads == 1) return capacity;
  return std::clamp(capacity / (8 * threads), 512U, 8192U);
}

float largest_radius(const World& world) {
  float radius = 0;
  for (const ParticleType& type : world.types) radius = std::max(radius, type.radius);
  return radius;
}

class Particles final : public Simulation {
 public:
  Particles(const World& world, std::uint32_t threads);

  [[nodiscard]] std::uint32_t capacity() const override { return world_.capacity; }
  [[nodiscard]] double dt_s() const override { return static_cast<double>(world_.dt_s); }
  [[nodiscard]] Vec3 gravity() const override { return columns_.gravity; }
  [[nodiscard]] double damping_per_s() const override { return static_cast<double>(world_.damping_per_s); }
  [[nodiscard]] Classification classify(const Input& input) const override {
    Classification result = classify_input(input, world_);
    if (result.effect == Classification::Effect::kImmediate) result.cost = push_cost(input, bodies());
    return result;
  }
  [[nodiscard]] InputBudget input_budget() const override { return engine::input_budget(world_); }
  void apply(const Input& input) override;
  void step() override;
  [[nodiscard]] Bodies bodies() const override;
  [[nodiscard]] std::span<const Event> events() const override { return events_; }
  [[nodiscard]] std::uint32_t colliding() const override { return colliding_; }
  [[nodiscard]] Mishaps mishaps() const override { return {.removed = lost_, .clamped = 0}; }
  void save(std::vector<std::byte>& out) const override { save_columns(columns_, fingerprint_, out); }
  [[nodiscard]] bool load(std::span<const std::byte> bytes) override;

 private:
  void push_bodies();
  void integrate(bool first_substep);
  void despawn(std::uint32_t slot);
  void remove_outside();
  void visit_regions();
  void act(const Region& region, std::uint32_t slot);
  void spawn_from_emitters();
  void spawn(const Emitter& emitter);
  void find_contacts();
  void count_colliding();
  [[nodiscard]] Vec3f position(std::uint32_t slot) const {
    return {columns_.position[0][slot], columns_.position[1][slot], columns_.position[2][slot]};
  }

  World world_;
  std::uint64_t fingerprint_;
  Columns columns_;
  Grid grid_;
  Workers workers_;
  std::vector<float> inverse_mass_;  // by type
  std::vector<Record> unsorted_;
  std::vector<Contact> sums_;  // by place in the grid
  std::uint32_t contact_block_;
  std::vector<Event> events_;
  std::uint32_t free_from_ = 0;  // no slot below is free
  std::uint32_t colliding_ = 0;
  std::uint64_t lost_ = 0;  // since this object was made
};

Particles::Particles(const World& world, std::uint32_t threads)
    : world_(world),
      fingerprint_(fingerprint(world)),
      columns_(world.capacity),
      grid_(world.low, world.high, 2 * kCellSlack * largest_radius(world), world.capacity),
      workers_(threads, [] { std::fesetenv(FE_DFL_ENV); }),
      sums_(world.capacity),
      contact_block_(contact_block(world.capacity, threads)) {
  for (const ParticleType& type : world.types) inverse_mass_.push_back(1.0F / type.mass);
  unsorted_.reserve(world.capacity);
  events_.reserve(2 * std::size_t{world.capacity});
  for (std::uint32_t slot = 0; slot < world.start.size(); ++slot) {
    const StartBody& body = world.start[slot];
    columns_.alive[slot] = 1;
    columns_.type[slot] = body.type;
    for (std::size_t i = 0; i < 3; ++i) {
      columns_.position[i][slot] = body.position[i];
      columns_.velocity[i][slot] = body.velocity[i];
    }
  }
  columns_.gravity = {static_cast<double>(world.gravity[0]), static_cast<double>(world.gravity[1]),
                      static_cast<double>(world.gravity[2])};
  columns_.due.resize(world.emitters.size());
}

void Particles::apply(const Input& input) {
  const std::vector<double>& v = input.values;
  const auto at = [&v](std::size_t i) { return static_cast<float>(v[i]); };
  if (input.kind == static_cast<std::uint32_t>(InputKind::kGravity)) {
    columns_.gravity = {v[0], v[1], v[2]};
  } else if (columns_.pushes.size() < kMaxPushes) {
    columns_.pushes.push_back({{at(0), at(1), at(2)}, at(3), {at(4), at(5), at(6)}});
  }
}

void Particles::step() {
  const FloatEnvironment environment;
  events_.clear();
  ++columns_.frame;
  push_bodies();
  for (std::uint32_t i = 0; i < world_.substeps; ++i) {
    integrate(i == 0);
    remove_outside();
    if (i + 1 == world_.substeps) {
      visit_regions();
      spawn_from_emitters();
    }
    find_contacts();
  }
  std::sort(events_.begin(), events_.end(), [](const Event& a, const Event& b) {
    return std::pair(a.slot, a.kind) < std::pair(b.slot, b.kind);
  });
  count_colliding();
}

// Called before the integration, so that a push changes the speed in the step in which it acts.
void Particles::push_bodies() {
  for (const Push& push : columns_.pushes) {
    for (std::uint32_t slot = 0; slot < world_.capacity; ++slot) {
      if (columns_.alive[slot] == 0) continue;
      float squared = 0;
      for (std::size_t i = 0; i < 3; ++i) {
        const float d = columns_.position[i][slot] - push.centre[i];
        squared += d * d;
      }
      if (squared > push.radius * push.radius) continue;
      for (std::size_t i = 0; i < 3; ++i) columns_.velocity[i][slot] += push.velocity[i];
    }
  }
  columns_.pushes.clear();
}

// Equation 3.1 with the forces found after the last integration.
void Particles::integrate(bool first_substep) {
  const float h = world_.dt_s / static_cast<float>(world_.substeps);
  const float keep = first_substep ? 1 - world_.damping_per_s * world_.dt_s : 1.0F;
  Vec3f kick{};
  if (first_substep) {
    for (std::size_t i = 0; i < 3; ++i) kick[i] = world_.dt_s * static_cast<float>(columns_.gravity[i]);
  }
  workers_.run(world_.capacity, kIntegrationBlock, [&](std::uint32_t begin, std::uint32_t end) {
    for (std::uint32_t slot = begin; slot < end; ++slot) {
      if (columns_.alive[slot] == 0) continue;
      const Float3 force = columns_.contact[slot].force;
      const std::array<float, 3> f{force.x, force.y, force.z};
      const float scale = h * inverse_mass_[columns_.type[slot]];
      for (std::size_t i = 0; i < 3; ++i) {
        float& v = columns_.velocity[i][slot];
        v = ((v + kick[i]) + scale * f[i]) * keep;
        columns_.position[i][slot] += h * v;
      }
    }
  });
}

void Particles::despawn(std::uint32_t slot) {
  columns_.alive[slot] = 0;
  columns_.contact[slot] = {};
  free_from_ = std::min(free_from_, slot);
  events_.push_back({Event::Kind::kDespawned, slot});
}

void Particles::remove_outside() {
  for (std::uint32_t slot = 0; slot < world_.capacity; ++slot) {
    if (columns_.alive[slot] == 0 || inside(position(slot), world_.low, world_.high)) continue;
    despawn(slot);
    if (world_.emitters.empty()) ++lost_;  // nothing brings another: it was not meant to leave
  }
}

// The first region that holds a body acts on it, so that a slot has at most one event from here.
void Particles::visit_regions() {
  if (world_.regions.empty()) return;
  for (std::uint32_t slot = 0; slot < world_.capacity; ++slot) {
    if (columns_.alive[slot] == 0) continue;
    const auto region = std::find_if(world_.regions.begin(), world_.regions.end(),
                                     [&](const Region& r) { return inside(position(slot), r.low, r.high); });
    if (region != world_.regions.end()) act(*region, slot);
  }
}

void Particles::act(const Region& region, std::uint32_t slot) {
  switch (region.action) {
    case Region::Action::kRemove:
      despawn(slot);
      return;
    case Region::Action::kTeleport: {
      for (std::size_t i = 0; i < 3; ++i) columns_.position[i][slot] += region.offset[i];
      if (inside(position(slot), world_.low, world_.high)) {
        events_.push_back({Event::Kind::kTeleported, slot});
      } else {
        despawn(slot);
      }
      return;
    }
    case Region::Action::kSetType:
      if (columns_.type[slot] == region.type) return;
      columns_.type[slot] = region.type;
      events_.push_back({Event::Kind::kTypeChanged, slot});
  }
}

void Particles::spawn_from_emitters() {
  for (std::size_t e = 0; e < world_.emitters.size(); ++e) {
    double& due = columns_.due[e];
    due += world_.emitters[e].rate_per_s * static_cast<double>(world_.dt_s);
    for (; due >= 1; due -= 1) spawn(world_.emitters[e]);
  }
}

void Particles::spawn(const Emitter& emitter) {
  const std::uint64_t number = columns_.spawned++;
  while (free_from_ < world_.capacity && columns_.alive[free_from_] != 0) ++free_from_;
  if (free_from_ == world_.capacity) return;
  const std::uint32_t slot = free_from_;
  columns_.alive[slot] = 1;
  columns_.type[slot] = emitter.type;
  columns_.contact[slot] = {};
  for (std::size_t i = 0; i < 3; ++i) {
    const float share = unit_float(splitmix64(splitmix64(world_.seed) + 3 * number + i));
    columns_.position[i][slot] = emitter.low[i] + share * (emitter.high[i] - emitter.low[i]);
    columns_.velocity[i][slot] = emitter.velocity[i];
  }
  events_.push_back({Event::Kind::kSpawned, slot});
}

void Particles::find_contacts() {
  unsorted_.clear();
  for (std::uint32_t slot = 0; slot < world_.capacity; ++slot) {
    if (columns_.alive[slot] == 0) continue;
    const auto& p = columns_.position;
    const auto& v = columns_.velocity;
    unsorted_.push_back({p[0][slot], p[1][slot], p[2][slot], world_.types[columns_.type[slot]].radius,
                         v[0][slot], v[1][slot], v[2][slot], slot});
  }
  grid_.sort(unsorted_);
  const auto count = static_cast<std::uint32_t>(unsorted_.size());
  workers_.run(count, contact_block_, [&](std::uint32_t begin, std::uint32_t end) {
    sum_contacts(world_, grid_, begin, end, sums_);
    for (std::uint32_t i = begin; i < end; ++i) columns_.contact[grid_.sorted()[i].slot] = sums_[i];
  });
}

void Particles::count_colliding() {
  colliding_ = static_cast<std::uint32_t>(std::count_if(columns_.contact.begin(), columns_.contact.end(),
                                                        [](const Contact& c) { return c.touching; }));
}

Bodies Particles::bodies() const {
  Bodies view;
  for (std::size_t i = 0; i < 3; ++i) {
    view.position[i] = columns_.position[i];
    view.velocity[i] = columns_.velocity[i];
  }
  view.alive = columns_.alive;
  view.type = columns_.type;
  return view;
}

bool Particles::load(std::span<const std::byte> bytes) {
  Columns loaded = columns_;
  if (!load_columns(bytes, fingerprint_, loaded)) return false;
  for (std::uint32_t slot = 0; slot < world_.capacity; ++slot) {
    const Vec3f p{loaded.position[0][slot], loaded.position[1][slot], loaded.position[2][slot]};
    if (loaded.alive[slot] > 1 || loaded.type[slot] >= world_.types.size()) return false;
    if (loaded.alive[slot] != 0 && !inside(p, world_.low, world_.high)) return false;
  }
  columns_ = std::move(loaded);
  events_.clear();
  free_from_ = 0;
  count_colliding();
  return true;
}

}  // namespace

Result<std::unique_ptr<Simulation>> make_particles(const World& world, std::uint32_t threads) {
  if (threads == 0 || threads > kMaxThreads)
    return fail(ErrorCode::kInvalidArgument, "threads must be 1 to " + std::to_string(kMaxThreads));
  return check(world).transform(
      [&] { return std::unique_ptr<Simulation>(std::make_unique<Particles>(world, threads)); });
}

}  // namespace tandem::engine
