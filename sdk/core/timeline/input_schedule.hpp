#pragma once
// Scheduled inputs by number, and the drive of a frame that follows from them. The same on both sides.

#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/timeline/timeline.hpp"

namespace tandem {

/// True if gravity is in the range of the predicted step.
[[nodiscard]] bool valid_drive(const Drive& drive);

/// Holds the inputs that have not acted yet, and the numbers that were received. Never allocates after
/// construction.
class InputSchedule {
 public:
  InputSchedule();

  /// Starts anew: all numbers up to `last` are held; `pending` has those that have not acted yet (ascending
  /// by number).
  void reset(std::uint64_t last, std::span<const ScheduledDrive> pending);

  /// Takes an input in any order. Returns true if it was new. `applied`: the last frame that cannot change
  /// any more. Errors: kMalformed (drive, number 0), kOutOfOrder (frame <= applied), kCapacity.
  [[nodiscard]] Result<bool> add(const ScheduledDrive& input, Frame applied);

  /// Every number up to this one is held.
  [[nodiscard]] std::uint64_t held_to() const { return held_to_; }
  /// The drive of the step that produces `frame`: that of the highest number acting on it, otherwise
  /// `before`.
  [[nodiscard]] Drive drive_for(Frame frame, const Drive& before) const;
  /// Drops inputs that acted on `applied` or earlier.
  void forget(Frame applied);
  /// The inputs that have not acted yet, ascending by number.
  [[nodiscard]] std::span<const ScheduledDrive> pending() const { return inputs_; }

 private:
  std::vector<ScheduledDrive> inputs_;
  std::uint64_t held_to_ = 0;
};

}  // namespace tandem
