#pragma once
// Bodies of a server's frame out of the frames of an IMD engine. Pure.

#include <array>
#include <cstdint>
#include <vector>

#include "services/adapters/imd/source.hpp"
#include "services/adapters/imd/topology.hpp"

namespace tandem::imd {

struct View {
  double scale = 1;           ///< scene units of a unit of the engine
  double frame_s = 1.0 / 30;  ///< what a server's frame lasts
};

/// Bodies as a server wants them, with a column for each axis.
struct Columns {
  std::array<std::vector<float>, 3> position, velocity;
  std::vector<std::uint8_t> alive;  ///< another number: the body did not get there by moving
};

/// Velocities are the engine's own if it sends them with the time (version 3), else differences of frames
/// close together. Both are per frame of the server, so that clients see motion of the pace at which frames
/// come. Not thread-safe.
class Motion {
 public:
  Motion(const Topology& topology, const View& view);
  /// A newer frame than that of the last call.
  void show(const Newest& newest);
  /// Nothing came: everybody stands still where it is.
  void hold();
  [[nodiscard]] const Columns& columns() const { return columns_; }
  /// Atoms within a ball in the scene, in their order.
  [[nodiscard]] std::vector<std::int32_t> within(const std::array<double, 3>& centre, double radius) const;

 private:
  View view_;
  std::array<double, 3> box_{};  ///< of the engine; 0: unknown
  Columns columns_;
  std::uint64_t shown_ = 0;
  double shown_time_ = 0;
  double frames_a_show_ = 0;  // of the engine, smoothed
  double time_a_show_ = 0;
};

}  // namespace tandem::imd
