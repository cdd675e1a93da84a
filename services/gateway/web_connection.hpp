#pragma once
// What the server of connections keeps for each, in the one pointer of ours that libwebsockets holds.

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "services/gateway/entrance/addresses.hpp"
#include "services/gateway/gateway.hpp"
#include "services/gateway/refusal.hpp"

namespace tandem::gateway {

/// One WebSocket connection.
struct Connection {
  ViewerId id = 0;
  std::optional<Refusal> refused;
  std::string why;                 // in the place of closing()'s reason; empty: that
  std::vector<std::byte> message;  // the received part of the current message
  AccountPtr account;
};

/// A response that is being sent.
struct Exchange {
  std::string own;        // the body, if it was made for this response
  std::string_view body;  // the rest of the body
  bool last = false;      // the connection ends behind it
};

// libwebsockets keeps plain memory for a connection, which holds one pointer to our object.
template <class T>
T*& slot(void* user) {
  return *static_cast<T**>(user);
}

template <class T>
void drop(void* user) {
  if (user != nullptr) delete std::exchange(slot<T>(user), nullptr);
}

}  // namespace tandem::gateway
