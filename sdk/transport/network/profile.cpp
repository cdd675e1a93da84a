#include "sdk/transport/network/profile.hpp"

#include <arpa/inet.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <memory>
#include <utility>

namespace tandem::transport {
namespace {

constexpr std::uint32_t kMaxPort = 65'535;

/// How often a profile takes a parameter.
struct Count {
  std::size_t least = 0, most = 0;
};
struct Rule {
  const char* name = nullptr;
  Count interfaces;
  bool wide_area = false;  ///< takes server, external and index
};
constexpr Rule kRules[] = {{"loopback", {0, 0}, false},
                           {"lan", {0, 1}, false},
                           {"wifi", {0, 1}, false},
                           {"wan", {0, 1}, true},
                           {"multihomed", {2, kMaxInterfaces}, false}};
constexpr std::size_t kMaxServers = 8;

tl::unexpected<Error> wrong(std::string what) { return fail(ErrorCode::kInvalidArgument, std::move(what)); }
tl::unexpected<Error> failed(const Profile& profile, const std::string& what) {
  return fail(ErrorCode::kTransport, "profile " + profile.name + ": " + what);
}

std::string names_of_profiles() {
  std::string names;
  for (std::size_t i = 0; i < std::size(kRules); ++i)
    names += std::string(i == 0 ? "" : i + 1 == std::size(kRules) ? " or " : ", ") + kRules[i].name;
  return names;
}

std::string keys_of(const Rule& rule) {
  if (rule.wide_area) return "server, interface, external and index";
  return rule.interfaces.most > 0 ? "interface" : "no parameters";
}

/// What may stand in the configuration as it is.
bool harmless(std::string_view text) {
  return !text.empty() && text.size() <= 255 && std::ranges::all_of(text, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           std::strchr("._:@-[]", c) != nullptr;
  });
}

std::optional<std::uint32_t> number_in(std::string_view text, std::uint32_t most) {
  std::uint32_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value > most) return std::nullopt;
  return value;
}

bool is_address(int family, const std::string& text) {
  in6_addr address{};
  return ::inet_pton(family, text.c_str(), &address) == 1;
}

/// "HOST:PORT", "[ADDRESS]:PORT" or a host or address alone, whose port is then `otherwise`. Empty if it is
/// none of these.
std::optional<std::pair<std::string, std::uint32_t>> host_and_port(const std::string& text,
                                                                   std::uint32_t otherwise) {
  if (is_address(AF_INET6, text)) return std::pair(text, otherwise);
  std::string host = text.substr(0, text.find(':')), rest = text.substr(host.size());
  if (text.starts_with('[')) {
    const std::size_t end = text.find(']');
    if (end == std::string::npos) return std::nullopt;
    host = text.substr(1, end - 1);
    rest = text.substr(end + 1);
    if (!is_address(AF_INET6, host)) return std::nullopt;
  }
  if (host.empty() || host.find_first_of("[]") != std::string::npos) return std::nullopt;
  if (rest.empty()) return std::pair(host, otherwise);
  const auto port = number_in(std::string_view(rest).substr(1), kMaxPort);
  if (!rest.starts_with(':') || !port || *port == 0) return std::nullopt;
  return std::pair(host, *port);
}

Result<void> set_parameter(const Rule& rule, std::string_view key, std::string_view value, Profile& profile) {
  if (key == "interface" && rule.interfaces.most > 0) {
    profile.interfaces.emplace_back(value);
  } else if (key == "server" && rule.wide_area) {
    if (!host_and_port(std::string(value), 1))
      return wrong("server must be ADDRESS or ADDRESS:PORT, with IPv6 [ADDRESS]:PORT, not '" +
                   std::string(value) + "'");
    profile.servers.emplace_back(value);
  } else if (key == "external" && rule.wide_area) {
    if (!is_address(AF_INET, std::string(value)))
      return wrong("external must be an IPv4 address, not '" + std::string(value) + "'");
    profile.external = value;
  } else if (key == "index" && rule.wide_area) {
    const auto index = number_in(value, kMaxServerIndex);
    if (!index) return wrong("index must be 0 to " + std::to_string(kMaxServerIndex));
    profile.index = *index;
  } else {
    return wrong(profile.name + " takes " + keys_of(rule) + ", not '" + std::string(key) + "'");
  }
  return {};
}

Result<void> check_counts(const Rule& rule, const Profile& profile, Side side) {
  const std::size_t interfaces = profile.interfaces.size();
  if (interfaces < rule.interfaces.least || interfaces > rule.interfaces.most) {
    return rule.interfaces.least > 1 ? wrong(profile.name + " needs two to four interfaces: " + profile.name +
                                             ":interface=NAME,interface=NAME")
                                     : wrong(profile.name + " takes one interface");
  }
  if (profile.servers.size() > kMaxServers)
    return wrong(profile.name + " takes at most " + std::to_string(kMaxServers) + " servers");
  if (rule.wide_area && side == Side::kClient && profile.servers.empty())
    return wrong(profile.name + " needs the server's address: " + profile.name + ":server=ADDRESS");
  return {};
}

std::string usable(std::vector<Interface> all) {
  std::erase_if(all, [](const Interface& each) { return !each.up || each.address.empty(); });
  return list_of(all);
}

Result<void> check_interface(const Profile& profile, const std::string& name, const Surroundings& machine) {
  const auto found = std::ranges::find(machine.interfaces, name, &Interface::name);
  if (found == machine.interfaces.end())
    return failed(profile,
                  "there is no interface '" + name + "' (there are " + usable(machine.interfaces) + ")");
  if (!found->up) return failed(profile, "the interface '" + name + "' is down: ip link set " + name + " up");
  if (found->address.empty()) return failed(profile, "the interface '" + name + "' has no address");
  if (profile.name != "wan" && !found->multicast && !found->loopback)
    return failed(profile, "the interface '" + name + "' carries no multicast; use the profile wan");
  return {};
}

/// The interface of a network if there is only one, or else that of the default route.
Result<std::string> only_interface(const Profile& profile, const Surroundings& machine) {
  std::vector<Interface> candidates;
  for (const Interface& each : machine.interfaces) {
    if (each.up && !each.loopback && !each.address.empty() && (each.multicast || profile.name == "wan"))
      candidates.push_back(each);
  }
  // IPv6 is for where nothing else is.
  const auto has_v4 = [](const Interface& each) { return !is_v6(each.address); };
  if (std::ranges::any_of(candidates, has_v4)) std::erase_if(candidates, std::not_fn(has_v4));
  if (candidates.empty())
    return failed(profile, "no interface of a network is up (there are " + list_of(machine.interfaces) + ")");
  const auto is_default = [&](const Interface& each) { return each.name == machine.default_route; };
  if (const auto found = std::ranges::find_if(candidates, is_default); found != candidates.end())
    return found->name;
  if (candidates.size() == 1) return candidates.front().name;
  return failed(profile, "this machine is on several networks (" + list_of(candidates) +
                             "): say which, as in " + profile.name + ":interface=" + candidates.front().name);
}

/// Replaces the servers' names by addresses with ports.
Result<void> look_up_servers(Profile& profile, std::uint32_t domain, const Surroundings& machine) {
  for (std::string& server : profile.servers) {
    const auto parts = host_and_port(server, server_port(domain, 0));
    const auto address = machine.look_up(parts->first);
    if (!address)
      return failed(profile, "the server '" + parts->first + "' is no address and cannot be looked up");
    server = (is_v6(*address) ? "[" + *address + "]" : *address) + ":" + std::to_string(parts->second);
  }
  return {};
}

/// The interface that leads to the first server.
Result<std::string> interface_to_server(const Profile& profile, const Surroundings& machine) {
  const std::string address = address_of(profile.servers.front());
  const auto source = machine.source_address_to(address);
  if (!source) return failed(profile, "there is no route to the server " + address);
  const auto found = std::ranges::find_if(machine.interfaces, [&source](const Interface& each) {
    return each.address == *source || std::ranges::find(each.v6, *source) != each.v6.end();
  });
  if (found == machine.interfaces.end())
    return failed(profile, "no interface has the address " + *source + ", from which the server " + address +
                               " is reached");
  if (found->loopback)
    return failed(profile,
                  address +
                      " is this machine: give the server's address on the network, or use the profile "
                      "loopback for all programs");
  return found->name;
}

/// Sets whether DDS has to use IPv6. It has one kind of address for a domain.
Result<void> choose_family(Profile& profile, const Surroundings& machine) {
  bool v4 = false, v6 = false;
  for (const std::string& server : profile.servers) (is_v6(address_of(server)) ? v6 : v4) = true;
  if (v4 && v6) return failed(profile, "one server has an IPv4 address and another an IPv6 address");
  bool lacks_v4 = false, lacks_v6 = false;
  for (const Interface& each : machine.interfaces) {
    const bool used = profile.name == "loopback"
                          ? each.loopback
                          : std::ranges::find(profile.interfaces, each.name) != profile.interfaces.end();
    lacks_v4 = lacks_v4 || (used && is_v6(each.address));
    lacks_v6 = lacks_v6 || (used && each.v6.empty());
  }
  profile.v6 = v6 || (!v4 && lacks_v4);
  if (profile.v6 ? lacks_v6 : lacks_v4)
    return failed(profile,
                  std::string("not all that it needs has an ") + (v6 || !v4 ? "IPv6" : "IPv4") + " address");
  if (profile.v6 && !profile.external.empty()) return failed(profile, "external is for IPv4 alone");
  return {};
}

const std::vector<std::string>* values_of(
    std::string_view placeholder, const std::vector<std::pair<std::string, std::vector<std::string>>>& all) {
  const auto found =
      std::ranges::find(all, placeholder, [](const auto& each) { return std::string_view(each.first); });
  return found == all.end() || found->second.empty() ? nullptr : &found->second;
}

}  // namespace

std::uint32_t server_port(std::uint32_t domain, std::uint32_t index) {
  return 7410 + 250 * domain + 2 * index;
}

std::string address_of(const std::string& server) {
  return host_and_port(server, 0).value_or(std::pair("", 0)).first;
}

Result<Profile> parse_profile(const std::string& text, Side side) {
  Profile profile;
  const std::size_t colon = text.find(':');
  profile.name = text.substr(0, colon);
  const auto rule =
      std::ranges::find(kRules, profile.name, [](const Rule& each) { return std::string(each.name); });
  if (rule == std::end(kRules))
    return wrong("must be " + names_of_profiles() + ", not '" + profile.name + "'");
  std::string_view rest =
      colon == std::string::npos ? std::string_view() : std::string_view(text).substr(colon + 1);
  while (colon != std::string::npos) {
    const std::size_t comma = rest.find(',');
    const std::string_view item = rest.substr(0, comma);
    const std::size_t equals = item.find('=');
    if (equals == std::string_view::npos || !harmless(item.substr(equals + 1)))
      return wrong("the parameters of " + profile.name + " must be KEY=VALUE,KEY=VALUE, not '" +
                   std::string(item) + "'");
    const auto set = set_parameter(*rule, item.substr(0, equals), item.substr(equals + 1), profile);
    if (!set) return tl::unexpected(set.error());
    if (comma == std::string_view::npos) break;
    rest.remove_prefix(comma + 1);
  }
  if (auto good = check_counts(*rule, profile, side); !good) return tl::unexpected(good.error());
  return profile;
}

namespace {

std::optional<std::string> look_up(const std::string& host, int family) {
  addrinfo wanted{};
  wanted.ai_family = family;
  wanted.ai_socktype = SOCK_DGRAM;
  addrinfo* list = nullptr;
  if (::getaddrinfo(host.c_str(), nullptr, &wanted, &list) != 0) return std::nullopt;
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> owner(list, &::freeaddrinfo);
  char text[INET6_ADDRSTRLEN] = {};
  if (::getnameinfo(list->ai_addr, list->ai_addrlen, text, sizeof text, nullptr, 0, NI_NUMERICHOST) != 0)
    return std::nullopt;
  return std::string(text);
}

}  // namespace

Surroundings surroundings() {
  Surroundings machine;
  machine.interfaces = interfaces();
  machine.default_route = default_route_interface();
  machine.source_address_to = &source_address_to;
  machine.port_taken = [](std::uint32_t port) { return udp_port_taken(port, false); };
  machine.look_up = [](const std::string& host) -> std::optional<std::string> {
    if (is_address(AF_INET, host) || is_address(AF_INET6, host)) return host;
    const auto of_v4 = only_v6(interfaces()) ? std::nullopt : look_up(host, AF_INET);
    return of_v4 ? of_v4 : look_up(host, AF_INET6);
  };
  return machine;
}

Result<Profile> resolve_profile(Profile profile, Side side, std::uint32_t domain,
                                const Surroundings& machine) {
  const std::uint32_t port = server_port(domain, profile.index);
  if (profile.name == "wan" && side == Side::kServer && machine.port_taken(port)) {
    return failed(profile,
                  "UDP port " + std::to_string(port) +
                      " is in use here; if that is another server, give one of them another --domain, or "
                      "wan:index=N");
  }
  if (auto looked_up = look_up_servers(profile, domain, machine); !looked_up)
    return tl::unexpected(looked_up.error());
  for (const std::string& name : profile.interfaces) {
    if (auto good = check_interface(profile, name, machine); !good) return tl::unexpected(good.error());
    if (std::ranges::count(profile.interfaces, name) > 1)
      return failed(profile, "the interface '" + name + "' is named twice");
  }
  if (profile.interfaces.empty() && profile.name != "loopback") {
    const bool by_route = side == Side::kClient && !profile.servers.empty();
    auto chosen = by_route ? interface_to_server(profile, machine) : only_interface(profile, machine);
    if (!chosen) return tl::unexpected(chosen.error());
    profile.interfaces = {std::move(*chosen)};
  }
  if (auto chosen = choose_family(profile, machine); !chosen) return tl::unexpected(chosen.error());
  return profile;
}

std::string describe(const Profile& resolved, Side side, std::uint32_t domain, const Surroundings& machine) {
  std::string text = "profile " + resolved.name;
  if (resolved.v6) text += " by IPv6";
  for (std::size_t i = 0; i < resolved.interfaces.size(); ++i)
    text += (i == 0 ? " on " : ", ") + resolved.interfaces[i];
  if (resolved.name == "wan" && side == Side::kServer)
    text += ", UDP port " + std::to_string(server_port(domain, resolved.index));
  for (std::size_t i = 0; i < resolved.servers.size(); ++i)
    text += (i == 0 ? ", servers " : ", ") + resolved.servers[i];
  if (!resolved.external.empty()) return text + ", seen as " + resolved.external;
  for (const std::string& server : resolved.servers) {
    const std::string address = address_of(server);
    const auto source = machine.source_address_to(address);
    if (!source || !is_private(*source) || is_private(address)) continue;
    return text.append("; ")
        .append(*source)
        .append(" is private and ")
        .append(address)
        .append(
            " is not: if NAT is between, the server cannot answer without external=ADDRESS, the address that it sees");
  }
  return text;
}

std::string profile_xml(const Profile& resolved, Side side) {
  const auto file = std::ranges::find(profile_files(), resolved.name,
                                      [](const ProfileFile& each) { return std::string(each.name); });
  const auto one = [](const std::string& value) {
    return value.empty() ? std::vector<std::string>() : std::vector<std::string>{value};
  };
  const std::vector<std::pair<std::string, std::vector<std::string>>> values = {
      {"TANDEM_INTERFACE", resolved.interfaces},
      {"TANDEM_TRANSPORT", one(resolved.v6 ? "udp6" : "")},
      {"TANDEM_SERVER", resolved.servers},
      {"TANDEM_EXTERNAL", one(resolved.external)},
      {"TANDEM_INDEX", one(side == Side::kServer ? std::to_string(resolved.index) : "")}};
  std::string xml;
  std::string_view text = file->text;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n') + 1);
    text.remove_prefix(line.size());
    const std::size_t begin = line.find("${");
    if (begin == std::string_view::npos) {
      xml += line;
      continue;
    }
    const std::size_t end = line.find('}', begin);
    const std::string_view inside = line.substr(begin + 2, end - begin - 2);
    const std::size_t otherwise = inside.find(":-");
    const auto write = [&](std::string_view value) {
      xml.append(line.substr(0, begin)).append(value).append(line.substr(end + 1));
    };
    if (const auto* given = values_of(inside.substr(0, otherwise), values)) {
      std::ranges::for_each(*given, write);
    } else if (otherwise != std::string_view::npos) {
      write(inside.substr(otherwise + 2));
    }
  }
  while (!xml.empty() && xml.back() == '\n') xml.pop_back();
  return xml;
}

}  // namespace tandem::transport
