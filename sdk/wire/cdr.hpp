#pragma once
// The byte form of messages: XCDR version 1 (plain CDR) of the types in idl/tandem.idl, little-endian, after
// an encapsulation header. DDS and captures use this form.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "sdk/wire/messages.hpp"
#include "sdk/wire/standby_messages.hpp"
#include "tandem/result.hpp"

namespace tandem::transport {

/// The header before a message: 00 01 for little-endian CDR, then two bytes of options.
inline constexpr std::size_t kCdrHeaderBytes = 4;

/// Appends header and message to `out`. Texts end at their first NUL.
template <class M>
void write_cdr(const M& message, Bytes& out);

/// Whether bytes that fill up the last word may follow a message if the options do not announce them.
enum class Padding : std::uint8_t { kAnnounced, kAny };

/// Reads one message from untrusted bytes. The message must fill the bytes, except for padding. Allocates at
/// most a small multiple of their size. Does not check values: see within_limits(). Errors: kUnsupported
/// (another encapsulation), kMalformed.
template <class M>
[[nodiscard]] Result<M> read_cdr(std::span<const std::byte> bytes, Padding padding = Padding::kAnnounced);

/// The protocol version of a TandemSession of any version: its epoch and its version stay first. Empty if the
/// bytes are too short or of another encapsulation.
[[nodiscard]] std::optional<std::uint32_t> session_version(std::span<const std::byte> bytes);

extern template void write_cdr(const SessionMessage&, Bytes&);
extern template void write_cdr(const DeltaMessage&, Bytes&);
extern template void write_cdr(const ScheduledInputMessage&, Bytes&);
extern template void write_cdr(const SnapshotMessage&, Bytes&);
extern template void write_cdr(const ReplyMessage&, Bytes&);
extern template void write_cdr(const InputMessage&, Bytes&);
extern template void write_cdr(const AckMessage&, Bytes&);
extern template void write_cdr(const ServerStatusMessage&, Bytes&);
extern template void write_cdr(const ClientStatusMessage&, Bytes&);
extern template void write_cdr(const JournalMessage&, Bytes&);
extern template void write_cdr(const CheckpointMessage&, Bytes&);
extern template void write_cdr(const StandbyMessage&, Bytes&);
extern template void write_cdr(const CommandMessage&, Bytes&);
extern template Result<SessionMessage> read_cdr(std::span<const std::byte>, Padding);
extern template Result<DeltaMessage> read_cdr(std::span<const std::byte>, Padding);
extern template Result<ScheduledInputMessage> read_cdr(std::span<const std::byte>, Padding);
extern template Result<SnapshotMessage> read_cdr(std::span<const std::byte>, Padding);
extern template Result<ReplyMessage> read_cdr(std::span<const std::byte>, Padding);
extern template Result<InputMessage> read_cdr(std::span<const std::byte>, Padding);
extern template Result<AckMessage> read_cdr(std::span<const std::byte>, Padding);
extern template Result<ServerStatusMessage> read_cdr(std::span<const std::byte>, Padding);
extern template Result<ClientStatusMessage> read_cdr(std::span<const std::byte>, Padding);
extern template Result<JournalMessage> read_cdr(std::span<const std::byte>, Padding);
extern template Result<CheckpointMessage> read_cdr(std::span<const std::byte>, Padding);
extern template Result<StandbyMessage> read_cdr(std::span<const std::byte>, Padding);
extern template Result<CommandMessage> read_cdr(std::span<const std::byte>, Padding);

}  // namespace tandem::transport
