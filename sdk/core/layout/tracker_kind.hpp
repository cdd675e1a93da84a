#pragma once
// How the codec `tracker` interprets the errors of a predicted step.

#include <cstdint>

namespace tandem {

/// Constants of the codec `tracker` that depend on the predictor whose errors it corrects.
///
/// A position error d that grew over k frames is explained by a velocity error d / k, or by an acceleration
/// error of about 2 d / k^2. Noise (rounding to steps, the error inside the ball) is as large as d itself. So
/// only a part beta of the velocity error counts, and a part gamma of that for the acceleration. Both change
/// at run time.
struct TrackerKind {
  /// Minimum k: with fewer frames a correction says too little about either, and k counts as this. Usually 3;
  /// 2 takes 0.5 % more bits, 4 takes 1.6 % (codec/tracker/RESEARCH.md).
  std::int64_t least_k = 3;
  /// A body that is corrected in two consecutive frames (k = 1) was hit. More of its correction counts as
  /// velocity, so this may be less than least_k.
  std::int64_t hit_k = 2;
  /// Minimum probability of a correction, in 1/65536, for which a body is corrected before it has to be.
  /// Usually 0.3: it lowers the RMS error by a tenth for 1.4 % of the bits. Encoder only; the rest is part of
  /// the protocol.
  std::uint32_t early = 19661;
};

}  // namespace tandem
