#pragma once
// The networks that this process sends to.

#include <string>
#include <vector>

namespace tandem::system {

/// Addresses that datagram sockets of this process are bound to, without loopback and without "any", each
/// once. Cyclone DDS binds the socket that it sends from to the address of its interface, and does not tell
/// it otherwise.
[[nodiscard]] std::vector<std::string> networks_in_use();

}  // namespace tandem::system
