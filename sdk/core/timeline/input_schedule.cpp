#include "sdk/core/timeline/input_schedule.hpp"

#include <algorithm>
#include <string>

#include "sdk/core/lattice/assert.hpp"

namespace tandem {

bool valid_drive(const Drive& drive) {
  return std::all_of(drive.gravity.begin(), drive.gravity.end(),
                     [](std::int32_t g) { return -kVelocityLimit <= g && g <= kVelocityLimit; });
}

InputSchedule::InputSchedule() { inputs_.reserve(kMaxPendingInputs); }

void InputSchedule::reset(std::uint64_t last, std::span<const ScheduledDrive> pending) {
  TANDEM_ASSERT(pending.size() <= kMaxPendingInputs && (pending.empty() || pending.back().number <= last));
  TANDEM_ASSERT(
      std::is_sorted(pending.begin(), pending.end(),
                     [](const ScheduledDrive& a, const ScheduledDrive& b) { return a.number < b.number; }));
  held_to_ = last;
  inputs_.assign(pending.begin(), pending.end());
}

Result<bool> InputSchedule::add(const ScheduledDrive& input, Frame applied) {
  if (input.number == 0) return fail(ErrorCode::kMalformed, "scheduled inputs are numbered from 1");
  if (!valid_drive(input.drive))
    return fail(ErrorCode::kMalformed, "gravity of a scheduled input out of range");
  if (input.number <= held_to_) return false;
  const auto at =
      std::lower_bound(inputs_.begin(), inputs_.end(), input.number,
                       [](const ScheduledDrive& held, std::uint64_t n) { return held.number < n; });
  if (at != inputs_.end() && at->number == input.number) return false;
  if (input.frame <= applied) {
    return fail(ErrorCode::kOutOfOrder, "scheduled input " + std::to_string(input.number) +
                                            " acts on frame " + std::to_string(input.frame) +
                                            ", which is over");
  }
  if (inputs_.size() == kMaxPendingInputs)
    return fail(ErrorCode::kCapacity, "too many scheduled inputs pending");
  inputs_.insert(at, input);
  for (const ScheduledDrive& held : inputs_)
    held_to_ += static_cast<std::uint64_t>(held.number == held_to_ + 1);
  return true;
}

Drive InputSchedule::drive_for(Frame frame, const Drive& before) const {
  const auto last = std::find_if(inputs_.rbegin(), inputs_.rend(),
                                 [frame](const ScheduledDrive& input) { return input.frame == frame; });
  return last == inputs_.rend() ? before : last->drive;
}

void InputSchedule::forget(Frame applied) {
  // A number beyond a gap stays, so that the gap can close.
  std::erase_if(inputs_, [&](const ScheduledDrive& input) {
    return input.frame <= applied && input.number <= held_to_;
  });
}

}  // namespace tandem
