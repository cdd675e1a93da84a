#pragma once
// What to draw: the client state at any moment, without the jerks of frames and corrections.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/client/server_clock.hpp"
#include "sdk/core/timeline/timeline.hpp"
#include "tandem/client.hpp"

namespace tandem::client {

/// Reads a timeline, never changes it. Costs nothing until the first sample(); from then on 26 bytes a slot.
/// Not thread-safe.
class Sampler {
 public:
  /// Time constant of the blend after a correction. Shorter shows jerks, longer shows bodies off their place.
  static constexpr double kBlendS = 0.1;

  Sampler(std::uint32_t capacity, double lattice_unit) : capacity_(capacity), unit_(lattice_unit) {}

  /// A snapshot was loaded: nothing before it may be blended into what follows.
  void on_loaded();
  /// Around ClientTimeline::apply().
  void before_apply(const ClientTimeline& timeline);
  void after_apply(const ClientTimeline& timeline);

  void sample(const ClientTimeline& timeline, const Pacer& pacer, std::int64_t now_ns, SampleMode mode,
              Sample& out);

 private:
  void enable();
  void report_changes(const State& state, Sample& out);
  void interpolate(const State& state, double share, Sample& out);
  void extrapolate(const State& from, const State& to, double share, double beyond, double blend,
                   double frames, Sample& out);

  std::uint32_t capacity_;
  double unit_;
  bool enabled_ = false;
  bool has_previous_ = false;  // previous_ holds the agreed positions one frame before applied()
  bool all_jumped_ = true;
  std::int64_t last_ns_ = 0;
  double last_frame_ = 0;
  std::vector<std::int32_t> previous_;  // 3 a slot
  std::vector<float> shown_;            // 3 a slot, lattice units, as last drawn
  std::vector<std::uint8_t> shown_generation_;
  std::vector<std::uint8_t> marks_;
  std::vector<Slot> broken_;  // slots that spawned or teleported in the last delta
};

}  // namespace tandem::client
