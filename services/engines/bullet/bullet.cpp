#include "services/engines/bullet/bullet.hpp"

#include <algorithm>
#include <memory>
#include <utility>

#include "services/engines/bullet/check.hpp"
#include "services/engines/bullet/columns.hpp"
#include "services/engines/bullet/physics.hpp"
#include "services/engines/common/check.hpp"

namespace tandem::engine {
namespace {

class Rigid final : public Simulation {
 public:
  explicit Rigid(const RigidWorld& world);

  [[nodiscard]] std::uint32_t capacity() const override { return rigid_.world.capacity; }
  [[nodiscard]] double dt_s() const override { return static_cast<double>(rigid_.world.dt_s); }
  [[nodiscard]] Vec3 gravity() const override { return columns_.gravity; }
  [[nodiscard]] double damping_per_s() const override {
    return static_cast<double>(rigid_.world.damping_per_s);
  }
  [[nodiscard]] Classification classify(const Input& input) const override {
    Classification result = classify_input(input, rigid_);
    if (result.effect == Classification::Effect::kImmediate) result.cost = push_cost(input, bodies());
    return result;
  }
  [[nodiscard]] InputBudget input_budget() const override { return engine::input_budget(rigid_.world); }
  void apply(const Input& input) override;
  void step() override;
  [[nodiscard]] Bodies bodies() const override;
  [[nodiscard]] std::span<const Event> events() const override { return events_; }
  [[nodiscard]] std::uint32_t colliding() const override { return colliding_; }
  [[nodiscard]] Mishaps mishaps() const override { return columns_.mishaps; }
  void save(std::vector<std::byte>& out) const override { save_columns(columns_, fingerprint_, out); }
  [[nodiscard]] bool load(std::span<const std::byte> bytes) override;

 private:
  void build();
  void act(const WaitingInput& input);
  void spawn(const WaitingInput& input);
  template <class Act>
  void each_within(const WaitingInput& input, const Act& act);
  void despawn(std::uint32_t slot);
  void read_back();
  void count_colliding();

  RigidWorld rigid_;
  std::uint64_t fingerprint_;
  MotionLimits limits_;
  RigidColumns columns_;
  std::unique_ptr<Physics> physics_;
  std::vector<Event> events_;
  std::vector<std::uint8_t> touching_;
  std::uint32_t colliding_ = 0;
};

Rigid::Rigid(const RigidWorld& world)
    : rigid_(world),
      fingerprint_(fingerprint(world)),
      limits_(motion_limits(world.world)),
      columns_(world.world.capacity),
      touching_(world.world.capacity) {
  events_.reserve(2 * std::size_t{world.world.capacity});
  for (std::uint32_t slot = 0; slot < world.world.start.size(); ++slot) {
    const StartBody& body = world.world.start[slot];
    Motion motion{.position = body.position, .velocity = body.velocity};
    if (!world.orientation.empty()) motion.orientation = world.orientation[slot];
    if (!world.spin.empty()) motion.angular_velocity = world.spin[slot];
    columns_.set_motion(slot, motion);
    columns_.alive[slot] = 1;
    columns_.type[slot] = body.type;
    columns_.activity[slot] = ACTIVE_TAG;
  }
  const Vec3f& g = world.world.gravity;
  columns_.gravity = {static_cast<double>(g[0]), static_cast<double>(g[1]), static_cast<double>(g[2])};
  build();
}

// Builds Bullet's objects only from the columns, so that two loads of the same bytes continue identically.
void Rigid::build() {
  physics_ = std::make_unique<Physics>(rigid_);
  physics_->set_gravity(columns_.gravity);
  for (std::uint32_t slot = 0; slot < rigid_.world.capacity; ++slot) {
    if (columns_.alive[slot] == 0) continue;
    physics_->add(slot, columns_.type[slot], columns_.motion(slot), columns_.activity[slot],
                  columns_.still_s[slot]);
  }
}

void Rigid::apply(const Input& input) {
  const std::vector<double>& v = input.values;
  const auto at = [&v](std::size_t i) { return static_cast<float>(v[i]); };
  if (input.kind == static_cast<std::uint32_t>(InputKind::kGravity)) {
    columns_.gravity = {v[0], v[1], v[2]};
    physics_->set_gravity(columns_.gravity);
    return;
  }
  if (columns_.waiting.size() >= kMaxWaiting) return;
  WaitingInput waiting;
  if (input.kind == static_cast<std::uint32_t>(InputKind::kPush)) {
    waiting.motion.position = {at(0), at(1), at(2)};
    waiting.motion.velocity = {at(4), at(5), at(6)};
    waiting.radius = at(3);
  } else if (const auto spawn = spawn_of(input.bytes)) {
    waiting.kind = WaitingInput::Kind::kSpawn;
    waiting.type = spawn->type;
    waiting.motion = {spawn->position, spawn->velocity, spawn->orientation, spawn->angular_velocity};
  } else if (const auto remove = remove_of(input.bytes)) {
    waiting.kind = WaitingInput::Kind::kRemove;
    waiting.motion.position = remove->centre;
    waiting.radius = remove->radius;
  }
  columns_.waiting.push_back(waiting);
}

void Rigid::step() {
  events_.clear();
  for (const WaitingInput& input : columns_.waiting) act(input);
  columns_.waiting.clear();
  for (std::uint32_t i = 0; i < rigid_.world.substeps; ++i) {
    physics_->step(rigid_.world.dt_s / static_cast<float>(rigid_.world.substeps));
    read_back();
  }
  std::sort(events_.begin(), events_.end(), [](const Event& a, const Event& b) {
    return std::pair(a.slot, a.kind) < std::pair(b.slot, b.kind);
  });
  count_colliding();
}

void Rigid::act(const WaitingInput& input) {
  switch (input.kind) {
    case WaitingInput::Kind::kSpawn:
      spawn(input);
      return;
    case WaitingInput::Kind::kRemove:
      each_within(input, [this](std::uint32_t slot) { despawn(slot); });
      return;
    case WaitingInput::Kind::kPush:
      each_within(input, [&](std::uint32_t slot) {
        physics_->push(slot, input.motion.position, input.motion.velocity);
      });
  }
}

void Rigid::spawn(const WaitingInput& input) {
  const auto free = std::find(columns_.alive.begin(), columns_.alive.end(), std::uint8_t{0});
  if (free == columns_.alive.end()) return;
  const auto slot = static_cast<std::uint32_t>(free - columns_.alive.begin());
  const auto type = static_cast<std::uint16_t>(input.type);
  columns_.alive[slot] = 1;
  columns_.type[slot] = type;
  columns_.set_motion(slot, input.motion);
  physics_->add(slot, type, input.motion);
  events_.push_back({Event::Kind::kSpawned, slot});
}

template <class Act>
void Rigid::each_within(const WaitingInput& input, const Act& act) {
  for (std::uint32_t slot = 0; slot < rigid_.world.capacity; ++slot) {
    if (columns_.alive[slot] == 0) continue;
    float squared = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const float d = columns_.position[i][slot] - input.motion.position[i];
      squared += d * d;
    }
    if (squared <= input.radius * input.radius) act(slot);
  }
}

// A body that came and went in one step was never seen.
void Rigid::despawn(std::uint32_t slot) {
  physics_->remove(slot);
  columns_.alive[slot] = 0;
  const auto spawned = std::find_if(events_.begin(), events_.end(), [slot](const Event& event) {
    return event.slot == slot && event.kind == Event::Kind::kSpawned;
  });
  if (spawned != events_.end()) {
    events_.erase(spawned);
  } else {
    events_.push_back({Event::Kind::kDespawned, slot});
  }
}

void Rigid::read_back() {
  for (std::uint32_t slot = 0; slot < rigid_.world.capacity; ++slot) {
    if (columns_.alive[slot] == 0) continue;
    Motion motion = physics_->motion(slot);
    switch (mend(motion, limits_)) {
      case Condition::kLost:
        ++columns_.mishaps.removed;
        despawn(slot);
        continue;
      case Condition::kClamped:
        ++columns_.mishaps.clamped;
        physics_->set_angular_velocity(slot, motion.angular_velocity);
        break;
      case Condition::kFine:
        break;
    }
    columns_.set_motion(slot, motion);
    columns_.activity[slot] = static_cast<std::uint8_t>(physics_->activity(slot));
    columns_.still_s[slot] = physics_->still_s(slot);
  }
}

void Rigid::count_colliding() {
  std::fill(touching_.begin(), touching_.end(), std::uint8_t{0});
  physics_->mark_touching(touching_);
  colliding_ = static_cast<std::uint32_t>(std::count(touching_.begin(), touching_.end(), std::uint8_t{1}));
}

Bodies Rigid::bodies() const {
  Bodies view;
  for (std::size_t i = 0; i < 3; ++i) {
    view.position[i] = columns_.position[i];
    view.velocity[i] = columns_.velocity[i];
    view.angular_velocity[i] = columns_.angular_velocity[i];
  }
  for (std::size_t i = 0; i < 4; ++i) view.orientation[i] = columns_.orientation[i];
  view.alive = columns_.alive;
  view.type = columns_.type;
  return view;
}

bool Rigid::load(std::span<const std::byte> bytes) {
  RigidColumns loaded = columns_;
  if (!load_columns(bytes, fingerprint_, loaded)) return false;
  for (std::uint32_t slot = 0; slot < rigid_.world.capacity; ++slot) {
    if (loaded.alive[slot] > 1 || loaded.type[slot] >= rigid_.shapes.size()) return false;
    if (loaded.alive[slot] == 0) continue;
    Motion motion = loaded.motion(slot);
    if (mend(motion, limits_) == Condition::kLost) return false;
    if (loaded.activity[slot] < ACTIVE_TAG || loaded.activity[slot] > WANTS_DEACTIVATION) return false;
  }
  columns_ = std::move(loaded);
  events_.clear();
  build();
  colliding_ = 0;
  return true;
}

}  // namespace

bool bullet_is_built() { return true; }

Result<std::unique_ptr<Simulation>> make_bullet(const RigidWorld& world) {
  return check(world).transform([&] { return std::unique_ptr<Simulation>(std::make_unique<Rigid>(world)); });
}

}  // namespace tandem::engine
