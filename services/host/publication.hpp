#pragma once
// What leaves the host: the session, the parts of a delta.

#include <cstdint>

#include "sdk/transport/messages.hpp"
#include "services/host/frame_source.hpp"
#include "services/host/host.hpp"
#include "services/host/outbox.hpp"
#include "services/host/stream.hpp"

namespace tandem::host {

/// What a client must know before it reads a byte of `stream`. Measures a client's cost, which takes as long
/// as nine frames of a client.
[[nodiscard]] transport::SessionMessage session_message(const HostConfig& config, const Stream& stream);

/// Queues a delta, cut into parts of kPartBytes. There must be room for a frame.
void push_delta(Outbox& outbox, Epoch epoch, const FrameSource::Made& frame, std::int64_t wall_ns);

}  // namespace tandem::host
