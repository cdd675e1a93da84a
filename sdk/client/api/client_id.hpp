#pragma once
// Who a client is.

#include <cstdint>
#include <random>

#include "sdk/transport/messages.hpp"

namespace tandem::client {

/// 64 random bits of the operating system's, never 0: two clients that share an id are refused by the server.
[[nodiscard]] inline transport::ClientId random_client_id() {
  std::random_device device;
  transport::ClientId id = 0;
  while (id == 0) id = (transport::ClientId{device()} << 32U) | device();
  return id;
}

}  // namespace tandem::client
