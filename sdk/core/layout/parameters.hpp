#pragma once
// What a codec's decoder reads besides its bytes.

#include <cstdint>

#include "sdk/core/lattice/state.hpp"

namespace tandem {

/// What a decoder reads besides its bytes. May change between frames; a change travels in the delta itself.
struct CodecParameters {
  std::int32_t threshold = 0;      ///< lattice units; bodies further off than this are corrected. 1 .. 2^30
  std::int32_t position_step = 1;  ///< lattice units per quantisation step (range / 127). 1 .. 2^24
  std::int32_t velocity_step = 1;  ///< 1/64 unit per frame per quantisation step (range / 127). 1 .. 2^24
  // For codecs that steer a filter (`tracker`); nothing to the others. Any value is valid.
  std::uint16_t decay = 0;  ///< E of the predicted steps after this delta: share of c lost, in 1/65536
  std::uint16_t velocity_gain = 26214;     ///< beta, in 1/32768: share of a correction that is an error of v
  std::uint16_t acceleration_gain = 9830;  ///< gamma, in 1/65536: share of that that is an error of c
  friend bool operator==(const CodecParameters&, const CodecParameters&) = default;
};
/// 127 steps of this size span the lattice from end to end.
inline constexpr std::int32_t kMaxStep = 1 << 24;

/// True when all parameters are in their ranges.
[[nodiscard]] constexpr bool valid_parameters(const CodecParameters& parameters) {
  const auto in = [](std::int32_t value, std::int32_t most) { return value >= 1 && value <= most; };
  return in(parameters.threshold, kPositionLimit) && in(parameters.position_step, kMaxStep) &&
         in(parameters.velocity_step, kMaxStep);
}

}  // namespace tandem
