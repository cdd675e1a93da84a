#pragma once
// What one sample() is asked for, and where it puts it: columns in the caller's own memory.

#include <cstddef>
#include <cstdint>

#include "sdk/core/lattice/state.hpp"
#include "tandem/client_types.hpp"

namespace tandem::client {

/// One value a slot, or one vector: its numbers side by side. Any alignment will do.
template <class T>
struct Column {
  T* first = nullptr;      ///< of slot 0; null: not wanted
  std::size_t stride = 0;  ///< bytes from one slot's to the next's
};

/// `numbers` a slot, without gaps.
template <class T>
[[nodiscard]] Column<T> packed(T* first, std::size_t numbers = 1) {
  return {first, numbers * sizeof(T)};
}

/// Columns do not overlap, and hold `capacity` slots each. Slots that hold no body get unspecified values,
/// but for `alive` and `changes`.
struct SampleColumns {
  std::size_t capacity = 0;
  Column<float> positions = {};     ///< x y z, scene units
  Column<float> velocities = {};    ///< x y z, scene units/s: how fast `positions` move, correction included
  Column<float> orientations = {};  ///< x y z w of norm 1; left as they are where a session has none
  Column<float> angular_velocities = {};  ///< x y z, rad/s, world's frame; without corrections; likewise
  Column<std::uint16_t> types = {};       ///< index into the session's types
  Column<std::uint8_t> alive = {};        ///< 0 or 1
  Column<std::uint8_t> reuse = {};        ///< counts the bodies that the slot has held, wraps
  Column<std::uint8_t> changes = {};      ///< a BodyChange, against the previous sample of this client
};

struct SampleRequest {
  SampleMode mode = SampleMode::kExtrapolate;
  /// By this client's steady clock; 0: now. Of a moment that is not held the nearest is given.
  std::int64_t at_ns = 0;
  /// Time constant of the offset that takes up a correction, at most 10. Negative: the default. 0: none, so
  /// that corrections show as jumps.
  double smoothing_s = -1;
};

struct SampledFrame {
  Epoch epoch = 0;
  double frame = 0;            ///< the moment that is shown
  std::uint32_t capacity = 0;  ///< slots that were written
  std::uint32_t alive = 0;     ///< bodies among them
  bool has_orientations = false;
  double since_delta_s = 0;  ///< from the last frame that was agreed, or from the snapshot, to now
};

/// What there is to draw, for who has to make room first.
struct Drawable {
  Epoch epoch = 0;
  std::uint32_t capacity = 0;
  bool has_orientations = false;
};

}  // namespace tandem::client
