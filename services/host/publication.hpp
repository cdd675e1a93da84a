#pragma once
// What leaves the host: the session, the parts of a delta.

#include <cstdint>

#include "sdk/transport/messages.hpp"
#include "services/host/frame_source.hpp"
#include "services/host/host.hpp"
#include "services/host/outbox.hpp"
#include "services/host/stream.hpp"

namespace tandem::host {

/// What a client must know of the session before it plays any of its streams, none of which is listed yet.
[[nodiscard]] transport::SessionMessage session_message(const HostConfig& config);

/// Lists a stream: what a client must know before it reads a byte of it. Measures a client's cost, which
/// takes as long as nine frames of a client.
void list_stream(const Stream& stream, transport::SessionMessage& session);

/// Queues the deltas of a frame, each cut into parts of kPartBytes. There must be room for a frame.
void push_frame(Outbox& outbox, Epoch epoch, const FrameSource::Made& frame, std::int64_t wall_ns);

}  // namespace tandem::host
