#pragma once
// The id of a client.

#include <cstdint>
#include <random>

#include "sdk/wire/messages.hpp"

namespace tandem::transport {

/// 64 random bits from the operating system, never 0. The server refuses two clients that share an id.
[[nodiscard]] inline ClientId random_client_id() {
  std::random_device device;
  ClientId id = 0;
  while (id == 0) id = (ClientId{device()} << 32U) | device();
  return id;
}

}  // namespace tandem::transport
