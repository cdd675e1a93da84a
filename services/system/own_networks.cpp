#include "services/system/own_networks.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <system_error>

namespace tandem::system {
namespace {

/// Empty for other sockets, for loopback and for "any".
std::string network_of(int socket) {
  int type = 0;
  socklen_t size = sizeof type;
  if (::getsockopt(socket, SOL_SOCKET, SO_TYPE, &type, &size) != 0 || type != SOCK_DGRAM) return {};
  sockaddr_storage bound{};
  size = sizeof bound;
  if (::getsockname(socket, static_cast<sockaddr*>(static_cast<void*>(&bound)), &size) != 0) return {};
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (bound.ss_family == AF_INET) {
    sockaddr_in v4{};
    std::memcpy(&v4, &bound, sizeof v4);
    const auto address = ntohl(v4.sin_addr.s_addr);
    if (address == INADDR_ANY || address >> 24U == IN_LOOPBACKNET) return {};
    return ::inet_ntop(AF_INET, &v4.sin_addr, text.data(), text.size()) != nullptr ? text.data() : "";
  }
  if (bound.ss_family == AF_INET6) {
    sockaddr_in6 v6{};
    std::memcpy(&v6, &bound, sizeof v6);
    if (IN6_IS_ADDR_UNSPECIFIED(&v6.sin6_addr) || IN6_IS_ADDR_LOOPBACK(&v6.sin6_addr)) return {};
    return ::inet_ntop(AF_INET6, &v6.sin6_addr, text.data(), text.size()) != nullptr ? text.data() : "";
  }
  return {};
}

}  // namespace

std::vector<std::string> networks_in_use() {
  std::vector<std::string> found;
  std::error_code error;
  for (std::filesystem::directory_iterator entry("/proc/self/fd", error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    int socket = -1;
    std::from_chars(name.data(), name.data() + name.size(), socket);
    std::string network = network_of(socket);
    if (!network.empty() && std::ranges::find(found, network) == found.end())
      found.push_back(std::move(network));
  }
  return found;
}

}  // namespace tandem::system
