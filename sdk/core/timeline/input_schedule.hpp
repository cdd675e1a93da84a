#pragma once
// Scheduled inputs by number, and the drive they make of a frame. The same on both sides.

#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/timeline/timeline.hpp"

namespace tandem {

/// True when gravity is in the range that the predicted step can take.
[[nodiscard]] bool valid_drive(const Drive& drive);

/// Inputs still to act, and which numbers are held. Never allocates after construction.
class InputSchedule {
 public:
  InputSchedule();

  /// Starts over: all numbers up to `last` are held, `pending` of them still have to act (ascending by
  /// number).
  void reset(std::uint64_t last, std::span<const ScheduledDrive> pending);

  /// Takes an input in any order; true if it was new. `applied`: the last frame that can change no more.
  /// Errors: kMalformed (drive, number 0), kOutOfOrder (frame <= applied), kCapacity.
  [[nodiscard]] Result<bool> add(const ScheduledDrive& input, Frame applied);

  /// Every number up to here is held.
  [[nodiscard]] std::uint64_t held_to() const { return held_to_; }
  /// The drive of the step that produces `frame`: of the highest number acting on it, else `before`.
  [[nodiscard]] Drive drive_for(Frame frame, const Drive& before) const;
  /// Drops what acted on `applied` or earlier.
  void forget(Frame applied);
  /// Ascending by number.
  [[nodiscard]] std::span<const ScheduledDrive> pending() const { return inputs_; }

 private:
  std::vector<ScheduledDrive> inputs_;
  std::uint64_t held_to_ = 0;
};

}  // namespace tandem
