#pragma once
// The network interfaces of this machine, and which of them leads to an address.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace tandem::transport {

/// A network interface.
struct Interface {
  std::string name;
  std::string address;  ///< IPv4, dotted; empty: none
  bool up = false, loopback = false, multicast = false;
  int mtu = 0;  ///< bytes; 0: unknown
};

/// One for each IPv4 address, and one for each interface without any; in the system's order.
[[nodiscard]] std::vector<Interface> interfaces();

/// The interface of the default route; empty if there is none.
[[nodiscard]] std::string default_route_interface();

/// The local address from which datagrams to an IPv4 address (dotted) leave; empty: there is no route.
[[nodiscard]] std::optional<std::string> source_address_to(const std::string& address);

/// Whether an IPv4 address (dotted) is one that routers on the Internet do not know.
[[nodiscard]] bool is_private(const std::string& address);

/// Whether another program of this machine has the UDP port. `shared`: those that share it do not count.
[[nodiscard]] bool udp_port_taken(std::uint32_t port, bool shared);

/// The IPv4 and IPv6 addresses to which the UDP sockets of this process are bound, each once, besides "any".
/// Cyclone DDS binds the socket that it sends from to the address of its interface.
[[nodiscard]] std::vector<std::string> own_udp_addresses();

/// Whether an address, as own_udp_addresses() writes it, is of this machine alone.
[[nodiscard]] bool is_loopback(const std::string& address);

/// "eth0 10.0.0.1, lo 127.0.0.1".
[[nodiscard]] std::string list_of(const std::vector<Interface>& all);

}  // namespace tandem::transport
