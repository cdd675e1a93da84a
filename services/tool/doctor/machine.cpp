// Looks at the machine: sockets, /proc, and a short stay on the DDS domain.

#include <arpa/inet.h>
#include <net/if.h>
#include <netdb.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/timex.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fstream>
#include <memory>
#include <string_view>

#include "sdk/transport/network/reach.hpp"
#include "services/program/system/descriptor.hpp"
#include "services/tool/doctor/configuration.hpp"
#include "services/tool/doctor/doctor.hpp"

namespace tandem::doctor {
namespace {

using transport::Interface;
using transport::Side;

// The default groups of RTPS discovery.
constexpr const char* kDiscoveryGroup = "239.255.0.1";
constexpr const char* kDiscoveryGroupV6 = "ff02::ffff:239.255.0.1";
constexpr auto kPatience = std::chrono::milliseconds(1500);
// A client of the profile wan repeats its first datagram after a second.
constexpr auto kPatienceOverWan = std::chrono::milliseconds(3500);

template <class T>
bool set_option(const system::Descriptor& socket, int level, int option, const T& value) {
  return ::setsockopt(socket.get(), level, option, &value, sizeof value) == 0;
}

// The sockets API wants its own address types seen as sockaddr.
template <class T>
sockaddr* as_sockaddr(T* address) {
  return static_cast<sockaddr*>(static_cast<void*>(address));
}

system::Descriptor udp_socket(int family) {
  return system::Descriptor(::socket(family, SOCK_DGRAM | SOCK_CLOEXEC, 0));
}

constexpr char kProbe[] = "tandem doctor";

/// Sends the probe to `group`, and waits until it comes back.
template <class Address>
bool comes_back(const system::Descriptor& socket, Address group) {
  if (::sendto(socket.get(), kProbe, sizeof kProbe, 0, as_sockaddr(&group), sizeof group) != sizeof kProbe)
    return false;
  pollfd waiting{socket.get(), POLLIN, 0};
  if (::poll(&waiting, 1, 200) != 1) return false;
  char received[sizeof kProbe] = {};
  return ::recv(socket.get(), received, sizeof received, MSG_DONTWAIT) == sizeof kProbe &&
         std::memcmp(received, kProbe, sizeof kProbe) == 0;
}

bool multicast_comes_back_v6(const Interface& interface) {
  const system::Descriptor socket = udp_socket(AF_INET6);
  sockaddr_in6 local{};
  local.sin6_family = AF_INET6;
  socklen_t length = sizeof local;
  ipv6_mreq membership{};
  membership.ipv6mr_interface = ::if_nametoindex(interface.name.c_str());
  const int loop = 1, stay_on_host = 0, index = static_cast<int>(membership.ipv6mr_interface);
  if (!socket.is_open() || ::bind(socket.get(), as_sockaddr(&local), sizeof local) != 0 ||
      ::getsockname(socket.get(), as_sockaddr(&local), &length) != 0 ||
      ::inet_pton(AF_INET6, kDiscoveryGroupV6, &membership.ipv6mr_multiaddr) != 1 ||
      !set_option(socket, IPPROTO_IPV6, IPV6_JOIN_GROUP, membership) ||
      !set_option(socket, IPPROTO_IPV6, IPV6_MULTICAST_IF, index) ||
      !set_option(socket, IPPROTO_IPV6, IPV6_MULTICAST_LOOP, loop) ||
      !set_option(socket, IPPROTO_IPV6, IPV6_MULTICAST_HOPS, stay_on_host)) {
    return false;
  }
  local.sin6_addr = membership.ipv6mr_multiaddr;
  return comes_back(socket, local);
}

/// Whether a datagram sent to the group on this interface comes back to a member of the group.
bool multicast_comes_back(const Interface& interface) {
  if (transport::is_v6(interface.address)) return multicast_comes_back_v6(interface);
  const system::Descriptor socket = udp_socket(AF_INET);
  if (!socket.is_open()) return false;
  sockaddr_in local{};
  local.sin_family = AF_INET;
  local.sin_addr.s_addr = htonl(INADDR_ANY);
  if (::bind(socket.get(), as_sockaddr(&local), sizeof local) != 0) return false;
  socklen_t length = sizeof local;
  if (::getsockname(socket.get(), as_sockaddr(&local), &length) != 0) return false;
  in_addr address{};
  ip_mreq membership{};
  if (::inet_pton(AF_INET, interface.address.c_str(), &address) != 1 ||
      ::inet_pton(AF_INET, kDiscoveryGroup, &membership.imr_multiaddr) != 1) {
    return false;
  }
  membership.imr_interface = address;
  const unsigned char loop = 1;
  const unsigned char stay_on_host = 0;
  if (!set_option(socket, IPPROTO_IP, IP_ADD_MEMBERSHIP, membership) ||
      !set_option(socket, IPPROTO_IP, IP_MULTICAST_IF, address) ||
      !set_option(socket, IPPROTO_IP, IP_MULTICAST_LOOP, loop) ||
      !set_option(socket, IPPROTO_IP, IP_MULTICAST_TTL, stay_on_host)) {
    return false;
  }
  sockaddr_in group = local;
  group.sin_addr = membership.imr_multiaddr;
  return comes_back(socket, group);
}

std::int64_t number_in(const char* path) {
  std::ifstream file(path);
  std::int64_t value = -1;
  return file >> value ? value : -1;
}

/// An RTPS message of that size which says nothing: a header and padding.
std::vector<std::uint8_t> empty_message(std::size_t size) {
  constexpr std::array<std::uint8_t, 8> kStart{'R', 'T', 'P', 'S', 2, 1, 1, 16};
  constexpr std::size_t kHeader = 20, kPadHeader = 4;
  constexpr std::uint8_t kPad = 1, kLittleEndian = 1;
  std::vector<std::uint8_t> message(size & ~std::size_t{3});
  std::ranges::copy(kStart, message.begin());
  const std::size_t padding = message.size() - kHeader - kPadHeader;
  message[kHeader] = kPad;
  message[kHeader + 1] = kLittleEndian;
  message[kHeader + 2] = static_cast<std::uint8_t>(padding & 0xFFU);
  message[kHeader + 3] = static_cast<std::uint8_t>(padding >> 8U);
  return message;
}

/// A socket to "ADDRESS:PORT" whose packets no router may fragment.
system::Descriptor connected_to(const std::string& address, const std::string& port) {
  addrinfo wanted{};
  wanted.ai_flags = AI_NUMERICHOST | AI_NUMERICSERV;
  wanted.ai_socktype = SOCK_DGRAM;
  addrinfo* found = nullptr;
  if (::getaddrinfo(address.c_str(), port.c_str(), &wanted, &found) != 0) return {};
  const std::unique_ptr<addrinfo, void (*)(addrinfo*)> there(found, &::freeaddrinfo);
  system::Descriptor socket = udp_socket(there->ai_family);
  const bool whole = there->ai_family == AF_INET6
                         ? set_option(socket, IPPROTO_IPV6, IPV6_MTU_DISCOVER, int{IPV6_PMTUDISC_DO})
                         : set_option(socket, IPPROTO_IP, IP_MTU_DISCOVER, int{IP_PMTUDISC_DO});
  if (!whole || ::connect(socket.get(), there->ai_addr, there->ai_addrlen) != 0) return {};
  return socket;
}

/// Sends packets that routers must not fragment, each as large as is known to fit, and so learns what fits.
Path look_along(const std::string& server, const std::vector<Interface>& interfaces) {
  Path path;
  path.server = server;
  const std::string address = transport::address_of(server);
  const bool v6 = transport::is_v6(address);
  path.source = transport::source_address_to(address).value_or("");
  const auto own = std::ranges::find_if(interfaces, [&path](const Interface& each) {
    return each.address == path.source || std::ranges::find(each.v6, path.source) != each.v6.end();
  });
  if (own != interfaces.end()) path.mtu = own->mtu;
  const system::Descriptor socket = connected_to(address, server.substr(server.rfind(':') + 1));
  if (!socket.is_open()) return path;
  for (int attempt = 0; attempt < 4; ++attempt) {
    int mtu = 0;
    socklen_t length = sizeof mtu;
    if (::getsockopt(socket.get(), v6 ? IPPROTO_IPV6 : IPPROTO_IP, v6 ? IPV6_MTU : IP_MTU, &mtu, &length) ==
            0 &&
        mtu > 0)
      path.mtu = mtu;
    const std::size_t size =
        static_cast<std::size_t>(std::clamp(path.mtu, 128, 65'000)) - (v6 ? kHeaderBytesV6 : kHeaderBytes);
    const std::vector<std::uint8_t> message = empty_message(size);
    if (::send(socket.get(), message.data(), message.size(), 0) < 0) path.refused |= errno == ECONNREFUSED;
    pollfd waiting{socket.get(), POLLIN, 0};
    if (::poll(&waiting, 1, 150) == 1) {
      char nothing = 0;
      path.refused |= ::recv(socket.get(), &nothing, 1, MSG_DONTWAIT) < 0 && errno == ECONNREFUSED;
    }
  }
  return path;
}

/// What a profile's file says of MaxMessageSize, which is always in bytes.
std::uint32_t max_message_in(std::string_view xml, std::uint32_t otherwise) {
  constexpr std::string_view kElement = "<MaxMessageSize>";
  const std::size_t at = xml.find(kElement);
  if (at == std::string_view::npos) return otherwise;
  return static_cast<std::uint32_t>(
      std::strtoul(std::string(xml.substr(at + kElement.size(), 12)).c_str(), nullptr, 10));
}

void look_at_profile(MachineFacts& facts, const std::string& text) {
  if (text.empty()) return;
  auto parsed = transport::parse_profile(text, Side::kServer);
  if (!parsed) return;
  facts.side = parsed->name == "wan" && parsed->servers.empty() ? Side::kServer : Side::kClient;
  transport::Surroundings machine = transport::surroundings();
  machine.port_taken = [](std::uint32_t /*port*/) { return false; };  // look_at_ports() says that
  auto resolved = transport::resolve_profile(*parsed, facts.side, facts.domain, machine);
  if (!resolved) {
    facts.domain_fault = resolved.error().message;
    return;
  }
  facts.max_message_bytes =
      max_message_in(transport::profile_xml(*resolved, facts.side), facts.max_message_bytes);
  for (const std::string& server : resolved->servers)
    facts.paths.push_back(look_along(server, facts.interfaces));
  facts.profile = std::move(*resolved);
}

void look_at_ports(MachineFacts& facts) {
  std::ifstream range("/proc/sys/net/ipv4/ip_local_port_range");
  range >> facts.first_ephemeral_port >> facts.last_ephemeral_port;
  const bool wan = facts.profile && facts.profile->name == "wan";
  const std::uint32_t port = !wan ? transport::server_port(facts.domain, 0) - 10
                             : facts.side == Side::kServer
                                 ? transport::server_port(facts.domain, facts.profile->index)
                                 : 0;
  if (port != 0 && transport::udp_port_taken(port, !wan)) facts.port_in_use = port;
}

void look_at_identity(MachineFacts& facts, const std::string& secure) {
  facts.secure = secure;
  if (secure.empty()) return;
  auto identity = transport::secure::check_identity_folder(secure, facts.clock_s);
  if (identity) {
    facts.identity = std::move(*identity);
  } else {
    facts.identity_fault = identity.error().message;
  }
}

void look_at_domain(MachineFacts& facts, const std::string& profile) {
  if (!facts.domain_fault.empty()) return;
  const std::size_t wanted = facts.profile ? facts.profile->servers.size() : 0;
  const transport::DdsOptions options{
      .domain = facts.domain, .profile = profile, .secure = facts.identity ? facts.secure : std::string()};
  auto heard = transport::listen_for_participants(
      options, facts.side, wanted > 0 ? kPatienceOverWan : kPatience,
      [wanted](const auto& all) { return wanted > 0 && all.size() > wanted; });
  if (!heard) {
    facts.domain_fault = heard.error().message;
    return;
  }
  facts.participants = std::move(*heard);
}

}  // namespace

MachineFacts machine_facts(std::uint32_t domain, const std::string& profile, const std::string& secure) {
  MachineFacts facts;
  facts.domain = domain;
  facts.profile_text = profile;
  facts.reach = transport::reach_of_dds(profile, "");
  facts.interfaces = transport::interfaces();
  for (const Interface& interface : facts.interfaces) {
    if (interface.up && !interface.address.empty() && multicast_comes_back(interface))
      facts.multicast_works.push_back(interface.name);
  }
  facts.receive_buffer_max_bytes = number_in("/proc/sys/net/core/rmem_max");
  facts.send_buffer_max_bytes = number_in("/proc/sys/net/core/wmem_max");
  rlimit files{};
  if (::getrlimit(RLIMIT_NOFILE, &files) == 0) facts.open_files_limit = files.rlim_cur;
  if (const char* uri = std::getenv("CYCLONEDDS_URI"); uri != nullptr && *uri != '\0') {
    facts.cyclonedds_uri = uri;
    const std::string text = transport::configuration_text(uri);
    facts.reach = transport::reach_of_dds(profile, text);
    facts.xml_fault = fault_of_xml(text);
    facts.uri_names_interface = text.find("NetworkInterface") != std::string::npos;
  }
  timex clock{};
  facts.clock_synchronised = ::adjtimex(&clock) != TIME_ERROR && (clock.status & STA_UNSYNC) == 0;
  facts.clock_s = std::time(nullptr);
  look_at_profile(facts, profile);
  look_at_identity(facts, secure);
  look_at_ports(facts);
  look_at_domain(facts, profile);
  return facts;
}

}  // namespace tandem::doctor
