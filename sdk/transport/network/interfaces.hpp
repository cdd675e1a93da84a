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
  std::string address;  ///< IPv4, dotted; without one, an IPv6 address of a network (or ::1); empty: none
  bool up = false, loopback = false, multicast = false;
  int mtu = 0;                       ///< bytes; 0: unknown
  std::vector<std::string> v6 = {};  ///< IPv6 addresses, without those of the link alone
};

[[nodiscard]] inline bool is_v6(const std::string& address) { return address.find(':') != std::string::npos; }

/// An address of this machine, with its device.
struct LocalAddress {
  std::string interface;
  int index = 0;        ///< the device's number, which one that is made anew does not get again
  std::string address;  ///< IPv4 or IPv6
  bool loopback = false;
  [[nodiscard]] bool operator==(const LocalAddress&) const = default;
  /// Others may reach it: neither loopback nor an address of its link alone (169.254.0.0/16, fe80::/10).
  [[nodiscard]] bool is_of_a_network() const;
};
/// The addresses of devices that are up.
[[nodiscard]] std::vector<LocalAddress> local_addresses();

/// True if no network here has an IPv4 address, and one has an IPv6 address.
[[nodiscard]] bool only_v6(const std::vector<Interface>& all);

/// One for each IPv4 address, and one for each interface without any; in the system's order.
[[nodiscard]] std::vector<Interface> interfaces();

/// The interface of the default route; empty if there is none.
[[nodiscard]] std::string default_route_interface();

/// The local address from which datagrams to an address leave; empty: there is no route.
[[nodiscard]] std::optional<std::string> source_address_to(const std::string& address);

/// Whether an IPv4 address (dotted) is one that routers on the Internet do not know.
[[nodiscard]] bool is_private(const std::string& address);

/// Whether another program of this machine has the UDP port. `shared`: those that share it do not count.
[[nodiscard]] bool udp_port_taken(std::uint32_t port, bool shared);

/// A UDP socket of this process.
struct OwnSocket {
  int descriptor = -1;
  std::string address = {};  ///< empty: "any"
  std::uint32_t port = 0;
  bool v6 = false;
  [[nodiscard]] bool operator==(const OwnSocket&) const = default;
};
[[nodiscard]] std::vector<OwnSocket> own_udp_sockets();

/// The IPv4 and IPv6 addresses to which the UDP sockets of this process are bound, each once, besides "any".
/// Cyclone DDS binds the socket that it sends from to the address of its interface.
[[nodiscard]] std::vector<std::string> own_udp_addresses();

/// Sends a datagram of one byte to that UDP port of this machine, over IPv4 and IPv6.
void send_byte_to_loopback(std::uint32_t port);

/// Whether an address, as own_udp_addresses() writes it, is of this machine alone.
[[nodiscard]] bool is_loopback(const std::string& address);

/// "eth0 10.0.0.1, lo 127.0.0.1".
[[nodiscard]] std::string list_of(const std::vector<Interface>& all);

}  // namespace tandem::transport
