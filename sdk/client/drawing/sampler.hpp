#pragma once
// Computes what to draw: the client state at any moment, without the jerks of frames and corrections.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "sdk/client/drawing/motion.hpp"
#include "sdk/client/drawing/picture.hpp"
#include "sdk/client/drawing/rotation.hpp"
#include "sdk/client/drawing/sample_columns.hpp"
#include "sdk/client/drawing/sampled_moment.hpp"
#include "sdk/core/lattice/run_blocks.hpp"
#include "tandem/result.hpp"

namespace tandem::client {

/// Remembers what it drew last, 27 bytes per slot or 43 with orientations. So it can report changes and blend
/// corrections in. Not thread-safe.
class Sampler {
 public:
  /// Time constant of the blend after a correction. A shorter one shows jerks, a longer one shows bodies away
  /// from their places for longer.
  static constexpr double kSmoothingS = 0.05;

  /// Errors: kCapacity (the columns hold fewer slots than the picture).
  /// `run`: spreads blocks of slots over threads; changes no bit.
  Result<SampledFrame> sample(const Picture& picture, const SampleRequest& request,
                              const SampleColumns& columns, std::int64_t now_ns, const RunBlocks& run = {});

 private:
  struct Run;

  void begin(const Picture& picture);
  [[nodiscard]] bool tell_changes(const Picture& picture, Run& run);
  static void fill_extra(const SampledMoment& moment, Run& run);
  void show_places(const SampledMoment& moment, const Smoothing& smoothing, const SampleColumns& columns,
                   const Picture& picture, Run& run);
  void show_turns(const SampledMoment& moment, float blend, const SampleColumns& columns,
                  const Picture& picture, const Run& run);

  std::size_t capacity_ = 0;
  Epoch epoch_ = 0;  ///< 0: none
  std::uint64_t load_ = 0;
  std::int64_t last_ns_ = 0, last_at_ns_ = 0;  ///< when the last sample was taken, and the moment that it
                                               ///< showed
  double last_frame_ = 0;
  struct Shown {
    double frame = 0;
    std::int64_t at_ns = 0;  ///< the latest moment that was asked for since the application went back
  };
  std::array<Shown, 2> shown_{};  ///< what each SampleMode showed last in this epoch
  // As in the last sample.
  std::array<std::vector<float>, kPositionChannels> place_;  // lattice units
  std::array<std::vector<float>, kPositionChannels> speed_;  // lattice units per frame
  std::vector<Rotation> turns_;                              // empty without orientations
  std::vector<std::uint8_t> alive_, reuse_, jumps_;
};

}  // namespace tandem::client
