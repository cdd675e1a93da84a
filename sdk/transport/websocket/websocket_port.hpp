#pragma once
// A client's port onto a gateway over the Internet: without DDS, through NAT and proxies.

#include <memory>
#include <string>

#include "sdk/wire/port.hpp"
#include "tandem/result.hpp"

namespace tandem::transport {

struct WebSocketOptions {
  std::string url;     ///< see read_web_address()
  std::string token;   ///< for a gateway that asks for one; empty: what stands behind '#' in the URL
  std::string tls_ca;  ///< file of certificates (PEM) that a gateway's is checked by; empty: the system's
};

/// Returns at once; the connection is made, and made again, in the background, by a thread of the port. A
/// proxy of the environment variable http_proxy is used. Errors: kInvalidArgument (URL, token), kIo (tls_ca),
/// kTransport.
[[nodiscard]] Result<std::unique_ptr<ClientPort>> make_websocket_client_port(const WebSocketOptions& options);

}  // namespace tandem::transport
