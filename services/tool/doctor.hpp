#pragma once
// `tandem doctor`: checks what a session needs from this machine and suggests changes.

#include <cstdint>
#include <string>
#include <vector>

#include "sdk/transport/secure/identity_folder.hpp"
#include "tandem/result.hpp"

namespace tandem::tool {

enum class Verdict : std::uint8_t { kGood, kWarning, kFailure };

/// One check and its result.
struct Check {
  std::string name;
  Verdict verdict = Verdict::kGood;
  std::string detail;  ///< what was found
  std::string advice;  ///< what to change; empty if nothing
};

/// A network interface that carries IPv4.
struct Interface {
  std::string name;
  std::string address;  ///< dotted
  bool up = false, loopback = false, multicast = false;
};

/// The facts about the machine; a plain value, so that verdicts can be tested without a machine.
struct MachineFacts {
  std::vector<Interface> interfaces;
  std::vector<std::string> multicast_works;  ///< names of interfaces where a datagram to a group came back
  std::int64_t receive_buffer_max_bytes = 0,
               send_buffer_max_bytes = 0;  ///< net.core.{r,w}mem_max; -1 unknown
  std::uint64_t open_files_limit = 0;
  std::string cyclonedds_uri;         ///< empty: unset
  std::string domain_fault;           ///< why the DDS domain cannot be opened; empty: it can
  std::vector<std::string> networks;  ///< addresses, not of loopback, that DDS uses
  std::string secure;                 ///< folder of an identity; empty: none was given
  Result<transport::secure::Identity> identity = fail(ErrorCode::kNotReady, "");  ///< of that folder
};

/// Looks at this machine and the identity in `secure`, and opens the DDS domain. Sends one datagram per
/// interface to a multicast group with a time to live of 0, so that it never leaves the host. Takes at most a
/// second.
[[nodiscard]] MachineFacts machine_facts(std::uint32_t domain, const std::string& secure = {});

/// Judges the facts. One check each for interfaces, multicast, buffers, limits, the DDS configuration and DDS
/// Security.
[[nodiscard]] std::vector<Check> judge(const MachineFacts& facts);

}  // namespace tandem::tool
