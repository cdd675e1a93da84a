#pragma once
// How the codec `tracker` reads the errors of a predicted step.

#include <cstdint>

namespace tandem {

/// Constants of the codec `tracker` that depend on the predictor whose errors it corrects.
///
/// A position error d that grew over k frames is explained by a velocity error d / k, or by an acceleration
/// error of about 2 d / k^2. Noise (rounding to steps, the error inside the ball) is as large as d itself, so
/// only a part beta of the first is believed, and gamma of that of the second; both change at run time.
struct TrackerKind {
  /// Below so many frames one correction says too little about either: k counts as this. Usual 3; 2 takes
  /// 0.5 % more bits, 4 takes 1.6 % (codec/tracker/RESEARCH.md).
  std::int64_t least_k = 3;
  /// A body corrected twice running (k = 1) was hit: more of it is believed to be velocity, so this may be
  /// less than least_k.
  std::int64_t hit_k = 2;
  /// How likely, in 1/65536, a correction must be for a body to go before it has to. Usual 0.3: a tenth off
  /// the RMS error for 1.4 % of the bits. Encoder only; the rest is part of the protocol.
  std::uint32_t early = 19661;
};

}  // namespace tandem
