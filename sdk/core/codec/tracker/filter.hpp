#pragma once
// The tracker codec's filter: the effect of a correction of a body's position on its p, v and c. Both sides
// run it, so it is integers to the last bit. idl/PROTOCOL.md, "Tracker", has the same formulas.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "sdk/core/codec/codec.hpp"
#include "sdk/core/lattice/fixed_point.hpp"
#include "sdk/core/lattice/state.hpp"
#include "sdk/core/layout/tracker_kind.hpp"

namespace tandem {

/// A correction of a body's position, in steps along each axis. Not all zero.
using TrackerSteps = std::array<std::int32_t, 3>;
inline constexpr std::int32_t kMaxTrackerSteps = INT32_MAX;

/// The content of a delta for one corrected body.
struct TrackerCorrection {
  TrackerSteps steps{};  ///< of its position; all zero: the position is not corrected
  bool fine = false;     ///< position and orientation are corrected, by smaller steps
  bool rest = false;     ///< the body is put to rest after the correction: State::rest()
};
/// The same in a stream with orientations. Kept apart, because other streams would keep zeros for every body.
struct TrackerTurningCorrection : TrackerCorrection {
  TrackerSteps turn{};  ///< of its orientation; all zero: it is not corrected; one of the two is
};
[[nodiscard]] inline bool is_some(const TrackerSteps& steps) { return (steps[0] | steps[1] | steps[2]) != 0; }

/// Frames since a body's last correction are counted up to this.
inline constexpr std::uint32_t kMaxAge = 255;

/// What the codec remembers for a body's position besides p, v and c, or for its orientation besides q and w.
/// All zero for a new body and for a dead slot. TrackerMemory keeps bytes. Here they are words, because
/// compilers pack a struct of five bytes into one register, byte by byte, which takes as long as the filter
/// itself.
struct TrackerBody {
  std::uint32_t age = 0;       ///< frames since its last correction, 0 .. kMaxAge - 1
  std::uint32_t interval = 0;  ///< k of the last correction; 0: no correction yet
  TrackerSteps steps{};        ///< of the last correction, saturated at +-127
};

/// The parts of a correction that count as errors of velocity and acceleration, by k = min(age + 1, 255): 64
/// beta / k and 64 beta gamma / k^2, in 1/65536.
class TrackerGains {
 public:
  explicit TrackerGains(const TrackerKind& kind);
  /// Sets beta in 1/32768 and gamma in 1/65536, as in CodecParameters.
  void set(std::uint16_t beta, std::uint16_t gamma);

  [[nodiscard]] std::int64_t velocity(std::uint32_t k) const { return velocity_[k]; }
  [[nodiscard]] std::int64_t acceleration(std::uint32_t k) const { return acceleration_[k]; }
  /// Encoder only: the minimum probability of a correction, in 1/65536, for which a body is corrected before
  /// it has to be.
  [[nodiscard]] std::uint32_t early() const;

 private:
  TrackerKind kind_;
  std::uint16_t beta_ = 0, gamma_ = 0;
  std::array<std::int64_t, kMaxAge + 1> velocity_{};
  std::array<std::int64_t, kMaxAge + 1> acceleration_{};
};

/// Converts steps to lattice units for one threshold e.
class TrackerSteppings {
 public:
  /// Maximum length of a correction along an axis.
  static constexpr std::int64_t kMaxDistance = std::int64_t{1} << 31;

  /// A factor on the size of steps, in 1/65536. Where position and orientation may both be off, steps are
  /// smaller, so that more of the error ball is left to the other; RESEARCH.md, "Turns".
  static constexpr std::int64_t kAlone = 65536, kJoint = 48497, kFine = 27525;

  /// The size of a step is a multiple of 2^position_bits, at most 2^24, so that rounded positions stay
  /// rounded.
  explicit TrackerSteppings(std::int32_t threshold, unsigned position_bits = 0, std::int64_t size = kAlone) {
    const auto share = [threshold, position_bits, size](std::int64_t of_65536) {
      const std::int64_t whole = ((threshold * ((of_65536 * size) >> 16)) >> 16) >> position_bits
                                                                                        << position_bits;
      return static_cast<std::int32_t>(std::max(std::int64_t{1} << position_bits, whole));
    };
    for (std::size_t i = 0; i < kUnits.size(); ++i) units_[i] = share(kUnits[i]);
  }

  /// The size of one of these steps in lattice units.
  [[nodiscard]] std::int32_t unit_for(const TrackerSteps& steps) const { return units_[unit_of(steps)]; }
  /// The size of one step. `moved` is 0 if an axis moves by more than one step; otherwise it is the number (1
  /// .. 3) of axes that move.
  [[nodiscard]] std::int32_t unit(std::size_t moved) const { return units_[moved]; }

  /// The angle (2^-28 rad) that moves a point at this radius (lattice units) by one step.
  [[nodiscard]] std::int32_t angle(std::size_t moved, std::int32_t radius) const {
    return static_cast<std::int32_t>(
        std::clamp<std::int64_t>((std::int64_t{units_[moved]} << 28) / radius, 1, kSpinLimit));
  }
  [[nodiscard]] std::int32_t angle_for(const TrackerSteps& steps, std::int32_t radius) const {
    return angle(unit_of(steps), radius);
  }

  /// The index of the unit for unit(). It has no branches, because they would be hard to predict. If all
  /// steps are zero, any unit will do.
  [[nodiscard]] static std::size_t unit_of(const TrackerSteps& steps) {
    std::size_t moved = 0;
    std::size_t is_small = 1;
    for (const std::int32_t s : steps) {
      moved += static_cast<std::size_t>(s != 0);
      is_small &= static_cast<std::size_t>(s >= -1) & static_cast<std::size_t>(s <= 1);
    }
    return moved * is_small;
  }

  /// The size of a step in 1/256 of the threshold, by the index of its unit.
  [[nodiscard]] static std::int32_t relative_unit(std::size_t unit) { return kUnits[unit] >> 8; }
  /// The correction in 1/256 of the threshold; steps within +-127.
  [[nodiscard]] static std::array<std::int32_t, 3> relative(const TrackerSteps& steps) {
    const std::int32_t one = relative_unit(unit_of(steps));
    return {steps[0] * one, steps[1] * one, steps[2] * one};
  }

 private:
  // Sizes in 1/65536 of the threshold. A step of 0.95 keeps the maximum rounding error, sqrt(3)/2 steps,
  // inside the error ball. If all |steps| <= 1 and 1, 2 or 3 of them are not zero, corrections are a little
  // longer than the threshold, so their points lie at 0.92, 0.69 * sqrt(2), 0.59 * sqrt(3) of it.
  static constexpr std::array<std::int32_t, 4> kUnits{62259, 60293, 45220, 38666};

  std::array<std::int32_t, 4> units_{1, 1, 1, 1};
};

namespace tracker_detail {

// Maximum change of v and c by one step, in 1/64 units; twice the maximum velocity.
inline constexpr std::int64_t kMaxGrowth = std::int64_t{1} << 29;

inline std::int64_t dot(const Vec3i& a, const Vec3i& b) {
  std::int64_t sum = 0;
  for (std::size_t i = 0; i < 3; ++i) sum += std::int64_t{a[i]} * b[i];
  return sum;
}

// From this many steps along an axis on, a body that was corrected in the frame before is off by far.
inline constexpr std::int32_t kLongStep = 3;

inline std::int64_t longest_of(const TrackerSteps& steps) {
  std::int64_t longest = 0;
  for (const std::int64_t step : steps) longest = std::max({longest, step, -step});
  return longest;
}

// The meaning of a correction for velocity and acceleration, and for what is remembered.
struct Meaning {
  Meaning(const TrackerSteps& steps, const TrackerBody& body) : k(std::min(body.age + 1U, kMaxAge)) {
    for (std::size_t i = 0; i < 3; ++i) now[i] = std::clamp(steps[i], -127, 127);
    const std::int64_t product = dot(TrackerSteppings::relative(body.steps), TrackerSteppings::relative(now));
    // Corrections that keep pointing the same way get more weight, in 1/256: 128 .. 384.
    belief = 256 + (std::clamp<std::int64_t>(product >> 8, -256, 256) >> 1);
    // A body that was hit in the frame before and is off by far moves otherwise than it did: its error is one
    // of velocity, all of it, and the previous correction says nothing about it.
    if (k == 1 && longest_of(steps) >= kLongStep) {
      is_far = true;
      belief = 256;
    }
  }
  /// The part of a correction that counts as an error of velocity, in 1/65536 of 1/64 units.
  [[nodiscard]] std::int64_t velocity(const TrackerGains& gains) const {
    return is_far ? std::int64_t{64} << 16 : gains.velocity(k);
  }
  /// The change of v, c or w by one step of size `one`, in 1/64 of its unit.
  [[nodiscard]] std::int64_t growth(std::int64_t one, std::int64_t gain) const {
    return std::min((share_of(one, gain) * belief + 128) >> 8, kMaxGrowth);
  }
  void remember(TrackerBody& body) const { body = {0, k, now}; }

  std::uint32_t k;
  std::int64_t belief = 0;
  bool is_far = false;
  TrackerSteps now{};
};

}  // namespace tracker_detail

/// Corrects bodies in one delta. With k = min(age + 1, 255), u = clamp(d . d_last / e^2, -1, 1):
///   position:     d = steps * unit;   p += d;  v += G(k) d (1 + u/2);  c += H(k) d (1 + u/2)
///   orientation:  d = steps * angle;  q turned by d;  w += G(k) d (1 + u/2)
/// A body that is put to rest then gets v = w = 0 and c = -gravity.
class TrackerFilter {
 public:
  /// `radii`: those of the stream, with orientations. They and `gains` must outlive the filter.
  TrackerFilter(const CodecParameters& parameters, const Vec3i& gravity, unsigned position_bits,
                const TrackerGains& gains, std::span<const std::int32_t> radii = {});

  /// Corrects the position by `correction.steps` and updates what is remembered for it.
  void move(State& state, Slot slot, const TrackerCorrection& correction, TrackerBody& body) const;
  /// Does the same for the orientation, by `correction.turn`.
  void turn(State& state, Slot slot, const TrackerTurningCorrection& correction, TrackerBody& body) const;
  /// Call last: wakes the body, or puts it to rest.
  void settle(State& state, Slot slot, bool rest) const;

  /// The step sizes of corrections that change the position alone.
  [[nodiscard]] const TrackerSteppings& coarse() const { return coarse_; }
  [[nodiscard]] std::int64_t most_c() const { return most_c_; }
  [[nodiscard]] const Vec3i& gravity() const { return gravity_; }

 private:
  [[nodiscard]] const TrackerSteppings& steppings(const TrackerCorrection& correction) const {
    return correction.fine ? fine_ : coarse_;
  }

  TrackerSteppings coarse_, fine_;
  Vec3i gravity_;
  std::int64_t most_c_;
  const TrackerGains& gains_;
  std::span<const std::int32_t> radii_;
};

/// Adds what the correction of a body by `steps` says about the gains. Call it before the body is corrected.
/// `c`: the body's.
void add_evidence(const TrackerBody& body, const TrackerSteps& steps, const Vec3i& c, GainEvidence& evidence);

// One step along an axis has the size `one` in lattice units; n steps have n * one. They change
//   p by n one,   v by n G(k) one (1 + u/2),   c by n H(k) one (1 + u/2),
// with v and c in 1/64 units, so that G = 64 beta / k and H = 64 beta gamma / k^2 (in 1/65536: TrackerGains).
// u in -1 .. 1 is the product with the previous correction in squares of the threshold. Two corrections in
// the same direction mean that the gain was too low, two in opposite directions that it was too high.
//
// Ranges: one <= 2^30 and G, H <= 64, so that one G (1 + u/2) fits 64 bits in 2^-24. The change by one step
// is limited to 2^29, so that n of them fit, n < 2^31.
inline void TrackerFilter::move(State& state, Slot slot, const TrackerCorrection& correction,
                                TrackerBody& body) const {
  const TrackerSteps& steps = correction.steps;
  const tracker_detail::Meaning meaning(steps, body);
  const std::int64_t one = steppings(correction).unit_for(steps);
  const std::int64_t v_of_one = meaning.growth(one, meaning.velocity(gains_));
  const std::int64_t c_of_one = meaning.growth(one, gains_.acceleration(meaning.k));
  for (std::size_t i = 0; i < 3; ++i) {
    // steps| < 2^31 and the change by one step is at most 2^30, so products fit. They need no limits of their
    // own, because the sum has a smaller one.
    const std::int64_t n = steps[i];
    std::int32_t& p = state.p(i)[slot];
    std::int32_t& v = state.v(i)[slot];
    std::int32_t& c = state.c(i)[slot];
    p = limited(p + n * one, kPositionLimit);
    v = limited(v + n * v_of_one, kVelocityLimit);
    c = limited(c + n * c_of_one, most_c_);
  }
  meaning.remember(body);
}

}  // namespace tandem
