#pragma once
// The request of one sample() and the columns in the caller's memory that it writes.

#include <cstddef>
#include <cstdint>

#include "sdk/core/lattice/state.hpp"
#include "tandem/client_types.hpp"

namespace tandem::client {

/// One value or one vector per slot; the numbers of a vector are adjacent. Any alignment.
template <class T>
struct Column {
  T* first = nullptr;      ///< of slot 0; null: not wanted
  std::size_t stride = 0;  ///< bytes from one slot's to the next's
};

/// A column with `numbers` numbers per slot and no gaps.
template <class T>
[[nodiscard]] Column<T> packed(T* first, std::size_t numbers = 1) {
  return {first, numbers * sizeof(T)};
}

/// Columns must not overlap. Each has room for `capacity` slots. Slots without a body get unspecified values,
/// except in `alive` and `changes`.
struct SampleColumns {
  std::size_t capacity = 0;
  Column<float> positions = {};           ///< x y z, scene units
  Column<float> velocities = {};          ///< x y z, scene units/s: how fast `positions` move, including
                                          ///< corrections
  Column<float> orientations = {};        ///< x y z w of norm 1; not written if the session has none
  Column<float> angular_velocities = {};  ///< x y z, rad/s, world's frame, without corrections; not written
                                          ///< without orientations
  Column<std::uint16_t> types = {};       ///< index into the session's types
  Column<std::uint8_t> alive = {};        ///< 0 or 1
  Column<std::uint8_t> reuse = {};        ///< counts the bodies that the slot has held, wraps
  Column<std::uint8_t> changes = {};      ///< a BodyChange, against the previous sample of this client
};

struct SampleRequest {
  SampleMode mode = SampleMode::kExtrapolate;
  /// The moment by this client's steady clock; 0: now. For a moment that is not held, the nearest is sampled.
  std::int64_t at_ns = 0;
  /// Time constant of the offset that blends in a correction, seconds, at most 10. Negative: the default. 0:
  /// corrections show as jumps.
  double smoothing_s = -1;
};

struct SampledFrame {
  Epoch epoch = 0;
  double frame = 0;            ///< the moment that is shown
  std::uint32_t capacity = 0;  ///< slots that were written
  std::uint32_t alive = 0;     ///< bodies among them
  bool has_orientations = false;
  double since_delta_s = 0;  ///< time from the last agreed frame, or from the snapshot, to now
};

/// Says how much can be drawn, so that a caller can make room first.
struct Drawable {
  Epoch epoch = 0;
  std::uint32_t capacity = 0;
  bool has_orientations = false;
};

}  // namespace tandem::client
