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
#include <cstdint>
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

std::string dotted(const sockaddr_in& address) {
  char text[INET_ADDRSTRLEN] = {};
  return ::inet_ntop(AF_INET, &address.sin_addr, text, sizeof text) != nullptr ? text : "";
}

std::string written(const sockaddr_in6& address) {
  char text[INET6_ADDRSTRLEN] = {};
  return ::inet_ntop(AF_INET6, &address.sin6_addr, text, sizeof text) != nullptr ? text : "";
}

std::optional<OwnSocket> udp_socket(int descriptor) {
  int type = 0;
  socklen_t length = sizeof type;
  if (::getsockopt(descriptor, SOL_SOCKET, SO_TYPE, &type, &length) != 0 || type != SOCK_DGRAM) return {};
  sockaddr_storage bound{};
  length = sizeof bound;
  if (::getsockname(descriptor, static_cast<sockaddr*>(static_cast<void*>(&bound)), &length) != 0) return {};
  OwnSocket found{.descriptor = descriptor, .v6 = bound.ss_family == AF_INET6};
  if (bound.ss_family == AF_INET) {
    sockaddr_in v4{};
    std::memcpy(&v4, &bound, sizeof v4);
    found.port = ntohs(v4.sin_port);
    if (v4.sin_addr.s_addr != htonl(INADDR_ANY)) found.address = dotted(v4);
    return found;
  }
  if (bound.ss_family != AF_INET6) return {};
  sockaddr_in6 v6{};
  std::memcpy(&v6, &bound, sizeof v6);
  found.port = ntohs(v6.sin6_port);
  if (!IN6_IS_ADDR_UNSPECIFIED(&v6.sin6_addr)) found.address = written(v6);
  return found;
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
    if (entry->ifa_addr != nullptr && entry->ifa_addr->sa_family == AF_INET) {
      sockaddr_in address{};
      std::memcpy(&address, entry->ifa_addr, sizeof address);
      interface.address = dotted(address);
      found.push_back(std::move(interface));
      continue;
    }
    if (entry->ifa_addr != nullptr && entry->ifa_addr->sa_family == AF_INET6) {
      sockaddr_in6 address{};
      std::memcpy(&address, entry->ifa_addr, sizeof address);
      if (!IN6_IS_ADDR_LINKLOCAL(&address.sin6_addr)) v6[interface.name].push_back(written(address));
    }
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
    if (entry->ifa_addr == nullptr || (entry->ifa_flags & IFF_UP) == 0) continue;
    LocalAddress one{.interface = entry->ifa_name,
                     .index = static_cast<int>(::if_nametoindex(entry->ifa_name)),
                     .address = {},
                     .loopback = (entry->ifa_flags & IFF_LOOPBACK) != 0};
    if (entry->ifa_addr->sa_family == AF_INET) {
      sockaddr_in v4{};
      std::memcpy(&v4, entry->ifa_addr, sizeof v4);
      one.address = dotted(v4);
    } else if (entry->ifa_addr->sa_family == AF_INET6) {
      sockaddr_in6 v6{};
      std::memcpy(&v6, entry->ifa_addr, sizeof v6);
      one.address = written(v6);
    } else {
      continue;
    }
    found.push_back(std::move(one));
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

namespace {

template <class T>
sockaddr* as_sockaddr(T* address) {  // the sockets API wants its own address types seen as that
  return static_cast<sockaddr*>(static_cast<void*>(address));
}

std::optional<std::string> source_to_v6(const std::string& address) {
  const Socket socket(AF_INET6);
  sockaddr_in6 there{}, here{};
  there.sin6_family = AF_INET6;
  there.sin6_port = htons(9);  // nothing is sent
  socklen_t length = sizeof here;
  if (::inet_pton(AF_INET6, address.c_str(), &there.sin6_addr) != 1 ||
      ::connect(socket.get(), as_sockaddr(&there), sizeof there) != 0 ||
      ::getsockname(socket.get(), as_sockaddr(&here), &length) != 0)
    return std::nullopt;
  return written(here);
}

}  // namespace

std::optional<std::string> source_address_to(const std::string& address) {
  if (is_v6(address)) return source_to_v6(address);
  const Socket socket;
  sockaddr_in there{}, here{};
  there.sin_family = AF_INET;
  there.sin_port = htons(9);  // nothing is sent
  socklen_t length = sizeof here;
  if (::inet_pton(AF_INET, address.c_str(), &there.sin_addr) != 1 ||
      ::connect(socket.get(), as_sockaddr(&there), sizeof there) != 0 ||
      ::getsockname(socket.get(), as_sockaddr(&here), &length) != 0)
    return std::nullopt;
  return dotted(here);
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
  sockaddr_in local{};
  local.sin_family = AF_INET;
  local.sin_port = htons(static_cast<std::uint16_t>(port));
  return ::bind(socket.get(), static_cast<sockaddr*>(static_cast<void*>(&local)), sizeof local) != 0 &&
         errno == EADDRINUSE;
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
  sockaddr_in v4{};
  v4.sin_family = AF_INET;
  v4.sin_port = htons(static_cast<std::uint16_t>(port));
  v4.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  sockaddr_in6 v6{};
  v6.sin6_family = AF_INET6;
  v6.sin6_port = v4.sin_port;
  v6.sin6_addr = in6addr_loopback;
  // What cannot be sent is no worse than what is not heard.
  static_cast<void>(::sendto(Socket(AF_INET).get(), &byte, sizeof byte, MSG_DONTWAIT,
                             static_cast<sockaddr*>(static_cast<void*>(&v4)), sizeof v4));
  static_cast<void>(::sendto(Socket(AF_INET6).get(), &byte, sizeof byte, MSG_DONTWAIT,
                             static_cast<sockaddr*>(static_cast<void*>(&v6)), sizeof v6));
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
