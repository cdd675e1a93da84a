// The thesis's full simulation (section 3.2.1). Deviations: the damping of equation 3.1's forces is a factor
// on the velocity, exactly as in the predicted step; with sub-steps, gravity and damping act once.
#include "services/engines/particles/particles.hpp"

#include <algorithm>
#include <utility>

#include "sdk/workers/workers.hpp"
#include "services/engines/common/check.hpp"
#include "services/engines/particles/columns.hpp"
#include "services/engines/particles/float_environment.hpp"
#include "services/engines/particles/pile.hpp"

namespace tandem::engine {
namespace {

std::uint64_t splitmix64(std::uint64_t x) {
  x += 0x9E3779B97F4A7C15U;
  x = (x ^ (x >> 30U)) * 0xBF58476D1CE4E5B9U;
  x = (x ^ (x >> 27U)) * 0x94D049BB133111EBU;
  return x ^ (x >> 31U);
}

// Uniform in [0, 1), exact.
float unit_float(std::uint64_t bits) { return static_cast<float>(bits >> 40U) * 0x1p-24F; }

class Particles final : public Simulation {
 public:
  Particles(const EngineWorld& world, std::uint32_t threads, Instructions instructions);

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
  [[nodiscard]] std::span<const std::uint8_t> moved() const override { return columns_.moved; }
  [[nodiscard]] Mishaps mishaps() const override { return {.removed = lost_, .clamped = 0}; }
  void save(std::vector<std::byte>& out) const override {
    PileImage image;
    pile_.save(image);
    save_checkpoint(columns_, image, fingerprint_, out);
  }
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

  EngineWorld world_;
  std::uint64_t fingerprint_;
  Columns columns_;
  Workers workers_;
  Pile pile_;
  std::vector<Event> events_;
  std::uint32_t free_from_ = 0;  // no slot below is free
  std::uint32_t colliding_ = 0;
  std::uint64_t lost_ = 0;  // since this object was made
};

Particles::Particles(const EngineWorld& world, std::uint32_t threads, Instructions instructions)
    : world_(world),
      fingerprint_(fingerprint(world)),
      columns_(world.capacity),
      workers_(threads, [] { std::fesetenv(FE_DFL_ENV); }),
      pile_(world_, workers_, threads, instructions) {
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
  std::vector<StartBody>().swap(world_.start);  // 28 bytes a body
  pile_.start(columns_);
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
  pile_.feel(columns_.gravity);
  for (std::uint32_t i = 0; i < world_.substeps; ++i) {
    integrate(i == 0);
    remove_outside();
    const bool last = i + 1 == world_.substeps;
    if (last) {
      visit_regions();
      spawn_from_emitters();
    }
    pile_.find_contacts(last);
  }
  std::fill(columns_.moved.begin(), columns_.moved.end(), std::uint8_t{0});
  pile_.publish(columns_);
  for (const Event& event : events_) columns_.moved[event.slot / kMovedSlots] = 1;
  std::sort(events_.begin(), events_.end(), [](const Event& a, const Event& b) {
    return std::pair(a.slot, a.kind) < std::pair(b.slot, b.kind);
  });
  colliding_ = pile_.touching();
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
      if (squared <= push.radius * push.radius) pile_.push(slot, push.velocity);
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
  pile_.integrate(h, keep, kick);
}

void Particles::despawn(std::uint32_t slot) {
  columns_.alive[slot] = 0;
  pile_.remove(slot);
  free_from_ = std::min(free_from_, slot);
  events_.push_back({Event::Kind::kDespawned, slot});
}

void Particles::remove_outside() {
  for (const std::uint32_t slot : pile_.leavers()) {
    despawn(slot);
    if (world_.emitters.empty()) ++lost_;  // nothing brings another: it was not meant to leave
  }
}

// The first region that holds a body acts on it, so that a slot has at most one event from here.
void Particles::visit_regions() {
  if (world_.regions.empty()) return;
  for (std::uint32_t slot = 0; slot < world_.capacity; ++slot) {
    if (columns_.alive[slot] == 0) continue;
    const auto region =
        std::find_if(world_.regions.begin(), world_.regions.end(),
                     [&, at = pile_.position(slot)](const Region& r) { return inside(at, r.low, r.high); });
    if (region != world_.regions.end()) act(*region, slot);
  }
}

void Particles::act(const Region& region, std::uint32_t slot) {
  switch (region.action) {
    case Region::Action::kRemove:
      despawn(slot);
      return;
    case Region::Action::kTeleport: {
      Vec3f to = pile_.position(slot);
      for (std::size_t i = 0; i < 3; ++i) to[i] += region.offset[i];
      if (inside(to, world_.low, world_.high)) {
        pile_.move(slot, to);
        events_.push_back({Event::Kind::kTeleported, slot});
      } else {
        despawn(slot);
      }
      return;
    }
    case Region::Action::kSetType:
      if (columns_.type[slot] == region.type) return;
      columns_.type[slot] = region.type;
      pile_.set_type(slot, region.type);
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
  Vec3f at{};
  for (std::size_t i = 0; i < 3; ++i) {
    const float share = unit_float(splitmix64(splitmix64(world_.seed) + 3 * number + i));
    at[i] = emitter.low[i] + share * (emitter.high[i] - emitter.low[i]);
  }
  pile_.add(slot, at, emitter.velocity, emitter.type);
  events_.push_back({Event::Kind::kSpawned, slot});
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
  Checkpoint loaded(world_.capacity);
  if (!load_checkpoint(bytes, fingerprint_, world_.emitters.size(), loaded)) return false;
  const Columns& columns = loaded.columns;
  for (std::uint32_t slot = 0; slot < world_.capacity; ++slot) {
    const Vec3f p{columns.position[0][slot], columns.position[1][slot], columns.position[2][slot]};
    if (columns.alive[slot] > 1 || columns.type[slot] >= world_.types.size()) return false;
    if (columns.alive[slot] != 0 && !inside(p, world_.low, world_.high)) return false;
  }
  PileImage before;
  pile_.save(before);
  if (!pile_.load(columns, loaded.image)) {
    static_cast<void>(pile_.load(columns_, before));
    return false;
  }
  columns_ = std::move(loaded.columns);
  events_.clear();
  free_from_ = 0;
  colliding_ = pile_.touching();
  return true;
}

}  // namespace

Result<std::unique_ptr<Simulation>> make_particles(const EngineWorld& world, std::uint32_t threads,
                                                   Instructions instructions) {
  if (threads == 0 || threads > kMaxThreads)
    return fail(ErrorCode::kInvalidArgument, "threads must be 1 to " + std::to_string(kMaxThreads));
  return check(world).transform(
      [&] { return std::unique_ptr<Simulation>(std::make_unique<Particles>(world, threads, instructions)); });
}

}  // namespace tandem::engine
