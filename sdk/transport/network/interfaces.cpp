#include "sdk/transport/network/interfaces.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <memory>
#include <sstream>
#include <system_error>

namespace tandem::transport {
namespace {

class Socket {
 public:
  explicit Socket(int family = AF_INET) : descriptor_(::socket(family, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {}
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  ~Socket() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  [[nodiscard]] int get() const { return descriptor_; }

 private:
  int descriptor_;
};

int mtu_of(const Socket& socket, const std::string& name) {
  ifreq request{};
  name.copy(request.ifr_name, sizeof request.ifr_name - 1);
  return ::ioctl(socket.get(), SIOCGIFMTU, &request) == 0 ? request.ifr_mtu : 0;
}

/// An address of IPv4 or IPv6, as the kernel takes it.
union Address {
  sockaddr any;
  sockaddr_in v4;
  sockaddr_in6 v6;

  [[nodiscard]] bool is_v6() const { return any.sa_family == AF_INET6; }
  [[nodiscard]] socklen_t size() const { return is_v6() ? sizeof v6 : sizeof v4; }
  [[nodiscard]] void* number() { return is_v6() ? static_cast<void*>(&v6.sin6_addr) : &v4.sin_addr; }
};

/// A copy of an interface's address from the kernel. Its family is AF_UNSPEC if there is no address, or one
/// that is neither IPv4 nor IPv6.
Address copied(const sockaddr* from) {
  Address address{};
  if (from == nullptr || (from->sa_family != AF_INET && from->sa_family != AF_INET6)) return address;
  address.any.sa_family = from->sa_family;
  std::memcpy(&address, from, address.size());
  return address;
}

/// Without the port; empty for an address of another family.
std::string text_of(Address address) {
  char text[INET6_ADDRSTRLEN] = {};
  return ::inet_ntop(address.any.sa_family, address.number(), text, sizeof text) != nullptr ? text : "";
}

std::optional<Address> address_at(const std::string& text, std::uint32_t port) {
  Address made{};
  made.any.sa_family = is_v6(text) ? AF_INET6 : AF_INET;
  (made.is_v6() ? made.v6.sin6_port : made.v4.sin_port) = htons(static_cast<std::uint16_t>(port));
  return ::inet_pton(made.any.sa_family, text.c_str(), made.number()) == 1 ? std::optional(made)
                                                                           : std::nullopt;
}

std::optional<OwnSocket> udp_socket(int descriptor) {
  int type = 0;
  socklen_t length = sizeof type;
  if (::getsockopt(descriptor, SOL_SOCKET, SO_TYPE, &type, &length) != 0 || type != SOCK_DGRAM) return {};
  Address bound{};
  length = sizeof bound;
  if (::getsockname(descriptor, &bound.any, &length) != 0 || text_of(bound).empty()) return {};
  const bool any = bound.is_v6() ? IN6_IS_ADDR_UNSPECIFIED(&bound.v6.sin6_addr)
                                 : bound.v4.sin_addr.s_addr == htonl(INADDR_ANY);
  return OwnSocket{.descriptor = descriptor,
                   .address = any ? "" : text_of(bound),
                   .port = ntohs(bound.is_v6() ? bound.v6.sin6_port : bound.v4.sin_port),
                   .v6 = bound.is_v6()};
}

}  // namespace

std::vector<Interface> interfaces() {
  std::vector<Interface> found, without;
  std::map<std::string, std::vector<std::string>> v6;
  ifaddrs* list = nullptr;
  if (::getifaddrs(&list) != 0) return found;
  const std::unique_ptr<ifaddrs, decltype(&::freeifaddrs)> owner(list, &::freeifaddrs);
  const Socket socket;
  for (const ifaddrs* entry = list; entry != nullptr; entry = entry->ifa_next) {
    Interface interface {
      entry->ifa_name, {}, (entry->ifa_flags & IFF_UP) != 0, (entry->ifa_flags & IFF_LOOPBACK) != 0,
          (entry->ifa_flags & IFF_MULTICAST) != 0, mtu_of(socket, entry->ifa_name)
    };
    const Address address = copied(entry->ifa_addr);
    if (address.any.sa_family == AF_INET) {
      interface.address = text_of(address);
      found.push_back(std::move(interface));
      continue;
    }
    if (address.is_v6() && !IN6_IS_ADDR_LINKLOCAL(&address.v6.sin6_addr))
      v6[interface.name].push_back(text_of(address));
    without.push_back(std::move(interface));
  }
  for (Interface& interface : without) {
    if (std::ranges::find(found, interface.name, &Interface::name) == found.end())
      found.push_back(std::move(interface));
  }
  for (Interface& interface : found) {
    interface.v6 = v6[interface.name];
    if (interface.address.empty() && !interface.v6.empty()) interface.address = interface.v6.front();
  }
  return found;
}

bool only_v6(const std::vector<Interface>& all) {
  const auto of_a_network = [](const Interface& each) {
    return each.up && !each.loopback && !each.address.empty();
  };
  const auto v4 = [&](const Interface& each) { return of_a_network(each) && !is_v6(each.address); };
  return std::ranges::any_of(all, of_a_network) && std::ranges::none_of(all, v4);
}

bool LocalAddress::is_of_a_network() const {
  return !loopback && !address.starts_with("169.254.") && !address.starts_with("fe80:");
}

std::vector<LocalAddress> local_addresses() {
  std::vector<LocalAddress> found;
  ifaddrs* list = nullptr;
  if (::getifaddrs(&list) != 0) return found;
  const std::unique_ptr<ifaddrs, decltype(&::freeifaddrs)> owner(list, &::freeifaddrs);
  for (const ifaddrs* entry = list; entry != nullptr; entry = entry->ifa_next) {
    std::string text = text_of(copied(entry->ifa_addr));
    if (text.empty() || (entry->ifa_flags & IFF_UP) == 0) continue;
    found.push_back({.interface = entry->ifa_name,
                     .index = static_cast<int>(::if_nametoindex(entry->ifa_name)),
                     .address = std::move(text),
                     .loopback = (entry->ifa_flags & IFF_LOOPBACK) != 0});
  }
  return found;
}

std::string default_route_interface() {
  std::ifstream routes("/proc/self/net/route");  // systemd may hide /proc/net
  std::string line, best;
  std::uint64_t least = std::numeric_limits<std::uint64_t>::max();
  std::getline(routes, line);  // the names of the columns
  while (std::getline(routes, line)) {
    std::istringstream fields(line);
    std::string name, destination, gateway, flags, uses, references, mask;
    std::uint64_t metric = 0;
    fields >> name >> destination >> gateway >> flags >> references >> uses >> metric >> mask;
    if (fields && destination == "00000000" && mask == "00000000" && metric < least) {
      least = metric;
      best = name;
    }
  }
  return best;
}

std::optional<std::string> source_address_to(const std::string& address) {
  const auto there = address_at(address, 9);  // nothing is sent
  if (!there) return std::nullopt;
  const Socket socket(there->any.sa_family);
  Address here{};
  socklen_t length = sizeof here;
  if (::connect(socket.get(), &there->any, there->size()) != 0 ||
      ::getsockname(socket.get(), &here.any, &length) != 0)
    return std::nullopt;
  return text_of(here);
}

bool is_private(const std::string& address) {
  in_addr found{};
  if (::inet_pton(AF_INET, address.c_str(), &found) != 1) return false;
  const std::uint32_t number = ntohl(found.s_addr);
  const auto within = [number](std::uint32_t network, unsigned bits) {
    return (number ^ network) >> (32U - bits) == 0;
  };
  return within(0x0A000000, 8) || within(0xAC100000, 12) || within(0xC0A80000, 16) ||
         within(0x64400000, 10) || within(0xA9FE0000, 16) || within(0x7F000000, 8);
}

bool udp_port_taken(std::uint32_t port, bool shared) {
  const Socket socket;
  const int yes = 1;
  if (shared) ::setsockopt(socket.get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  const auto local = address_at("0.0.0.0", port);
  return ::bind(socket.get(), &local->any, local->size()) != 0 && errno == EADDRINUSE;
}

std::vector<OwnSocket> own_udp_sockets() {
  std::vector<OwnSocket> sockets;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd", none)) {
    if (auto found = udp_socket(std::atoi(entry.path().filename().c_str())))
      sockets.push_back(std::move(*found));
  }
  return sockets;
}

std::vector<std::string> own_udp_addresses() {
  std::vector<std::string> addresses;
  for (OwnSocket& each : own_udp_sockets()) {
    if (!each.address.empty() && std::ranges::find(addresses, each.address) == addresses.end())
      addresses.push_back(std::move(each.address));
  }
  return addresses;
}

void send_byte_to_loopback(std::uint32_t port) {
  const char byte = 0;
  for (const char* const loopback : {"127.0.0.1", "::1"}) {
    const auto to = address_at(loopback, port);
    // A failure is ignored: the caller does not know either whether anybody receives the byte.
    static_cast<void>(
        ::sendto(Socket(to->any.sa_family).get(), &byte, sizeof byte, MSG_DONTWAIT, &to->any, to->size()));
  }
}

bool is_loopback(const std::string& address) { return address.starts_with("127.") || address == "::1"; }

std::string list_of(const std::vector<Interface>& all) {
  std::string list;
  for (const Interface& interface : all) {
    if (!list.empty()) list += ", ";
    list += interface.name;
    if (!interface.address.empty()) list += " " + interface.address;
  }
  return list.empty() ? "none" : list;
}

}  // namespace tandem::transport
