#include "tests/support/worlds/worlds.hpp"

#include <algorithm>
#include <functional>

#include "sdk/core/lattice/turn.hpp"
#include "sdk/core/predict/contact/constants.hpp"
#include "sdk/core/predict/rigid/constants.hpp"
#include "sdk/core/tables/predictor_table.hpp"
#include "tests/property/synthetic.hpp"

namespace tandem::worlds {
namespace {

using synthetic::Random;

// Half an edge of a cube. Balls of type 0 have it as their radius.
constexpr std::int32_t kHalf = 20'000;
constexpr std::int32_t kThreshold = kHalf / 10;
constexpr Vec3i kGravity{0, -28'000, 0};  // 0.22 thresholds a frame^2
enum Type : TypeId { kCube, kBall, kCapsule, kBoard, kGiant, kTypes };

// Puts bodies into the slots of a state one by one. Lengths in lattice units from the middle of a room.
class Placing {
 public:
  Placing(State& state, const Vec3i& middle) : state_(state), middle_(middle) {}

  void add(TypeId type, const Vec3i& at, const Vec3i& v = {}, const Quaternion& q = kNoTurn) {
    if (next_ == state_.capacity()) return;
    Vec3i p{};
    for (std::size_t i = 0; i < 3; ++i) {
      const std::int64_t sum = std::int64_t{middle_[i]} + at[i];
      p[i] = static_cast<std::int32_t>(std::clamp<std::int64_t>(sum, -kPositionLimit, kPositionLimit));
    }
    state_.spawn(next_++, 0, type, {p, v, state_.groups().orientation ? q : Quaternion{}, {}});
  }
  /// All bodies lie still, held up against gravity, but for the last.
  void lay_to_rest() {
    for (Slot s = 0; s + 1 < next_; ++s) {
      state_.rest()[s] = 1;
      for (std::size_t i = 0; i < 3; ++i) state_.c(i)[s] = -kGravity[i];
    }
  }

 private:
  State& state_;
  Vec3i middle_;
  Slot next_ = 0;
};

Vec3i within(Random& random, std::int32_t limit) {
  Vec3i v{};
  for (std::int32_t& x : v) x = random.even(limit);
  return v;
}

// Bodies that touch, one behind the other along an axis; the last comes and strikes them.
void row(Placing& place, std::size_t axis) {
  for (std::int32_t i = 0; i < 20; ++i) {
    Vec3i p{0, kHalf, 0};
    p[axis] += 2 * kHalf * i;
    Vec3i v{};
    if (i == 19) v[axis] = -600'000;
    place.add(kCube, p, v);
  }
}

void wall(Placing& place, bool rests) {
  for (std::int32_t i = 0; i < 47; ++i) {
    const std::int32_t level = i / 8;
    place.add(kCube, {2 * kHalf * (i % 8) + level % 2 * kHalf, kHalf * (2 * level + 1), 0});
  }
  place.add(kBall, {7 * kHalf, 5 * kHalf, -6 * kHalf}, {0, 0, 2'000'000});
  if (rests) place.lay_to_rest();
}

void heap(Placing& place, std::int32_t speed) {
  Random random(71);
  for (std::int32_t i = 0; i < 60; ++i) {
    const auto at = [](std::int32_t cell) { return cell * (2 * kHalf + 900) - 3 * kHalf; };
    const Vec3i p{at(i % 4) + 13 * i, at(i / 16) + 5 * kHalf, at(i / 4 % 4) + 7 * i};
    const Quaternion q = i % 3 == 0 ? kNoTurn : synthetic::any_quaternion(random);
    place.add(static_cast<TypeId>(i % kGiant), p, within(random, speed), q);
  }
}

void in_one_place(Placing& place, std::int32_t apart) {
  Random random(72);
  for (std::int32_t i = 0; i < 40; ++i) {
    const Quaternion q = i % 2 == 0 ? kNoTurn : synthetic::any_quaternion(random);
    place.add(static_cast<TypeId>(i % kGiant), within(random, apart), {}, q);
  }
}

// One body that is much larger than all others, so that all of them are in its cell.
void beside_a_giant(Placing& place) {
  heap(place, 60'000);
  place.add(kGiant, {Solid::kMaxSize + 4 * kHalf, kHalf, 0}, {-400'000, 0, 0});
}

struct Setting {
  const char* name;
  std::function<void(Placing&)> fill;
  Vec3i middle{};
  std::int32_t largest = kHalf;  // of type kGiant: cells are as wide as the largest type
};

std::vector<Setting> settings() {
  constexpr std::int32_t kEnd = kPositionLimit;
  constexpr std::int32_t kGiantCell = 2 * Solid::kMaxSize;  // a cell is as wide at least
  return {
      {"row_x", [](Placing& place) { row(place, 0); }},
      {"tower", [](Placing& place) { row(place, 1); }},
      {"row_z", [](Placing& place) { row(place, 2); }},
      {"wall", [](Placing& place) { wall(place, false); }},
      {"wall_at_rest", [](Placing& place) { wall(place, true); }},
      {"heap", [](Placing& place) { heap(place, 60'000); }},
      {"fast", [](Placing& place) { heap(place, kVelocityLimit); }},
      {"overlapping", [](Placing& place) { in_one_place(place, kHalf / 2); }},
      {"one_place", [](Placing& place) { in_one_place(place, 0); }},
      {"beside_a_giant", beside_a_giant, {kGiantCell / 4, kGiantCell / 4, kGiantCell / 4}, Solid::kMaxSize},
      {"far", [](Placing& place) { heap(place, 60'000); }, {900'000'000, -800'000'000, 700'000'001}},
      {"wall_at_the_end", [](Placing& place) { wall(place, false); }, {kEnd - 9 * kHalf, 0, -kEnd}},
      {"end_of_the_lattice", [](Placing& place) { heap(place, 60'000); }, {kEnd, -kEnd, kEnd}}};
}

// A floor, a slope and a wall around the middle, with a box and a ball on the floor.
ContactConstants contact_constants(const Setting& setting) {
  const Vec3i& middle = setting.middle;
  constexpr std::int32_t kOne = ContactConstants::kOne;
  const auto at = [&](std::int32_t x, std::int32_t y, std::int32_t z) {
    Vec3i p{};
    const Vec3i by{x, y, z};
    for (std::size_t i = 0; i < 3; ++i)
      p[i] = std::clamp(middle[i] + by[i] * kHalf, -kPositionLimit, kPositionLimit);
    return p;
  };
  ContactConstants constants;
  constants.substeps = 4;
  constants.pair = constants.wall = {910, 102, 102};
  constants.types = {
      {kHalf, 65536}, {kHalf, 65536}, {kHalf / 2, 131072}, {kHalf / 4, 1 << 20}, {setting.largest, 30}};
  constants.planes = {{{0, kOne, 0}, middle[1]}, {{0, 0, kOne}, at(0, 0, -9)[2]}};
  // 3-4-5, so that the normal has length 1.
  const std::int64_t along = (std::int64_t{middle[0]} * 3 + std::int64_t{middle[1]} * 4) / 5;
  constants.planes.push_back({{kOne / 5 * 3, kOne / 5 * 4, 0},
                              static_cast<std::int32_t>(std::clamp<std::int64_t>(
                                  along - 6 * kHalf, -kPositionLimit, kPositionLimit))});
  constants.boxes = {
      {at(-4, 1, 2), {kHalf, 2 * kHalf, kHalf / 2}, {{{kOne, 0, 0}, {0, kOne, 0}, {0, 0, kOne}}}}};
  constants.balls = {{at(5, 0, 3), 2 * kHalf}};
  return constants;
}

std::vector<std::int32_t> constants_for(const PredictorTraits& predictor, const Setting& setting) {
  if (!predictor.reads_world && !predictor.reads_shapes) return {};
  const ContactConstants constants = contact_constants(setting);
  if (predictor.reads_shapes) {
    return write_rigid_constants({constants,
                                  {{Solid::Kind::kBox, {kHalf, kHalf, kHalf}},
                                   {Solid::Kind::kRound, {kHalf, 0, 0}},
                                   {Solid::Kind::kRound, {kHalf / 2, kHalf, 0}},
                                   {Solid::Kind::kBox, {kHalf, kHalf / 4, kHalf / 2}},
                                   {Solid::Kind::kBox, {setting.largest, kHalf, setting.largest / 3}}}});
  }
  return write_contact_constants(predictor.one_step ? in_one_step(constants) : constants);
}

Layout layout_for(const PredictorTraits& predictor, bool turns, const Setting& setting) {
  Layout layout;
  layout.capacity = 64;
  layout.type_count = kTypes;
  layout.parameters = {{kThreshold, 64, 64}, {800}};
  if (turns) {
    layout.groups.push_back(kOrientationGroup);
    layout.radii = {2 * kHalf, kHalf, 2 * kHalf, 2 * kHalf, 2 * setting.largest};
  }
  layout.codec = "tracker";
  layout.predictor = predictor.name;
  layout.predictor_constants = constants_for(predictor, setting);
  if (predictor.hard_contacts)
    layout.parameters.step.contacts = {true, 100, -50, 2000, predictor.reads_shapes ? 6000 : 0};
  layout.codec_tables = synthetic::tables_for(layout.codec, groups_of(layout));
  return layout;
}

}  // namespace

std::vector<World> worlds_for(std::string_view predictor, bool turns) {
  const PredictorTraits& traits = **find_predictor(predictor);
  std::vector<World> worlds;
  for (const Setting& setting : settings()) {
    World world{std::string(predictor) + (turns ? "_turning_" : "_") + setting.name,
                layout_for(traits, turns, setting),
                {},
                {kGravity, 200}};
    world.start = State(world.layout.capacity, groups_of(world.layout));
    Placing place(world.start, setting.middle);
    setting.fill(place);
    worlds.push_back(std::move(world));
  }
  return worlds;
}

std::vector<World> all_worlds() {
  std::vector<World> all;
  for (const PredictorTraits& predictor : predictors()) {
    std::vector<World> worlds = worlds_for(predictor.name, predictor.reads_shapes);
    std::move(worlds.begin(), worlds.end(), std::back_inserter(all));
  }
  return all;
}

StepInput input_at(const World& world, Frame frame) {
  constexpr Frame kTilts = 20;
  const Vec3i tilted{20'000, -20'000, -3'000};
  const auto gravity_at = [&](Frame at) { return at < kTilts ? world.drive.gravity : tilted; };
  return {{gravity_at(frame), world.drive.damping},
          world.layout.parameters.step,
          world.layout.parameters.codec.threshold,
          gravity_at(frame == 0 ? 0 : frame - 1)};
}

}  // namespace tandem::worlds
