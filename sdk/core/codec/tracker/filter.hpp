#pragma once
// The tracker codec's filter: what a correction of a body's position does to its p, v and c. Both sides run
// it, so it is integers to the last bit; idl/PROTOCOL.md, "Tracker", has the same formulas.

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

/// Position correction of a body in steps along each axis. Not all zero.
using TrackerSteps = std::array<std::int32_t, 3>;
inline constexpr std::int32_t kMostTrackerSteps = INT32_MAX;

/// What a delta says of a corrected body.
struct TrackerCorrection {
  TrackerSteps steps{};  ///< of its position; all zero: that is not corrected
  TrackerSteps turn{};   ///< of its orientation, likewise; one of the two is
  bool fine = false;     ///< both are, by smaller steps
  bool rest = false;     ///< it stays where it then is: State::rest()
};
[[nodiscard]] inline bool is_some(const TrackerSteps& steps) { return (steps[0] | steps[1] | steps[2]) != 0; }

/// Frames since a body's last correction count up to this.
inline constexpr std::uint32_t kMostAge = 255;

/// What the codec remembers of a body's position besides p, v and c, or of its orientation besides q and w.
/// All zero for a new body and for a dead slot. TrackerMemory keeps bytes; here they are words, because
/// compilers pack a struct of five bytes into one register, byte by byte, which takes as long as the filter
/// itself.
struct TrackerBody {
  std::uint32_t age = 0;       ///< frames since its last correction, 0 .. kMostAge - 1
  std::uint32_t interval = 0;  ///< k of the last correction, 0: none yet
  TrackerSteps steps{};        ///< of the last correction, saturated at +-127
};

/// How much of a correction is believed to be an error of the velocity and of the acceleration, by
/// k = min(age + 1, 255): 64 beta / k and 64 beta gamma / k^2, in 1/65536.
class TrackerGains {
 public:
  explicit TrackerGains(const TrackerKind& kind);
  /// beta in 1/32768, gamma in 1/65536: as in CodecParameters.
  void set(std::uint16_t beta, std::uint16_t gamma);

  [[nodiscard]] std::int64_t velocity(std::uint32_t k) const { return velocity_[k]; }
  [[nodiscard]] std::int64_t acceleration(std::uint32_t k) const { return acceleration_[k]; }
  /// Encoder only: how likely, in 1/65536, a correction must be for a body to be corrected before it has to
  /// be.
  [[nodiscard]] std::uint32_t early() const;

 private:
  TrackerKind kind_;
  std::uint16_t beta_ = 0, gamma_ = 0;
  std::array<std::int64_t, kMostAge + 1> velocity_{};
  std::array<std::int64_t, kMostAge + 1> acceleration_{};
};

/// Steps to lattice units for one threshold e.
class TrackerSteppings {
 public:
  /// No correction is longer than this along an axis.
  static constexpr std::int64_t kMostDistance = std::int64_t{1} << 31;

  /// What steps are worth beside their share of the threshold, in 1/65536. Where position and orientation may
  /// both be off they are smaller, so that more of the error ball is left to the other; RESEARCH.md, "Turns".
  static constexpr std::int64_t kAlone = 65536, kJoint = 48497, kFine = 27525;

  /// Steps are worth multiples of 2^position_bits, so that rounded positions stay round; at most 2^24.
  explicit TrackerSteppings(std::int32_t threshold, unsigned position_bits = 0, std::int64_t size = kAlone) {
    const auto share = [threshold, position_bits, size](std::int64_t of_65536) {
      const std::int64_t whole = ((threshold * ((of_65536 * size) >> 16)) >> 16) >> position_bits
                                                                                        << position_bits;
      return static_cast<std::int32_t>(std::max(std::int64_t{1} << position_bits, whole));
    };
    for (std::size_t i = 0; i < kUnits.size(); ++i) units_[i] = share(kUnits[i]);
  }

  /// Lattice units that one of these steps is worth.
  [[nodiscard]] std::int32_t unit_for(const TrackerSteps& steps) const { return units_[unit_of(steps)]; }
  /// What one step is worth: where an axis moves by more than one (0), or where all |steps| <= 1 and so many
  /// (1 .. 3) of them are not zero.
  [[nodiscard]] std::int32_t unit(std::size_t moved) const { return units_[moved]; }

  /// The angle (2^-28 rad) by which a point at this radius (lattice units) moves by one step.
  [[nodiscard]] std::int32_t angle(std::size_t moved, std::int32_t radius) const {
    return static_cast<std::int32_t>(
        std::clamp<std::int64_t>((std::int64_t{units_[moved]} << 28) / radius, 1, kSpinLimit));
  }
  [[nodiscard]] std::int32_t angle_for(const TrackerSteps& steps, std::int32_t radius) const {
    return angle(unit_of(steps), radius);
  }

  /// The same in 1/256 of the threshold; steps within +-127.
  [[nodiscard]] static std::array<std::int32_t, 3> relative(const TrackerSteps& steps) {
    const std::int32_t one = kUnits[unit_of(steps)] >> 8;
    return {steps[0] * one, steps[1] * one, steps[2] * one};
  }

 private:
  // In 1/65536 of the threshold. A step of 0.95 keeps the worst rounding error, sqrt(3)/2 steps, inside the
  // error ball. Where all |steps| <= 1 and 1, 2 or 3 of them are not zero, corrections are a little longer
  // than the threshold, so their points lie at 0.92, 0.69 * sqrt(2), 0.59 * sqrt(3) of it.
  static constexpr std::array<std::int32_t, 4> kUnits{62259, 60293, 45220, 38666};

  // Index of the unit; without branches, which would be hard to guess. No steps at all are of any unit.
  static std::size_t unit_of(const TrackerSteps& steps) {
    std::size_t moved = 0;
    std::size_t is_small = 1;
    for (const std::int32_t s : steps) {
      moved += static_cast<std::size_t>(s != 0);
      is_small &= static_cast<std::size_t>(s >= -1) & static_cast<std::size_t>(s <= 1);
    }
    return moved * is_small;
  }

  std::array<std::int32_t, 4> units_{1, 1, 1, 1};
};

namespace tracker_detail {

// Of v and c by one step, in 1/64 units; twice the largest velocity there is.
inline constexpr std::int64_t kMostGrowth = std::int64_t{1} << 29;

inline std::int64_t dot(const Vec3i& a, const Vec3i& b) {
  std::int64_t sum = 0;
  for (std::size_t i = 0; i < 3; ++i) sum += std::int64_t{a[i]} * b[i];
  return sum;
}

// What a correction means for the velocity and the acceleration behind it, and for what is remembered.
struct Meaning {
  Meaning(const TrackerSteps& steps, const TrackerBody& body) : k(std::min(body.age + 1U, kMostAge)) {
    for (std::size_t i = 0; i < 3; ++i) now[i] = std::clamp(steps[i], -127, 127);
    const std::int64_t product = dot(TrackerSteppings::relative(body.steps), TrackerSteppings::relative(now));
    // Corrections that keep pointing the same way are believed more, in 1/256: 128 .. 384.
    belief = 256 + (std::clamp<std::int64_t>(product >> 8, -256, 256) >> 1);
  }
  /// Of v, c or w, by one step that is worth `one`, in 1/64 of its unit.
  [[nodiscard]] std::int64_t growth(std::int64_t one, std::int64_t gain) const {
    return std::min((share_of(one, gain) * belief + 128) >> 8, kMostGrowth);
  }
  void remember(TrackerBody& body) const { body = {0, k, now}; }

  std::uint32_t k;
  std::int64_t belief = 0;
  TrackerSteps now{};
};

}  // namespace tracker_detail

/// Corrects bodies in one delta. With k = min(age + 1, 255), u = clamp(d . d_last / e^2, -1, 1):
///   position:     d = steps * unit;   p += d;  v += G(k) d (1 + u/2);  c += H(k) d (1 + u/2)
///   orientation:  d = steps * angle;  q turned by d;  w += G(k) d (1 + u/2)
/// of a body that is put to rest then v = w = 0 and c = -gravity.
class TrackerFilter {
 public:
  /// `radii` of the stream, with orientations; they and `gains` outlive it.
  TrackerFilter(const CodecParameters& parameters, const Vec3i& gravity, unsigned position_bits,
                const TrackerGains& gains, std::span<const std::int32_t> radii = {});

  /// Corrects the position by `correction.steps` and updates what is remembered of it.
  void move(State& state, Slot slot, const TrackerCorrection& correction, TrackerBody& body) const;
  /// Likewise the orientation, by `correction.turn`.
  void turn(State& state, Slot slot, const TrackerCorrection& correction, TrackerBody& body) const;
  /// Last: wakes the body, or puts it to rest.
  void settle(State& state, Slot slot, bool rest) const;

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

/// What the correction of a body by `steps` says of the gains; before it is corrected. `c`: the body's.
void add_evidence(const TrackerBody& body, const TrackerSteps& steps, const Vec3i& c, GainEvidence& evidence);

// One step along an axis is worth `one` lattice units, n of them n * one. It changes
//   p by n one,   v by n G(k) one (1 + u/2),   c by n H(k) one (1 + u/2),
// with v and c in 1/64 units, so that G = 64 beta / k and H = 64 beta gamma / k^2 (in 1/65536: TrackerGains).
// u in -1 .. 1 is the product with the last correction in squares of the threshold: two in the same direction
// mean that too little was believed, two in opposite ones that too much was.
//
// Ranges: one <= 2^30 and G, H <= 64, so that one G (1 + u/2) fits 64 bits in 2^-24; what one step may change
// is cut at 2^29, so that n of them fit, n < 2^31.
inline void TrackerFilter::move(State& state, Slot slot, const TrackerCorrection& correction,
                                TrackerBody& body) const {
  const TrackerSteps& steps = correction.steps;
  const tracker_detail::Meaning meaning(steps, body);
  const std::int64_t one = steppings(correction).unit_for(steps);
  const std::int64_t v_of_one = meaning.growth(one, gains_.velocity(meaning.k));
  const std::int64_t c_of_one = meaning.growth(one, gains_.acceleration(meaning.k));
  for (std::size_t i = 0; i < 3; ++i) {
    // |steps| < 2^31 and what one of them is worth is at most 2^30, so products fit; they need no limits of
    // their own where the sum has a smaller one.
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
