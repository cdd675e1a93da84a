#pragma once
// Profiles of networks (deploy/dds): what --profile says, and the configuration of Cyclone DDS that it makes.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sdk/transport/network/interfaces.hpp"
#include "tandem/result.hpp"

namespace tandem::transport {

/// Which side of a session a program is on. In a WAN only servers are at a known port.
enum class Side : std::uint8_t { kServer, kClient };

/// A file of deploy/dds, which is part of the library.
struct ProfileFile {
  std::string_view name, text;
};
/// In the order of deploy/dds/README.md.
[[nodiscard]] const std::vector<ProfileFile>& profile_files();

/// A profile with its parameters, as "wan:server=203.0.113.5,external=198.51.100.7" says it.
struct Profile {
  std::string name;
  std::vector<std::string> servers, interfaces;
  std::string external;
  std::uint32_t index = 0;
  bool v6 = false;  ///< resolved: DDS uses IPv6, which all on a domain have to do then
};

/// The address in "ADDRESS:PORT" or "[ADDRESS]:PORT".
[[nodiscard]] std::string address_of(const std::string& server);

inline constexpr std::uint32_t kMaxServerIndex = 9;
/// The largest number of interfaces that Cyclone DDS 0.10 uses at once.
inline constexpr std::size_t kMaxInterfaces = 4;

/// Reads "NAME" or "NAME:key=value,key=value"; a key that takes several values is repeated. Errors:
/// kInvalidArgument for an unknown name, which lists the known ones, and for parameters that are unknown,
/// missing or wrong.
[[nodiscard]] Result<Profile> parse_profile(const std::string& text, Side side);

/// What a profile needs to know of the machine.
struct Surroundings {
  std::vector<Interface> interfaces;
  std::string default_route;  ///< name of an interface; may be empty
  /// Address of a host, IPv4 if it has one that can be reached; empty if it cannot be looked up.
  std::function<std::optional<std::string>(const std::string& host)> look_up;
  /// As transport::source_address_to().
  std::function<std::optional<std::string>(const std::string& address)> source_address_to;
  /// Whether another program has that UDP port.
  std::function<bool(std::uint32_t port)> port_taken;
};
[[nodiscard]] Surroundings surroundings();

/// The parameters of a profile with what this machine decides: addresses instead of hosts, each with a port,
/// and the interface. Errors: kTransport if an interface is not there or not usable, if several could be
/// meant, or if a server cannot be looked up or reached.
[[nodiscard]] Result<Profile> resolve_profile(Profile profile, Side side, std::uint32_t domain,
                                              const Surroundings& surroundings);

/// The profile's file with the parameters of a resolved profile in it. In a file, ${TANDEM_X} stands for a
/// parameter and ${TANDEM_X:-VALUE} for one that may be missing. A line is repeated for each value, and left
/// out if it has none.
[[nodiscard]] std::string profile_xml(const Profile& resolved, Side side);

/// What people should know of a resolved profile: "profile wan on eth0, UDP port 7410".
[[nodiscard]] std::string describe(const Profile& resolved, Side side, std::uint32_t domain,
                                   const Surroundings& surroundings);

/// The UDP port at which a server with that index is found.
[[nodiscard]] std::uint32_t server_port(std::uint32_t domain, std::uint32_t index);

}  // namespace tandem::transport
