#pragma once
// The address of a gateway.

#include <cstdint>
#include <string>
#include <string_view>

#include "tandem/result.hpp"

namespace tandem::transport {

/// Where a gateway is, from a URL as people write it.
struct WebAddress {
  bool encrypted = false;  ///< TLS: wss or https
  std::string host;        ///< name or address, an IPv6 one without its brackets
  std::uint16_t port = 0;  ///< 80 or 443 unless the URL has one
  std::string path;        ///< of the WebSocket: the URL's with "tandem" behind it
  std::string token;       ///< what stood behind '#'; empty: none

  /// For lines that people read; without the token.
  [[nodiscard]] std::string text() const;
};

/// Reads "wss://HOST[:PORT]/[PATH/]", also with ws, https or http: the address of the viewer's page, with its
/// token behind '#', as well as that of the WebSocket. Errors: kInvalidArgument, with what is wrong and
/// without the token.
[[nodiscard]] Result<WebAddress> read_web_address(std::string_view url);

}  // namespace tandem::transport
