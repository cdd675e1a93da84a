#pragma once
// What a session needs of this machine and its networks, and what to change.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sdk/transport/dds/dds_ports.hpp"
#include "sdk/transport/network/interfaces.hpp"
#include "sdk/transport/network/profile.hpp"
#include "sdk/transport/secure/identity_folder.hpp"

namespace tandem::doctor {

/// Of IP and UDP in a packet.
inline constexpr std::uint32_t kHeaderBytes = 28, kHeaderBytesV6 = 48;

enum class Verdict : std::uint8_t { kGood, kWarning, kFailure };

/// One check and its result.
struct Check {
  std::string name;
  Verdict verdict = Verdict::kGood;
  std::string detail;  ///< what was found
  std::string advice;  ///< what to change; empty if nothing
};

/// The way to a server that the profile names.
struct Path {
  std::string server;    ///< ADDRESS:PORT
  std::string source;    ///< the address here from which datagrams leave
  int mtu = 0;           ///< bytes of the largest packet that no router refused; 0: unknown
  bool refused = false;  ///< its machine says that nothing listens at the port
};

/// The facts about the machine; a plain value, so that verdicts can be tested without a machine.
struct MachineFacts {
  std::vector<transport::Interface> interfaces;
  std::vector<std::string> multicast_works;  ///< names of interfaces where a datagram to a group came back
  std::int64_t receive_buffer_max_bytes = 0,
               send_buffer_max_bytes = 0;  ///< net.core.{r,w}mem_max; -1 unknown
  std::uint64_t open_files_limit = 0;

  std::string cyclonedds_uri;  ///< empty: unset
  std::string xml_fault;       ///< why its text is no XML; empty: it is
  bool uri_names_interface = false;
  std::optional<transport::Profile>
      profile;               ///< as it is on this machine; empty: none, or domain_fault says why
  std::string profile_text;  ///< as it was given; empty: none
  std::string reach;         ///< over what others reach DDS by its configuration; empty: nobody does
  transport::Side side = transport::Side::kClient;
  std::string domain_fault;                  ///< why the DDS domain cannot be opened; empty: it can
  std::uint32_t max_message_bytes = 14'720;  ///< the largest datagram that DDS sends

  std::uint32_t domain = 0;
  int first_ephemeral_port = 0, last_ephemeral_port = 0;  ///< net.ipv4.ip_local_port_range; 0: unknown
  std::uint32_t port_in_use = 0;                          ///< a UDP port of the domain; 0: none

  bool clock_synchronised = true;
  std::int64_t clock_s = 0;  ///< since 1970

  std::vector<Path> paths;
  std::vector<transport::HeardParticipant> participants;  ///< of the domain, with our own

  std::string secure;                                   ///< the folder of an identity; empty: none
  std::optional<transport::secure::Identity> identity;  ///< empty: none, or identity_fault says why
  std::string identity_fault;                           ///< names file and cure
};

/// Looks at this machine, and joins the DDS domain for some seconds. Sends one datagram per interface to a
/// multicast group with a time to live of 0, so that it never leaves the host, and a few empty ones to
/// servers that the profile names, to learn the MTU on the way. A profile that names a server is that of a
/// client. `profile` is good (parse_profile()), or empty. `secure`: the folder of an identity, as which it
/// joins the domain if that is good; empty: none.
[[nodiscard]] MachineFacts machine_facts(std::uint32_t domain, const std::string& profile,
                                         const std::string& secure = {});

/// Judges the facts: configuration, interfaces, multicast, buffers, limits, MTU, clock, ports, peers and
/// security.
[[nodiscard]] std::vector<Check> judge(const MachineFacts& facts);

}  // namespace tandem::doctor
