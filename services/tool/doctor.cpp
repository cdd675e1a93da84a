#include "services/tool/doctor.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/socket.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <memory>

#include "sdk/transport/clock.hpp"
#include "sdk/transport/dds/dds_ports.hpp"
#include "sdk/transport/secure/openssl.hpp"
#include "sdk/transport/units.hpp"
#include "services/json/json.hpp"
#include "services/system/descriptor.hpp"
#include "services/system/own_networks.hpp"
#include "services/tool/commands.hpp"
#include "services/tool/endpoint_options.hpp"

namespace tandem::tool {
namespace {

// A burst of one 240 KB delta, its protocol overhead and as much again while the reader is busy.
constexpr std::int64_t kWantedBufferBytes = 1 << 20;
constexpr std::uint64_t kWantedOpenFiles = 256;
constexpr const char* kDiscoveryGroup = "239.255.0.1";  // the default group of RTPS discovery
constexpr const char* kLoopbackUri =
    R"(<CycloneDDS><Domain id="any"><General><Interfaces><NetworkInterface name="lo" multicast="true"/>)"
    R"(</Interfaces></General></Domain></CycloneDDS>)";

template <class T>
bool set_option(const system::Descriptor& socket, int level, int option, const T& value) {
  return ::setsockopt(socket.get(), level, option, &value, sizeof value) == 0;
}

// The sockets API wants its own address types seen as sockaddr.
template <class T>
sockaddr* as_sockaddr(T* address) {
  return static_cast<sockaddr*>(static_cast<void*>(address));
}

/// Whether a datagram sent to the group on this interface comes back to a member of the group.
bool multicast_comes_back(const Interface& interface) {
  const system::Descriptor socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
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
  const char probe[] = "tandem doctor";
  if (::sendto(socket.get(), probe, sizeof probe, 0, as_sockaddr(&group), sizeof group) != sizeof probe)
    return false;
  pollfd waiting{socket.get(), POLLIN, 0};
  if (::poll(&waiting, 1, 200) != 1) return false;
  char received[sizeof probe] = {};
  return ::recv(socket.get(), received, sizeof received, MSG_DONTWAIT) == sizeof probe &&
         std::memcmp(received, probe, sizeof probe) == 0;
}

std::vector<Interface> interfaces() {
  std::vector<Interface> found;
  ifaddrs* list = nullptr;
  if (::getifaddrs(&list) != 0) return found;
  const std::unique_ptr<ifaddrs, decltype(&::freeifaddrs)> owner(list, &::freeifaddrs);
  for (const ifaddrs* entry = list; entry != nullptr; entry = entry->ifa_next) {
    if (entry->ifa_addr == nullptr || entry->ifa_addr->sa_family != AF_INET) continue;
    sockaddr_in address{};
    std::memcpy(&address, entry->ifa_addr, sizeof address);
    char text[INET_ADDRSTRLEN] = {};
    if (::inet_ntop(AF_INET, &address.sin_addr, text, sizeof text) == nullptr) continue;
    found.push_back({entry->ifa_name, text, (entry->ifa_flags & IFF_UP) != 0,
                     (entry->ifa_flags & IFF_LOOPBACK) != 0, (entry->ifa_flags & IFF_MULTICAST) != 0});
  }
  return found;
}

std::int64_t number_in(const char* path) {
  std::ifstream file(path);
  std::int64_t value = -1;
  return file >> value ? value : -1;
}

Check judge_interfaces(const MachineFacts& facts) {
  std::string list;
  bool any_network = false;
  bool any_up = false;
  for (const Interface& interface : facts.interfaces) {
    list += fmt::format("{}{} {} ({}{}{})", list.empty() ? "" : ", ", interface.name, interface.address,
                        interface.up ? "up" : "down", interface.loopback ? ", loopback" : "",
                        interface.multicast ? ", multicast" : "");
    any_up = any_up || interface.up;
    any_network = any_network || (interface.up && !interface.loopback);
  }
  if (!any_up)
    return {"interfaces", Verdict::kFailure, list.empty() ? "none" : list,
            "bring an interface up: ip link set lo up"};
  if (!any_network) {
    return {"interfaces", Verdict::kWarning, list,
            fmt::format("only programs on this machine can meet; to use loopback, set CYCLONEDDS_URI='{}'",
                        kLoopbackUri)};
  }
  return {"interfaces", Verdict::kGood, list, ""};
}

Check judge_multicast(const MachineFacts& facts) {
  std::string works;
  std::string fails;
  for (const Interface& interface : facts.interfaces) {
    if (!interface.up) continue;
    const bool good = std::find(facts.multicast_works.begin(), facts.multicast_works.end(), interface.name) !=
                      facts.multicast_works.end();
    std::string& list = good ? works : fails;
    list += (list.empty() ? "" : ", ") + interface.name;
  }
  if (works.empty()) {
    return {
        "multicast", Verdict::kWarning, "works on no interface",
        "clients can find the server by unicast only: on every client, list the server under Discovery/Peers "
        "in CYCLONEDDS_URI"};
  }
  return {"multicast", Verdict::kGood,
          fmt::format("works on {}{} (within this host; switches are not tested)", works,
                      fails.empty() ? "" : "; not on " + fails),
          ""};
}

Check judge_buffer(const char* name, const char* setting, std::int64_t bytes) {
  if (bytes < 0) return {name, Verdict::kWarning, fmt::format("{} cannot be read", setting), ""};
  std::string detail = fmt::format("{} = {} bytes", setting, bytes);
  if (bytes >= kWantedBufferBytes) return {name, Verdict::kGood, std::move(detail), ""};
  return {name, Verdict::kWarning, std::move(detail),
          fmt::format("large deltas and snapshots may need repair: sysctl -w {}={}", setting,
                      kWantedBufferBytes)};
}

Check judge_configuration(const MachineFacts& facts) {
  const std::string what =
      facts.cyclonedds_uri.empty() ? "unset: Cyclone DDS picks the interface" : facts.cyclonedds_uri;
  if (facts.domain_fault.empty()) return {"CYCLONEDDS_URI", Verdict::kGood, what, ""};
  return {"CYCLONEDDS_URI", Verdict::kFailure, fmt::format("{}: {}", what, facts.domain_fault),
          "correct what Cyclone DDS names on stderr: the file, the XML element or the interface"};
}

Check judge_security(const MachineFacts& facts) {
  if (!facts.secure.empty()) {
    if (!facts.identity) return {"security", Verdict::kFailure, facts.identity.error().message, ""};
    return {"security", Verdict::kGood,
            fmt::format("{} {}, until {}", facts.identity->role, facts.identity->name,
                        transport::secure::date_text(facts.identity->not_after_s)),
            ""};
  }
  if (facts.networks.empty()) return {"security", Verdict::kGood, "none, and DDS uses no network", ""};
  return {"security", Verdict::kWarning,
          fmt::format("without --secure, everybody who reaches {} can watch, act and pretend to be a server",
                      fmt::join(facts.networks, ", ")),
          "make identities with `tandem pki`, and give each program its own: --secure DIR"};
}

const char* word(Verdict verdict) {
  switch (verdict) {
    case Verdict::kGood:
      return "ok";
    case Verdict::kWarning:
      return "warning";
    case Verdict::kFailure:
      return "failure";
  }
  return "";
}

int print(const std::vector<Check>& checks, bool json) {
  const bool failed = std::any_of(checks.begin(), checks.end(),
                                  [](const Check& c) { return c.verdict == Verdict::kFailure; });
  if (json) {
    Json rows = Json::array();
    for (const Check& check : checks) {
      rows.push_back({{"name", check.name},
                      {"verdict", word(check.verdict)},
                      {"detail", check.detail},
                      {"advice", check.advice}});
    }
    fmt::print("{}\n", Json{{"ok", !failed}, {"checks", rows}}.dump());
    return failed ? 1 : 0;
  }
  for (const Check& check : checks) {
    fmt::print("{:<8} {:<15} {}\n", word(check.verdict), check.name, check.detail);
    if (!check.advice.empty()) fmt::print("{:<8} {:<15} -> {}\n", "", "", check.advice);
  }
  return failed ? 1 : 0;
}

}  // namespace

MachineFacts machine_facts(std::uint32_t domain, const std::string& secure) {
  MachineFacts facts;
  facts.interfaces = interfaces();
  for (const Interface& interface : facts.interfaces) {
    if (interface.up && multicast_comes_back(interface)) facts.multicast_works.push_back(interface.name);
  }
  facts.receive_buffer_max_bytes = number_in("/proc/sys/net/core/rmem_max");
  facts.send_buffer_max_bytes = number_in("/proc/sys/net/core/wmem_max");
  rlimit files{};
  if (::getrlimit(RLIMIT_NOFILE, &files) == 0) facts.open_files_limit = files.rlim_cur;
  if (const char* uri = std::getenv("CYCLONEDDS_URI")) facts.cyclonedds_uri = uri;
  const auto note_networks = [&facts] { facts.networks = system::networks_in_use(); };
  if (auto opened = transport::check_dds_domain(domain, note_networks); !opened)
    facts.domain_fault = opened.error().message;
  facts.secure = secure;
  if (!secure.empty())
    facts.identity = transport::secure::check_identity_folder(secure, transport::wall_ns() / kSecond);
  return facts;
}

std::vector<Check> judge(const MachineFacts& facts) {
  Check files{"open files", Verdict::kGood, fmt::format("limit {}", facts.open_files_limit), ""};
  if (facts.open_files_limit < kWantedOpenFiles) {
    files.verdict = Verdict::kWarning;
    files.advice = fmt::format("raise it: ulimit -n {}", kWantedOpenFiles);
  }
  return {judge_interfaces(facts),
          judge_multicast(facts),
          judge_buffer("receive buffer", "net.core.rmem_max", facts.receive_buffer_max_bytes),
          judge_buffer("send buffer", "net.core.wmem_max", facts.send_buffer_max_bytes),
          files,
          judge_configuration(facts),
          judge_security(facts)};
}

void add_doctor(commandline::Command app, Run& run) {
  commandline::Command command = app.add_subcommand(
      "doctor", "Checks interfaces, multicast, socket buffers and limits, and suggests changes.");
  const auto json = std::make_shared<bool>(false);
  const auto domain = std::make_shared<std::uint32_t>(0);
  const auto secure = std::make_shared<std::string>();
  command.add_option("--domain", *domain, "DDS domain").range(0U, transport::kMaxDomain).show_default();
  add_secure_option(command, *secure);
  command.add_flag("--json", *json, "Print one JSON object: ok, checks[name, verdict, detail, advice]");
  command.footer("Exits with 1 if sessions cannot work at all, and with 0 if there are only warnings.");
  command.on_chosen([json, domain, secure, &run] {
    run = [json, domain, secure] { return print(judge(machine_facts(*domain, *secure)), *json); };
  });
}

}  // namespace tandem::tool
