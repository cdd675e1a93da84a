#include "services/engines/scenes/script.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "services/engines/scenes/random.hpp"
#include "services/engines/scenes/scene.hpp"

namespace tandem::scenes {
namespace {

using engine::Input;
using engine::InputKind;
using engine::Vec3;

constexpr std::uint64_t kTiltingKey = 0x54494C54;  // streams of random numbers of their own
constexpr std::uint64_t kPokingKey = 0x504F4B45;

Input gravity_along(const Vec3& direction, double strength) {
  Input input;
  input.kind = static_cast<std::uint32_t>(InputKind::kGravity);
  for (const double d : direction) input.values.push_back(d * strength);
  return input;
}

double next_period(Random& random, double period_s, double jitter) {
  return period_s * (1 + jitter * random.both_sides());
}

double length(const Vec3& v) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

}  // namespace

Script::Script(const Scene& scene, std::uint64_t seed, std::uint32_t users) : scene_(&scene) {
  const std::uint32_t count = users == 0 ? scene.users : users;
  for (const ScriptedInput& event : scene.events) {
    if (event.user < count) pending_.push_back({0, event});
  }
  const Vec3 down = normalised(scene.gravity, {0, -1, 0});
  std::size_t rank = 0;
  for (std::uint32_t user = 0; user < count; ++user) {
    const double share = static_cast<double>(user) / count;  // users take turns within a period
    for (std::size_t i = 0; i < scene.tilting.size(); ++i) {
      const Tilting& tilting = scene.tilting[i];
      routines_.push_back({.user = user,
                           .rank = ++rank,
                           .tilting = &tilting,
                           .next_s = tilting.start_s + share * tilting.period_s,
                           .random = Random(seed, kTiltingKey + i, user),
                           .held = down});
    }
    for (std::size_t i = 0; i < scene.poking.size(); ++i) {
      const Poking& poking = scene.poking[i];
      routines_.push_back({.user = user,
                           .rank = ++rank,
                           .poking = &poking,
                           .next_s = poking.start_s + share * poking.period_s,
                           .random = Random(seed, kPokingKey + i, user)});
    }
  }
}

void Script::act(const Routine& routine, double time_s, Input input) {
  const auto frame =
      std::max<std::uint64_t>(1, static_cast<std::uint64_t>(std::llround(time_s / scene_->dt_s)));
  pending_.push_back({routine.rank, {frame, routine.user, std::move(input)}});
}

void Script::tilt(Routine& routine) {
  const Tilting& tilting = *routine.tilting;
  const double strength = length(scene_->gravity) * tilting.strength;
  const Vec3 down = normalised(scene_->gravity, {0, -1, 0});
  const double every_s = std::max(tilting.send_every_s, scene_->dt_s);
  const Vec3 aside = routine.random.in_ball();
  routine.over = tilting.turn_over && !routine.over;
  Vec3 wanted{};
  for (std::size_t i = 0; i < 3; ++i)
    wanted[i] = (routine.over ? -down[i] : down[i]) + tilting.spread * aside[i];
  wanted = normalised(wanted, down);
  for (double into_s = every_s; into_s < tilting.swing_s; into_s += every_s) {
    const double share = into_s / tilting.swing_s;
    Vec3 between{};
    for (std::size_t i = 0; i < 3; ++i) between[i] = (1 - share) * routine.held[i] + share * wanted[i];
    act(routine, routine.next_s + into_s, gravity_along(normalised(between, wanted), strength));
  }
  act(routine, routine.next_s + tilting.swing_s, gravity_along(wanted, strength));
  routine.held = wanted;
  routine.next_s += next_period(routine.random, tilting.period_s, tilting.period_jitter);
}

void Script::poke(Routine& routine) {
  const Poking& poking = *routine.poking;
  Input input;
  input.kind = static_cast<std::uint32_t>(InputKind::kPush);
  for (std::size_t i = 0; i < 3; ++i) {
    input.values.push_back(poking.low[i] + routine.random.unit() * (poking.high[i] - poking.low[i]));
  }
  input.values.push_back(poking.radius_m);
  for (const double d : normalised(routine.random.in_ball(), {0, 1, 0}))
    input.values.push_back(d * poking.speed_m_per_s);
  act(routine, routine.next_s, std::move(input));
  routine.next_s += next_period(routine.random, poking.period_s, poking.period_jitter);
}

std::vector<ScriptedInput> Script::until(std::uint64_t frame) {
  // Times are rounded to frames, so an action that begins half a frame later may still belong to this one.
  const double end_s = (static_cast<double>(frame) + 1) * scene_->dt_s;
  for (Routine& routine : routines_) {
    while (routine.next_s <= end_s) routine.tilting != nullptr ? tilt(routine) : poke(routine);
  }
  const auto later = std::stable_partition(pending_.begin(), pending_.end(),
                                           [frame](const Pending& p) { return p.input.frame <= frame; });
  std::stable_sort(pending_.begin(), later, [](const Pending& a, const Pending& b) {
    return std::tuple(a.input.frame, a.input.user, a.rank) < std::tuple(b.input.frame, b.input.user, b.rank);
  });
  std::vector<ScriptedInput> due;
  for (auto it = pending_.begin(); it != later; ++it) due.push_back(std::move(it->input));
  pending_.erase(pending_.begin(), later);
  return due;
}

std::vector<ScriptedInput> scripted_inputs(const Scene& scene, std::uint64_t seed, std::uint32_t users,
                                           std::uint64_t frames) {
  return Script(scene, seed, users).until(frames);
}

}  // namespace tandem::scenes
