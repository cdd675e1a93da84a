#pragma once
// The session as clients are told of it.

#include "sdk/transport/messages.hpp"
#include "services/host/frames/configuration.hpp"
#include "services/host/streams/stream.hpp"

namespace tandem::host {

/// What a client must know of the session before it plays any of its streams, none of which is listed yet.
[[nodiscard]] transport::SessionMessage session_message(const HostConfig& config);

/// Lists a stream: what a client must know before it reads a byte of it. Measures a client's cost, which
/// takes as long as nine frames of a client.
void list_stream(const Stream& stream, transport::SessionMessage& session);

}  // namespace tandem::host
