#include "services/scenes/script.hpp"

#include <algorithm>
#include <cmath>

#include "services/scenes/random.hpp"
#include "services/scenes/scene.hpp"

namespace tandem::scenes {
namespace {

using engine::Input;
using engine::InputKind;
using engine::Vec3;

constexpr std::uint64_t kTiltingKey = 0x54494C54;  // streams of random numbers of their own
constexpr std::uint64_t kPokingKey = 0x504F4B45;

// One user's list under construction.
struct Hand {
  const Scene& scene;
  std::uint64_t frames;
  std::uint32_t user;
  std::vector<ScriptedInput>& out;

  [[nodiscard]] double end_s() const { return static_cast<double>(frames) * scene.dt_s; }
  void act(double time_s, Input input) const {
    const std::uint64_t frame =
        std::max<std::uint64_t>(1, static_cast<std::uint64_t>(std::llround(time_s / scene.dt_s)));
    if (frame <= frames) out.push_back({frame, user, std::move(input)});
  }
};

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

void tilt(const Hand& hand, const Tilting& tilting, double offset_s, Random random) {
  const double strength = length(hand.scene.gravity) * tilting.strength;
  const Vec3 down = normalised(hand.scene.gravity, {0, -1, 0});
  const double every_s = std::max(tilting.send_every_s, hand.scene.dt_s);
  Vec3 held = down;
  bool over = false;
  for (double t = tilting.start_s + offset_s; t <= hand.end_s();) {
    const Vec3 aside = random.in_ball();
    over = tilting.turn_over && !over;
    Vec3 wanted{};
    for (std::size_t i = 0; i < 3; ++i) wanted[i] = (over ? -down[i] : down[i]) + tilting.spread * aside[i];
    wanted = normalised(wanted, down);
    for (double into_s = every_s; into_s < tilting.swing_s; into_s += every_s) {
      const double share = into_s / tilting.swing_s;
      Vec3 between{};
      for (std::size_t i = 0; i < 3; ++i) between[i] = (1 - share) * held[i] + share * wanted[i];
      hand.act(t + into_s, gravity_along(normalised(between, wanted), strength));
    }
    hand.act(t + tilting.swing_s, gravity_along(wanted, strength));
    held = wanted;
    t += next_period(random, tilting.period_s, tilting.period_jitter);
  }
}

void poke(const Hand& hand, const Poking& poking, double offset_s, Random random) {
  for (double t = poking.start_s + offset_s; t <= hand.end_s();) {
    Input input;
    input.kind = static_cast<std::uint32_t>(InputKind::kPush);
    for (std::size_t i = 0; i < 3; ++i) {
      input.values.push_back(poking.low[i] + random.unit() * (poking.high[i] - poking.low[i]));
    }
    input.values.push_back(poking.radius_m);
    for (const double d : normalised(random.in_ball(), {0, 1, 0}))
      input.values.push_back(d * poking.speed_m_per_s);
    hand.act(t, std::move(input));
    t += next_period(random, poking.period_s, poking.period_jitter);
  }
}

}  // namespace

std::vector<ScriptedInput> scripted_inputs(const Scene& scene, std::uint64_t seed, std::uint32_t users,
                                           std::uint64_t frames) {
  const std::uint32_t count = users == 0 ? scene.users : users;
  std::vector<ScriptedInput> result;
  for (const ScriptedInput& event : scene.events) {
    if (event.user < count && event.frame <= frames) result.push_back(event);
  }
  for (std::uint32_t user = 0; user < count; ++user) {
    const Hand hand{scene, frames, user, result};
    const double share = static_cast<double>(user) / count;  // users take turns within a period
    for (std::size_t i = 0; i < scene.tilting.size(); ++i) {
      tilt(hand, scene.tilting[i], share * scene.tilting[i].period_s, Random(seed, kTiltingKey + i, user));
    }
    for (std::size_t i = 0; i < scene.poking.size(); ++i) {
      poke(hand, scene.poking[i], share * scene.poking[i].period_s, Random(seed, kPokingKey + i, user));
    }
  }
  std::stable_sort(result.begin(), result.end(), [](const ScriptedInput& a, const ScriptedInput& b) {
    return std::pair(a.frame, a.user) < std::pair(b.frame, b.user);
  });
  return result;
}

}  // namespace tandem::scenes
