#include "sdk/wire/envelope.hpp"

#include <string>
#include <type_traits>
#include <utility>

namespace tandem::transport {
namespace {

constexpr MessageKind kind_of(const SessionMessage&) { return MessageKind::kSession; }
constexpr MessageKind kind_of(const DeltaMessage&) { return MessageKind::kDelta; }
constexpr MessageKind kind_of(const ScheduledInputMessage&) { return MessageKind::kScheduledInput; }
constexpr MessageKind kind_of(const SnapshotMessage&) { return MessageKind::kSnapshot; }
constexpr MessageKind kind_of(const ReplyMessage&) { return MessageKind::kReply; }
constexpr MessageKind kind_of(const ServerStatusMessage&) { return MessageKind::kServerStatus; }
constexpr MessageKind kind_of(const AbsentMessage&) { return MessageKind::kAbsent; }
constexpr MessageKind kind_of(const AckMessage&) { return MessageKind::kAck; }
constexpr MessageKind kind_of(const InputMessage&) { return MessageKind::kInput; }
constexpr MessageKind kind_of(const ClientStatusMessage&) { return MessageKind::kClientStatus; }

/// Reads the body of an envelope into one alternative of `Any`.
template <class M, class Any>
Result<Any> read_body(std::span<const std::byte> body, const Limits& limits) {
  auto message = read_cdr<M>(body);
  if (!message) return tl::unexpected<Error>(std::move(message.error()));
  if (!within_limits(*message, limits)) {
    return fail(ErrorCode::kMalformed, std::string(M::kTopic) + ": beyond a limit of size or shape");
  }
  return Any(std::move(*message));
}

}  // namespace

template <class M>
void write_envelope(const M& message, Bytes& out) {
  out.push_back(static_cast<std::byte>(kind_of(message)));
  if constexpr (!std::is_same_v<M, AbsentMessage>) write_cdr(message, out);
}

Result<GatewayMessage> read_gateway_envelope(std::span<const std::byte> bytes, const Limits& limits) {
  if (bytes.empty()) return fail(ErrorCode::kMalformed, "a message without a kind");
  const std::span<const std::byte> body = bytes.subspan(1);
  switch (static_cast<MessageKind>(bytes[0])) {
    case MessageKind::kSession:
      return read_body<SessionMessage, GatewayMessage>(body, limits);
    case MessageKind::kDelta:
      return read_body<DeltaMessage, GatewayMessage>(body, limits);
    case MessageKind::kScheduledInput:
      return read_body<ScheduledInputMessage, GatewayMessage>(body, limits);
    case MessageKind::kSnapshot:
      return read_body<SnapshotMessage, GatewayMessage>(body, limits);
    case MessageKind::kReply:
      return read_body<ReplyMessage, GatewayMessage>(body, limits);
    case MessageKind::kServerStatus:
      return read_body<ServerStatusMessage, GatewayMessage>(body, limits);
    case MessageKind::kAbsent:
      if (!body.empty()) return fail(ErrorCode::kMalformed, "absent: bytes left over");
      return GatewayMessage(AbsentMessage{});
    default:
      return GatewayMessage(UnknownMessage{std::to_integer<std::uint8_t>(bytes[0])});
  }
}

Result<ViewerMessage> read_viewer_envelope(std::span<const std::byte> bytes) {
  if (bytes.empty()) return fail(ErrorCode::kMalformed, "a message without a kind");
  const std::span<const std::byte> body = bytes.subspan(1);
  switch (static_cast<MessageKind>(bytes[0])) {
    case MessageKind::kAck:
      return read_body<AckMessage, ViewerMessage>(body, {});
    case MessageKind::kInput:
      return read_body<InputMessage, ViewerMessage>(body, {});
    case MessageKind::kClientStatus:
      return read_body<ClientStatusMessage, ViewerMessage>(body, {});
    default:
      return fail(
          ErrorCode::kUnsupported,
          "messages of kind " + std::to_string(std::to_integer<int>(bytes[0])) + " are not a viewer's");
  }
}

template void write_envelope(const SessionMessage&, Bytes&);
template void write_envelope(const DeltaMessage&, Bytes&);
template void write_envelope(const ScheduledInputMessage&, Bytes&);
template void write_envelope(const SnapshotMessage&, Bytes&);
template void write_envelope(const ReplyMessage&, Bytes&);
template void write_envelope(const ServerStatusMessage&, Bytes&);
template void write_envelope(const AbsentMessage&, Bytes&);
template void write_envelope(const AckMessage&, Bytes&);
template void write_envelope(const InputMessage&, Bytes&);
template void write_envelope(const ClientStatusMessage&, Bytes&);

}  // namespace tandem::transport
