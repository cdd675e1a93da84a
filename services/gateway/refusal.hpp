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
};

struct Closing {
  std::uint16_t code = 0;   ///< of the WebSocket close frame
  std::string_view reason;  ///< in it, for a human
};

inline constexpr std::array<Closing, 12> kClosings{{
    {4001, "token missing or wrong"},
    {4002, "origin not allowed"},
    {4003, "too many viewers"},
    {4004, "malformed message"},
    {4005, "another protocol version"},
    {4006, "another client's id"},
    {4007, "too many messages"},
    {4008, "nothing was read for too long"},
    {1009, "message too large"},
    {4009, "nothing was acknowledged for too long"},
    {4010, "too many connections or joins from this address"},
    {4011, "too many bytes from this address"},
}};

[[nodiscard]] constexpr const Closing& closing(Refusal refusal) {
  return kClosings[static_cast<std::size_t>(refusal)];
}

}  // namespace tandem::gateway
