#pragma once
// An Address as the kernel takes it.

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include "services/program/metrics/address.hpp"

namespace tandem::metrics {

union SocketAddress {
  sockaddr any;
  sockaddr_in v4;
  sockaddr_in6 v6;
};

/// Returns the size of what it set.
inline socklen_t to_socket_address(const Address& address, SocketAddress& at) {
  at = {};
  if (address.host.find(':') == std::string::npos) {
    at.v4.sin_family = AF_INET;
    at.v4.sin_port = htons(address.port);
    inet_pton(AF_INET, address.host.c_str(), &at.v4.sin_addr);
    return sizeof(at.v4);
  }
  at.v6.sin6_family = AF_INET6;
  at.v6.sin6_port = htons(address.port);
  inet_pton(AF_INET6, address.host.c_str(), &at.v6.sin6_addr);
  return sizeof(at.v6);
}

}  // namespace tandem::metrics
