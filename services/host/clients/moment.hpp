#pragma once
// The figures of a moment, for a monitor.

#include <span>

#include "services/host/clients/roster.hpp"
#include "services/host/frames/frame_source.hpp"
#include "services/host/outgoing/outbox.hpp"
#include "services/host/outgoing/report.hpp"

namespace tandem::host {

/// Looks at the clients, the queue and the bodies. Counting bodies is O(n); errors are compared over a
/// bounded number of them: position_error().
[[nodiscard]] HostMoment host_moment(const Roster& roster, const FrameSource& source,
                                     std::span<const SentFrames> sent, const Outbox& outbox);

}  // namespace tandem::host
