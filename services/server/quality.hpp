#pragma once
// Automatic quality: chooses what the decoder reads (threshold, quantisation ranges) at run time, so that
// nobody has to (paper, section 6, names it as future work). The choice travels in the deltas; clients need
// no configuration.

#include <cstddef>
#include <cstdint>

#include "sdk/core/codec/codec.hpp"
#include "sdk/core/codec/training.hpp"

namespace tandem::server {

/// What automatic quality may do.
struct QualityGoal {
  double target_mbit_per_s =
      0;  ///< of payload at the nominal rate; 0: the threshold stays, only ranges follow
  std::int32_t smallest_threshold = 1;  ///< lattice units; no finer than this, whatever there is room for
  std::int32_t largest_threshold = 1;   ///< the stated maximum error; no coarser, even above the target
};

/// True when the limits are in order and permit `parameters`.
[[nodiscard]] bool valid_goal(const QualityGoal& goal, const CodecParameters& parameters);

/// Looks at every frame and decides four times a second. Deterministic; no clock. Not thread-safe.
class QualityControl {
 public:
  QualityControl(const QualityGoal& goal, double frame_rate_hz);

  /// Where the timeline counts residuals: ServerTimeline::set_statistics().
  [[nodiscard]] CodecStatistics& statistics() { return statistics_; }
  /// After each frame; true when it changed threshold or steps. The goal must be valid for `parameters`,
  /// which are those of the next frame.
  bool after_frame(std::size_t payload_bytes, CodecParameters& parameters);

 private:
  [[nodiscard]] std::int32_t next_threshold(std::int32_t threshold) const;

  QualityGoal goal_;
  double frame_rate_hz_;
  std::uint32_t frames_per_decision_;
  std::uint32_t frames_ = 0;
  std::uint64_t bytes_ = 0;
  CodecStatistics statistics_;
};

}  // namespace tandem::server
