#pragma once
// The session as it is announced to clients.

#include "sdk/wire/messages.hpp"
#include "services/host/frames/configuration.hpp"
#include "services/host/streams/stream.hpp"

namespace tandem::host {

/// Everything that a client must know about the session before it plays any stream. The message lists no
/// stream yet, and neither gravity nor names, which the simulation knows.
[[nodiscard]] transport::SessionMessage session_message(const HostConfig& config);

/// Adds a stream to the message, as an offer that encodes: what a client must know before it reads a byte of
/// it. Measures a client's cost, which takes as long as nine frames of a client.
void list_stream(const Stream& stream, transport::SessionMessage& session);
/// Adds another offer of a stream that the message lists: `carries` is its id.
void list_offer(std::uint32_t carries, std::uint32_t delay_ms, transport::SessionMessage& session);

}  // namespace tandem::host
