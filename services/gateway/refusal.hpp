#pragma once
// The reasons to end a viewer's connection: idl/PROTOCOL.md, "WebSocket".

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace tandem::gateway {

enum class Refusal : std::uint8_t {
  kToken,
  kOrigin,
  kFull,
  kMalformed,
  kProtocolVersion,
  kForeignClient,
  kTooManyMessages,
  kNotReading,
  kTooLarge,
  kSilent,
  kAddressJoins,
  kAddressBytes,
  kTokenExpired,
  kTokenEarly,
  kTokenRole,
  kTokenSession,
  kCap,
};

struct Closing {
  std::uint16_t code = 0;   ///< of the WebSocket close frame
  std::string_view reason;  ///< in it, for a human
  std::string_view label;   ///< of its count in metrics
};

inline constexpr std::array<Closing, 17> kClosings{{
    {4001, "token missing or wrong", "token"},
    {4002, "origin not allowed", "origin"},
    {4003, "too many viewers", "full"},
    {4004, "malformed message", "malformed"},
    {4005, "another protocol version", "protocol_version"},
    {4006, "another client's id", "foreign_client"},
    {4007, "too many messages", "too_many_messages"},
    {4008, "nothing was read for too long", "not_reading"},
    {1009, "message too large", "too_large"},
    {4009, "nothing was acknowledged for too long", "silent"},
    {4010, "too many connections or joins from this address", "address_connections"},
    {4011, "too many bytes from this address", "address_bytes"},
    {4001, "token expired", "token_expired"},
    {4001, "token not valid yet: is a clock wrong?", "token_early"},
    {4001, "token of a role that does not exist", "token_role"},
    {4001, "token of another session", "token_session"},
    {4012, "the session takes more than the viewer's cap", "cap"},
}};

[[nodiscard]] constexpr const Closing& closing(Refusal refusal) {
  return kClosings[static_cast<std::size_t>(refusal)];
}

}  // namespace tandem::gateway
