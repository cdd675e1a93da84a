#include "services/host/streams/contact_control.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "services/host/streams/exponential.hpp"
#include "services/host/streams/gains.hpp"

namespace tandem::host {
namespace {

using Vector = std::array<double, 3>;

constexpr std::int32_t kFrictionOfShapes = 1024,
                       kFirstFriction = 819;  // 0.2 in 2^-12: balls roll, so it is less than an engine's
// In 2^-16: half of what Bullet has. ODE's edges are sharp.
constexpr std::int32_t kFirstRounding = 3328;
constexpr double kLeastFriction = 0.01 * 4096;
// A decision about the friction of shapes counts in full with so many times as many. Heaps that hardly move
// always seem to want more of it, with few corrections; what counts is what bodies do that move.
constexpr double kEnoughForFriction = 25;
// So many times fewer do for the edges: few bodies lie at one, and they are off by far.
constexpr double kEnoughForEdges = 0.2;
// Weaker pushes say nothing; in the solver's unit, of which the threshold a frame is 1024 to 2047.
constexpr double kWeakestPush = 16, kWeakestFriction = 4;
// The mean cosine at which a stream needs the fewest bits. That of shapes has no influence up to kSlack.
constexpr double kAim = 0.1, kAimOfShapes = 0, kSlack = 0.1;
// Changes of one decision per cosine: share of the radius; thresholds; logarithm of the friction; share of
// the smallest half size.
constexpr double kRadiusRate = 0.006, kWallRate = 0.06, kFrictionRate = 0.5, kFrictionRateOfShapes = 2,
                 kRoundingRate = 0.06;
// If decisions are far from the aim on the same side, radii change twice as fast each time: at the start they
// may be several per cent wrong.
constexpr double kFarOff = 0.2, kFastest = 8;
// A heap stands on the sizes of its bodies: where these swing to and fro by a thousandth, all of it is
// corrected up and down.
constexpr double kSlowest = 1.0 / 64, kFasterAgain = 1.2;

Vector vector(const Vec3i& from) {
  return {static_cast<double>(from[0]), static_cast<double>(from[1]), static_cast<double>(from[2])};
}
double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

}  // namespace

void set_first_contacts(StreamParameters& parameters, bool shapes) {
  parameters.step.contacts = {.listed = true,
                              .radius = 0,
                              .wall = 0,
                              .friction = shapes ? kFrictionOfShapes : kFirstFriction,
                              .rounding = shapes ? kFirstRounding : 0};
}

double ContactControl::Pace::step(double off) {
  speed =
      off * last > 0 && std::abs(off) > kFarOff ? std::min(kFastest, 2 * speed) : std::max(1.0, speed / 2);
  last = off;
  return speed * off;
}

double ContactControl::Pace::careful_step(double off) {
  if (off == 0) return 0;
  if (off * last < 0) speed = std::max(kSlowest, speed / 2);
  if (off * last > 0) speed = std::min(1.0, speed * kFasterAgain);
  last = off;
  return speed * off;
}

ContactControl::ContactControl(std::uint32_t bodies, const StreamParameters& parameters, bool shapes)
    : shapes_(shapes),
      enough_(enough_corrections(bodies)),
      radius_(parameters.step.contacts.radius),
      wall_(parameters.step.contacts.wall),
      friction_(parameters.step.contacts.friction),
      rounding_(parameters.step.contacts.rounding) {}

void ContactControl::observe(const State& predicted, const State& target, std::int32_t threshold,
                             std::span<const Push> pushes) {
  if (pushes.empty()) return;
  const double least = static_cast<double>(threshold) * threshold;
  for (Slot s = 0; s < predicted.capacity(); ++s) {
    if (predicted.alive()[s] == 0 || target.alive()[s] == 0) continue;
    Vector d{};
    for (std::size_t i = 0; i < 3; ++i)
      d[i] = static_cast<double>(std::int64_t{target.p(i)[s]} - predicted.p(i)[s]);
    const double length = dot(d, d);
    if (length <= least) continue;
    const auto see = [&](Mean& mean, const Vec3i& push, double weakest) {
      const Vector p = vector(push);
      const double strength = dot(p, p);
      if (strength > weakest * weakest) mean.add(dot(d, p) / std::sqrt(length * strength));
    };
    see(radius_seen_, pushes[s].normal, kWeakestPush);
    see(wall_seen_, pushes[s].wall, kWeakestPush);
    see(friction_seen_, pushes[s].across, kWeakestFriction);
    see(edges_seen_, pushes[s].edge, kWeakestPush);
  }
}

bool ContactControl::after_frame(StreamParameters& parameters) {
  if (++frames_ < kFramesPerDecision) return false;
  frames_ = 0;
  const auto off = [this](const Mean& mean) {
    const double weight = std::min(1.0, mean.count / enough_);
    if (!shapes_) return (mean.value() - kAim) * weight;
    const double beyond = mean.value() - kAimOfShapes;
    return (beyond - std::clamp(beyond, -kSlack, kSlack)) * weight;
  };
  const auto step = [this](Pace& pace, double by) { return shapes_ ? pace.careful_step(by) : pace.step(by); };
  constexpr double kLonger = ContactParameters::kMaxLonger;
  radius_ =
      std::clamp(radius_ + 65536 * kRadiusRate * step(radius_pace_, off(radius_seen_)), -kLonger, kLonger);
  const double threshold = parameters.codec.threshold;
  const double most_wall = std::min<double>(kMaxStep, 16 * threshold);
  wall_ =
      std::clamp(wall_ + threshold * kWallRate * step(wall_pace_, off(wall_seen_)), -most_wall, most_wall);
  const double friction_off = shapes_
                                  ? kFrictionRateOfShapes * friction_seen_.value() *
                                        std::min(1.0, friction_seen_.count / (kEnoughForFriction * enough_))
                                  : kFrictionRate * off(friction_seen_);
  friction_ =
      std::clamp<double>(friction_ * exp_of(friction_off), kLeastFriction, ContactParameters::kMaxFriction);
  const double edges_off =
      edges_seen_.value() * std::min(1.0, edges_seen_.count / (kEnoughForEdges * enough_));
  rounding_ =
      std::clamp<double>(rounding_ - 65536 * kRoundingRate * edges_off, 0, ContactParameters::kMaxRounding);
  radius_seen_ = wall_seen_ = friction_seen_ = edges_seen_ = {};
  ContactParameters& in_force = parameters.step.contacts;
  const ContactParameters wanted{true, static_cast<std::int32_t>(radius_), static_cast<std::int32_t>(wall_),
                                 static_cast<std::int32_t>(friction_), static_cast<std::int32_t>(rounding_)};
  if (wanted == in_force) return false;
  in_force = wanted;
  return true;
}

}  // namespace tandem::host
