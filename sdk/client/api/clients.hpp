#pragma once
// The clients of this process.

#include "sdk/client/api/boundary.hpp"
#include "sdk/client/api/registry.hpp"
#include "sdk/client/api/running_client.hpp"

namespace tandem::api {

/// The registry of clients. It is never destroyed, so that a static object can still close its client.
[[nodiscard]] Registry<RunningClient>& clients();

/// Runs the body of a function of tandem.h: `body(client)` returns a tandem_result.
template <class Body>
tandem_result with_client(tandem_client handle, Body&& body) noexcept {
  return call([&] {
    const auto client = clients().find(handle);
    if (!client) return refuse(TANDEM_INVALID_HANDLE, "no such client, or it was closed");
    return body(*client);
  });
}

}  // namespace tandem::api
