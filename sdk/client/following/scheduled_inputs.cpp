#include "sdk/client/following/scheduled_inputs.hpp"

#include <limits>

namespace tandem::client {

Result<ScheduledDrive> read_scheduled(const transport::ScheduledInputMessage& message) {
  if (message.kind != static_cast<std::uint32_t>(transport::ScheduledKind::kDrive)) {
    return fail(ErrorCode::kUnsupported, "scheduled input of unknown kind " + std::to_string(message.kind));
  }
  const auto& v = message.values;
  constexpr std::int32_t kShareLimit = std::numeric_limits<std::uint16_t>::max();
  if (message.number == 0 || message.frame == 0 || v.size() != 4) {
    return fail(ErrorCode::kMalformed, "scheduled input without number, frame or its four integers");
  }
  for (std::size_t i = 0; i < 3; ++i) {
    if (v[i] < -kVelocityLimit || v[i] > kVelocityLimit) {
      return fail(ErrorCode::kMalformed, "scheduled gravity out of range");
    }
  }
  if (v[3] < 0 || v[3] > kShareLimit) {
    return fail(ErrorCode::kMalformed, "scheduled damping out of range");
  }
  ScheduledDrive input;
  input.number = message.number;
  input.frame = message.frame;
  input.drive.gravity = {v[0], v[1], v[2]};
  input.drive.damping = static_cast<std::uint16_t>(v[3]);
  return input;
}

Result<void> ScheduledInputs::hand_over(ClientTimeline& timeline, std::uint64_t last) const {
  for (auto it = held_.upper_bound(timeline.inputs_held()); it != held_.end() && it->first <= last; ++it) {
    if (auto scheduled = timeline.schedule(it->second); !scheduled) return scheduled;
  }
  return {};
}

}  // namespace tandem::client
