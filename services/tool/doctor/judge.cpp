#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "sdk/transport/secure/openssl.hpp"
#include "services/tool/doctor/doctor.hpp"

namespace tandem::doctor {
namespace {

using transport::HeardParticipant;
using transport::Interface;
using transport::Side;

// A burst of one 240 KB delta, its protocol overhead and as much again while the reader is busy.
constexpr std::int64_t kWantedBufferBytes = 1 << 20;
constexpr std::uint64_t kWantedOpenFiles = 256;
constexpr int kEthernetMtu = 1500;
constexpr std::int64_t kYear2024 = 1'704'067'200;
constexpr std::int64_t kRenewBeforeS = std::int64_t{7} * 86'400;
// What DDS uses of the ports of a domain: 0 and 1 for multicast, 10 and more for programs at known ports.
constexpr std::uint32_t kPortsOfDomain = 250;

bool has_profile(const MachineFacts& facts, std::string_view name) {
  return facts.profile && facts.profile->name == name;
}

/// The interfaces that DDS uses, as our own participant says.
std::vector<Interface> used(const MachineFacts& facts) {
  std::vector<Interface> all;
  const auto own = std::ranges::find_if(facts.participants, &HeardParticipant::own);
  for (const Interface& interface : facts.interfaces) {
    const bool named = facts.profile && std::ranges::find(facts.profile->interfaces, interface.name) !=
                                            facts.profile->interfaces.end();
    const bool told = own != facts.participants.end() &&
                      std::ranges::any_of(own->addresses, [&](const std::string& address) {
                        return address == interface.address ||
                               std::ranges::find(interface.v6, address) != interface.v6.end();
                      });
    if (named || told) all.push_back(interface);
  }
  return all;
}

std::string names_of(const std::vector<Interface>& all) {
  std::string names;
  for (const Interface& each : all) names += (names.empty() ? "" : ", ") + each.name;
  return names;
}

Check judge_configuration(const MachineFacts& facts) {
  const bool profile = !facts.profile_text.empty();
  Check check{profile ? "profile" : "CYCLONEDDS_URI", Verdict::kGood, facts.profile_text, ""};
  if (!profile) {
    check.detail =
        facts.cyclonedds_uri.empty() ? "unset: Cyclone DDS picks the interface" : facts.cyclonedds_uri;
  } else if (!facts.cyclonedds_uri.empty()) {
    check.detail += "; CYCLONEDDS_URI is set too, and not used";
  }
  if (!profile && !facts.xml_fault.empty()) {
    return {check.name, Verdict::kFailure, check.detail + ": this is no XML: " + facts.xml_fault,
            "correct it; Cyclone DDS takes the part before the fault without a word"};
  }
  if (facts.domain_fault.empty()) return check;
  check.verdict = Verdict::kFailure;
  check.detail += ": " + facts.domain_fault;
  check.advice = profile
                     ? "correct the parameter that the message names, or bring up what it misses"
                     : "correct what Cyclone DDS names on stderr: the file, the XML element or the interface";
  return check;
}

Check judge_interfaces(const MachineFacts& facts) {
  std::string list;
  std::vector<Interface> networks;
  bool any_up = false;
  for (const Interface& interface : facts.interfaces) {
    if (interface.address.empty()) continue;
    list += fmt::format("{}{} {} ({}{}{})", list.empty() ? "" : ", ", interface.name, interface.address,
                        interface.up ? "up" : "down", interface.loopback ? ", loopback" : "",
                        interface.multicast ? ", multicast" : "");
    any_up = any_up || interface.up;
    if (interface.up && !interface.loopback) networks.push_back(interface);
  }
  // IPv6 is for where nothing else is.
  if (!transport::only_v6(networks))
    std::erase_if(networks, [](const Interface& each) { return transport::is_v6(each.address); });
  if (!any_up) {
    return {"interfaces", Verdict::kFailure, list.empty() ? "none" : list,
            "bring an interface up: ip link set lo up"};
  }
  const std::vector<Interface> chosen = used(facts);
  if (!chosen.empty()) list += fmt::format("; DDS uses {}", names_of(chosen));
  const bool decided = !facts.profile_text.empty() || facts.uri_names_interface;
  if (networks.empty() && !decided) {
    return {
        "interfaces", Verdict::kWarning, list,
        "only programs on this machine can meet; let all of them use loopback: --profile loopback, or set "
        "CYCLONEDDS_URI"};
  }
  if (networks.size() > 1 && !decided) {
    return {"interfaces", Verdict::kWarning, list,
            fmt::format("Cyclone DDS chose among {} networks; say which one the others are on: --profile "
                        "lan:interface={}",
                        networks.size(), networks.front().name)};
  }
  return {"interfaces", Verdict::kGood, list, ""};
}

Check judge_multicast(const MachineFacts& facts) {
  if (has_profile(facts, "wan")) return {"multicast", Verdict::kGood, "not used by the profile wan", ""};
  std::string works, fails;
  const std::vector<Interface> chosen = used(facts);
  bool used_works = chosen.empty();
  for (const Interface& interface : chosen.empty() ? facts.interfaces : chosen) {
    if (!interface.up || interface.address.empty()) continue;
    // The system loops back what an interface cannot send.
    const bool good = (interface.multicast || interface.loopback) &&
                      std::ranges::find(facts.multicast_works, interface.name) != facts.multicast_works.end();
    std::string& list = good ? works : fails;
    list += (list.empty() ? "" : ", ") + interface.name;
    used_works = used_works || good;
  }
  if (works.empty() || !used_works) {
    return {"multicast", Verdict::kWarning,
            chosen.empty() ? "works on no interface" : "does not work on " + fails,
            "let the server use --profile wan, and clients --profile wan:server=ADDRESS, which needs none"};
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

Check judge_files(const MachineFacts& facts) {
  Check files{"open files", Verdict::kGood, fmt::format("limit {}", facts.open_files_limit), ""};
  if (facts.open_files_limit < kWantedOpenFiles) {
    files.verdict = Verdict::kWarning;
    files.advice = fmt::format("raise it: ulimit -n {}", kWantedOpenFiles);
  }
  return files;
}

Check judge_mtu(const MachineFacts& facts) {
  const auto own = std::ranges::find_if(facts.participants, &HeardParticipant::own);
  const bool v6 = facts.profile ? facts.profile->v6
                                : own != facts.participants.end() &&
                                      std::ranges::any_of(own->addresses, &transport::is_v6);
  const std::uint32_t packet = facts.max_message_bytes + (v6 ? kHeaderBytesV6 : kHeaderBytes);
  std::string detail;
  bool narrow = false;
  for (const Interface& interface : used(facts)) {
    if (interface.mtu == 0) continue;
    detail += fmt::format("{}{} {}", detail.empty() ? "" : ", ", interface.name, interface.mtu);
    narrow = narrow || interface.mtu < std::min(static_cast<int>(packet), kEthernetMtu);
  }
  for (const Path& path : facts.paths) {
    if (path.mtu == 0) continue;
    detail += fmt::format("{}to {} {}", detail.empty() ? "" : ", ", path.server, path.mtu);
    narrow = narrow || path.mtu < static_cast<int>(packet);
  }
  if (detail.empty()) return {"MTU", Verdict::kGood, "unknown", ""};
  detail += fmt::format(" bytes; DDS sends packets of up to {}", packet);
  if (!narrow) return {"MTU", Verdict::kGood, std::move(detail), ""};
  return {
      "MTU", Verdict::kWarning, std::move(detail),
      has_profile(facts, "wan")
          ? fmt::format(
                "datagrams come in fragments, which tunnels and firewalls drop: raise the MTU on the way to "
                "{} bytes",
                packet)
          : "datagrams come in fragments, which tunnels and firewalls drop: let all use --profile wan, whose packets "
            "are 1,260 bytes"};
}

Check judge_clock(const MachineFacts& facts) {
  const std::string time = fmt::format("{} s since 1970", facts.clock_s);
  if (facts.clock_s < kYear2024) {
    return {"clock", Verdict::kFailure, time + ", which is before this program was written",
            "set the clock: certificates and tokens are judged by it; timedatectl set-ntp true"};
  }
  if (!facts.clock_synchronised) {
    return {
        "clock", Verdict::kWarning, "not synchronised",
        "logs of several machines will not fit together, and certificates may seem expired: timedatectl set-ntp "
        "true"};
  }
  return {"clock", Verdict::kGood, "synchronised", ""};
}

Check judge_ports(const MachineFacts& facts) {
  const std::uint32_t first = transport::server_port(facts.domain, 0) - 10;
  const bool server = has_profile(facts, "wan") && facts.side == Side::kServer;
  std::string detail = fmt::format("UDP {} and above", first);
  if (server) {
    detail = fmt::format("UDP {}, which firewalls on the way have to let in",
                         transport::server_port(facts.domain, facts.profile->index));
  } else if (has_profile(facts, "wan")) {
    detail = "any UDP port";
  }
  if (facts.port_in_use != 0) {
    return {"ports", Verdict::kFailure,
            fmt::format("UDP port {} is in use by another program", facts.port_in_use),
            server ? "if that is another server, give one of them another --domain, or wan:index=N"
                   : "use another --domain"};
  }
  const bool overlaps = facts.last_ephemeral_port != 0 &&
                        static_cast<int>(first + kPortsOfDomain) > facts.first_ephemeral_port &&
                        static_cast<int>(first) <= facts.last_ephemeral_port;
  if (overlaps) {
    return {"ports", Verdict::kWarning,
            fmt::format("{}; the system gives {} to {} to any program", detail, facts.first_ephemeral_port,
                        facts.last_ephemeral_port),
            "another program may be given a port of this domain by chance: use a --domain of 0 to 100"};
  }
  return {"ports", Verdict::kGood, std::move(detail), ""};
}

std::string describe(const HeardParticipant& participant) {
  std::string text = participant.name.empty() ? "(no name)" : participant.name;
  // Strangers choose their names.
  std::ranges::replace_if(
      text, [](unsigned char c) { return c < 0x20 || c == 0x7F; }, '?');
  if (!participant.addresses.empty()) text += fmt::format(" at {}", fmt::join(participant.addresses, ", "));
  return text;
}

Check silent(const MachineFacts& facts, const std::string& server, std::string detail) {
  const auto path = std::ranges::find(facts.paths, server, &Path::server);
  const std::string address = transport::address_of(server);
  detail += fmt::format("{}no answer from {}", detail.empty() ? "" : "; ", server);
  if (path != facts.paths.end() && path->refused) {
    return {"peers", Verdict::kFailure, detail + ", where nothing listens at that port",
            "start the server there with --profile wan, on the same --domain"};
  }
  const bool masked =
      path != facts.paths.end() && facts.profile->external.empty() && transport::is_private(path->source);
  if (masked && !transport::is_private(address)) {
    return {
        "peers", Verdict::kFailure,
        fmt::format("{}; {} is private and {} is not, so NAT is between", detail, path->source, address),
        fmt::format("give the address that others see: --profile wan:server={},external=ADDRESS", address)};
  }
  return {"peers", Verdict::kFailure, detail,
          fmt::format("start the server there with --profile wan, let firewalls pass that UDP port{}",
                      masked ? "; if NAT is between, add external=ADDRESS" : "")};
}

Check judge_peers(const MachineFacts& facts) {
  if (!facts.domain_fault.empty()) return {"peers", Verdict::kWarning, "the domain is not open", ""};
  std::string detail;
  for (const HeardParticipant& each : facts.participants)
    if (!each.own) detail += (detail.empty() ? "" : "; ") + describe(each);
  for (const Path& path : facts.paths) {
    const std::string address = transport::address_of(path.server);
    const bool heard = std::ranges::any_of(facts.participants, [&](const HeardParticipant& each) {
      return !each.own && std::ranges::find(each.addresses, address) != each.addresses.end();
    });
    // With one server any answer is its own, though it may know itself by another address.
    const bool only = facts.paths.size() == 1 && !detail.empty();
    if (!heard && !only) return silent(facts, path.server, detail);
  }
  return {"peers", Verdict::kGood, detail.empty() ? "nobody else is on the domain now" : detail, ""};
}

Check judge_security(const MachineFacts& facts) {
  if (!facts.identity_fault.empty()) return {"security", Verdict::kFailure, facts.identity_fault, ""};
  if (facts.identity) {
    const transport::secure::Identity& identity = *facts.identity;
    std::string detail = fmt::format("{} {}, until {}", identity.role.empty() ? "identity" : identity.role,
                                     identity.name, transport::secure::date_text(identity.not_after_s));
    if (identity.not_after_s - facts.clock_s > kRenewBeforeS)
      return {"security", Verdict::kGood, std::move(detail), ""};
    return {"security", Verdict::kWarning, std::move(detail),
            fmt::format(
                "it ends soon, and its peers then leave it: tandem pki renew {}, and start the program again",
                identity.name)};
  }
  if (facts.reach.empty())
    return {"security", Verdict::kGood, "none, and DDS is told to stay on this machine", ""};
  std::vector<std::string> networks;
  for (const HeardParticipant& each : facts.participants)
    if (each.own) networks = each.addresses;
  std::erase_if(networks, &transport::is_loopback);
  if (networks.empty()) networks = {"this machine over " + facts.reach};
  return {"security", Verdict::kWarning,
          fmt::format("without --secure, everybody who reaches {} can watch, act and pretend to be a server",
                      fmt::join(networks, ", ")),
          "make identities with `tandem pki`, and give each program its own: --secure DIR"};
}

}  // namespace

std::vector<Check> judge(const MachineFacts& facts) {
  return {judge_configuration(facts),
          judge_interfaces(facts),
          judge_multicast(facts),
          judge_buffer("receive buffer", "net.core.rmem_max", facts.receive_buffer_max_bytes),
          judge_buffer("send buffer", "net.core.wmem_max", facts.send_buffer_max_bytes),
          judge_files(facts),
          judge_mtu(facts),
          judge_clock(facts),
          judge_ports(facts),
          judge_peers(facts),
          judge_security(facts)};
}

}  // namespace tandem::doctor
