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
#include <memory>
#include <sstream>
#include <system_error>

namespace tandem::transport {
namespace {

class Socket {
 public:
  Socket() : descriptor_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {}
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

/// What a UDP socket is bound to; empty for "any" and for other descriptors.
std::string udp_address_of(int descriptor) {
  int type = 0;
  socklen_t length = sizeof type;
  if (::getsockopt(descriptor, SOL_SOCKET, SO_TYPE, &type, &length) != 0 || type != SOCK_DGRAM) return {};
  sockaddr_storage bound{};
  length = sizeof bound;
  if (::getsockname(descriptor, static_cast<sockaddr*>(static_cast<void*>(&bound)), &length) != 0) return {};
  if (bound.ss_family == AF_INET) {
    sockaddr_in v4{};
    std::memcpy(&v4, &bound, sizeof v4);
    return v4.sin_addr.s_addr == htonl(INADDR_ANY) ? std::string() : dotted(v4);
  }
  sockaddr_in6 v6{};
  std::memcpy(&v6, &bound, sizeof v6);
  if (bound.ss_family != AF_INET6 || IN6_IS_ADDR_UNSPECIFIED(&v6.sin6_addr)) return {};
  char text[INET6_ADDRSTRLEN] = {};
  return ::inet_ntop(AF_INET6, &v6.sin6_addr, text, sizeof text) != nullptr ? text : "";
}

}  // namespace

std::vector<Interface> interfaces() {
  std::vector<Interface> found, without;
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
    } else {
      without.push_back(std::move(interface));
    }
  }
  for (Interface& interface : without) {
    if (std::ranges::find(found, interface.name, &Interface::name) == found.end())
      found.push_back(std::move(interface));
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
  const Socket socket;
  sockaddr_in there{};
  there.sin_family = AF_INET;
  there.sin_port = htons(9);  // nothing is sent
  if (::inet_pton(AF_INET, address.c_str(), &there.sin_addr) != 1) return std::nullopt;
  // The sockets API wants its own address types seen as sockaddr.
  if (::connect(socket.get(), static_cast<sockaddr*>(static_cast<void*>(&there)), sizeof there) != 0)
    return std::nullopt;
  sockaddr_in here{};
  socklen_t length = sizeof here;
  if (::getsockname(socket.get(), static_cast<sockaddr*>(static_cast<void*>(&here)), &length) != 0)
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

std::vector<std::string> own_udp_addresses() {
  std::vector<std::string> addresses;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd", none)) {
    std::string address = udp_address_of(std::atoi(entry.path().filename().c_str()));
    if (!address.empty() && std::ranges::find(addresses, address) == addresses.end())
      addresses.push_back(std::move(address));
  }
  return addresses;
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
