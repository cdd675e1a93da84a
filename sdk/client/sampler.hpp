#pragma once
// What to draw: the client state at any moment, without the jerks of frames and corrections.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "sdk/client/picture.hpp"
#include "sdk/client/rotation.hpp"
#include "tandem/client_types.hpp"

namespace tandem::client {

/// Remembers what it drew last, 15 bytes a slot or 31 with orientations, and so can tell what changed and
/// blend corrections in. Not thread-safe.
class Sampler {
 public:
  /// Time constant of the blend after a correction. Shorter shows jerks, longer shows bodies off their place.
  static constexpr double kBlendS = 0.1;

  void sample(const Picture& picture, std::int64_t now_ns, SampleMode mode, Sample& out);

 private:
  void begin(const Picture& picture);
  void report_changes(const Picture& picture, Sample& out);
  void interpolate(const Picture& picture, double share, Sample& out);
  void extrapolate(const Picture& picture, double share, double beyond, double blend, double frames,
                   Sample& out);
  void interpolate_turns(const Picture& picture, double share, Sample& out);
  void extrapolate_turns(const Picture& picture, double share, double beyond, double blend, double frames,
                         Sample& out);
  void show_turn(std::size_t slot, const Rotation& turn, Sample& out);

  std::size_t capacity_ = 0;
  Epoch epoch_ = 0;
  std::uint64_t load_ = 0;
  std::int64_t last_ns_ = 0;
  double last_frame_ = 0;
  // As in the last sample.
  std::vector<float> shown_;           // 3 a slot, lattice units
  std::vector<Rotation> shown_turns_;  // empty without orientations
  std::vector<std::uint8_t> shown_alive_, shown_generation_, shown_jumps_;
};

}  // namespace tandem::client
