#include "services/host/streams/lattice_choice.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace tandem::host {
namespace {

bool positive(double value) { return std::isfinite(value) && value > 0; }

constexpr double kDefaultRange = 8;  // thresholds; about what fast scenes leave behind in one frame
constexpr double kRangeSteps = 127;
constexpr int kAngleBits = 28;  // of a radian on the lattice

// Rounds up to at least 1. The caller has checked that the value is finite and not negative.
std::int32_t step_of(double range) {
  return static_cast<std::int32_t>(std::clamp(std::ceil(range / kRangeSteps), 1.0, double{kPositionLimit}));
}

}  // namespace

Result<Lattice> choose_lattice(double smallest_threshold, double extent, double dt_s) {
  for (const auto& [name, value] :
       {std::pair{"threshold", smallest_threshold}, {"extent", extent}, {"time of a step (dt)", dt_s}}) {
    if (!positive(value))
      return fail(ErrorCode::kInvalidArgument, fmt::format("the {} must be above 0, not {}", name, value));
  }
  constexpr double kSpare = 4;
  for (int s = kMaxHalvings; s >= kFewestHalvings; --s) {
    const double unit = std::ldexp(smallest_threshold, -s);
    if (extent * kSpare <= unit * double{kPositionLimit}) return Lattice{unit, dt_s, s};
  }
  return fail(
      ErrorCode::kInvalidArgument,
      fmt::format("threshold {:g} is too fine for an extent of {:g}: with it, at least {:.3g} is needed",
                  smallest_threshold, extent,
                  std::ldexp(extent * kSpare / double{kPositionLimit}, kFewestHalvings)));
}

Result<CodecParameters> codec_parameters(const Lattice& lattice, double threshold, double position_range,
                                         double velocity_range) {
  const double units = threshold * lattice.position_scale();
  if (!positive(threshold) || units < 0.5 || units > double{kPositionLimit}) {
    return fail(
        ErrorCode::kInvalidArgument,
        fmt::format("threshold {:g} is too far from the finest one of the session, or from the extent",
                    threshold));
  }
  if (!std::isfinite(position_range) || position_range < 0 || !std::isfinite(velocity_range) ||
      velocity_range < 0) {
    return fail(ErrorCode::kInvalidArgument, "quantisation ranges must be finite and not negative");
  }
  if (position_range == 0) position_range = kDefaultRange * threshold;
  if (velocity_range == 0) velocity_range = kDefaultRange * threshold / lattice.dt_s;
  CodecParameters parameters;
  parameters.threshold = static_cast<std::int32_t>(std::lround(units));
  parameters.position_step = step_of(position_range * lattice.position_scale());
  parameters.velocity_step = step_of(velocity_range * lattice.velocity_scale());
  return parameters;
}

Result<void> set_turn_steps(const Lattice& lattice, double turn_range, double spin_range, double radius,
                            CodecParameters& parameters) {
  if (!std::isfinite(turn_range) || turn_range < 0 || !std::isfinite(spin_range) || spin_range < 0 ||
      !positive(radius)) {
    return fail(ErrorCode::kInvalidArgument,
                "ranges of turns must be finite and not negative, radii positive");
  }
  const double usual = kDefaultRange * parameters.threshold * lattice.unit / radius;
  if (turn_range == 0) turn_range = usual;
  if (spin_range == 0) spin_range = usual / lattice.dt_s;
  // No turn is larger than kSpinLimit.
  const auto step = [](double range) {
    return step_of(std::min(std::ldexp(range, kAngleBits), double{kSpinLimit}));
  };
  parameters.turn_step = step(turn_range);
  parameters.spin_step = step(spin_range * lattice.dt_s);
  return {};
}

Result<Drive> to_drive(const Lattice& lattice, const engine::Vec3& gravity, double damping_per_s) {
  Drive drive;
  for (std::size_t i = 0; i < gravity.size(); ++i) {
    const double g = std::nearbyint(gravity[i] * lattice.dt_s * lattice.velocity_scale());
    if (!(std::abs(g) <= double{kVelocityLimit})) {
      return fail(
          ErrorCode::kInvalidArgument,
          fmt::format("gravity is ({:g}, {:g}, {:g}), but must be finite and at most {:.3g} along an axis",
                      gravity[0], gravity[1], gravity[2],
                      kVelocityLimit / (lattice.dt_s * lattice.velocity_scale())));
    }
    drive.gravity[i] = static_cast<std::int32_t>(g);
  }
  const double damping = std::nearbyint(damping_per_s * lattice.dt_s * 65536.0);
  if (!(damping >= 0 && damping < 65536.0)) {
    return fail(
        ErrorCode::kInvalidArgument,
        fmt::format(
            "a damping of {:g} must take from nothing to less than all of the velocity in a step of {:g} s",
            damping_per_s, lattice.dt_s));
  }
  drive.damping = static_cast<std::uint16_t>(damping);
  return drive;
}

}  // namespace tandem::host
