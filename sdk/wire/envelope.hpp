#pragma once
// Messages between a gateway and its viewers: one byte for the kind, then the message's CDR bytes.
// idl/PROTOCOL.md, "WebSocket".

#include <cstddef>
#include <cstdint>
#include <span>
#include <variant>

#include "sdk/wire/cdr.hpp"
#include "sdk/wire/limits.hpp"
#include "sdk/wire/messages.hpp"
#include "tandem/result.hpp"

namespace tandem::transport {

/// The values of an envelope's first byte. Kinds below 16 come from the gateway, the others from a viewer.
enum class MessageKind : std::uint8_t {
  kSession = 1,
  kDelta = 2,
  kScheduledInput = 3,
  kSnapshot = 4,
  kReply = 5,
  kServerStatus = 6,
  kAbsent = 7,
  kAck = 16,
  kInput = 17,
  kClientStatus = 18,
};

/// The session's server is gone: its last announcement is void. No body.
struct AbsentMessage {
  bool operator==(const AbsentMessage&) const = default;
};

/// A message of a kind that this build does not know: a reader goes on with the next message.
struct UnknownMessage {
  std::uint8_t kind = 0;
  bool operator==(const UnknownMessage&) const = default;
};

using GatewayMessage = std::variant<SessionMessage, DeltaMessage, ScheduledInputMessage, SnapshotMessage,
                                    ReplyMessage, ServerStatusMessage, AbsentMessage, UnknownMessage>;
using ViewerMessage = std::variant<AckMessage, InputMessage, ClientStatusMessage>;

/// Appends kind and message to `out`.
template <class M>
void write_envelope(const M& message, Bytes& out);

/// Reads a message of a gateway. The bytes are untrusted: allocates at most a small multiple of their size,
/// and refuses messages that break a size or shape (within_limits()). Errors: kMalformed, kUnsupported
/// (another encapsulation).
[[nodiscard]] Result<GatewayMessage> read_gateway_envelope(std::span<const std::byte> bytes,
                                                           const Limits& limits = {});
/// Reads a message of a viewer in the same way. Errors: also kUnsupported for an unknown kind.
[[nodiscard]] Result<ViewerMessage> read_viewer_envelope(std::span<const std::byte> bytes);

extern template void write_envelope(const SessionMessage&, Bytes&);
extern template void write_envelope(const DeltaMessage&, Bytes&);
extern template void write_envelope(const ScheduledInputMessage&, Bytes&);
extern template void write_envelope(const SnapshotMessage&, Bytes&);
extern template void write_envelope(const ReplyMessage&, Bytes&);
extern template void write_envelope(const ServerStatusMessage&, Bytes&);
extern template void write_envelope(const AbsentMessage&, Bytes&);
extern template void write_envelope(const AckMessage&, Bytes&);
extern template void write_envelope(const InputMessage&, Bytes&);
extern template void write_envelope(const ClientStatusMessage&, Bytes&);

}  // namespace tandem::transport
