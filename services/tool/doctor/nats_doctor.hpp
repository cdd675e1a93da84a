#pragma once
// What relays and gateways need of a NATS server and of their user there.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "sdk/transport/nats/nats_bus.hpp"
#include "sdk/transport/nats/nats_monitor.hpp"
#include "services/tool/doctor/doctor.hpp"

namespace tandem::doctor {

/// What was found, a plain value, so that verdicts can be tested without a server.
struct NatsFacts {
  std::string url;       ///< as it may be shown
  std::string fault;     ///< why nothing could be tried (URL, files, no libnats); empty: it was tried
  bool reached = false;  ///< connected, with a user that the server knows
  std::string trouble;   ///< the last error of the connection
  std::string session;   ///< that is asked for; empty: any
  std::string site;
  std::size_t most_bytes = 0;                ///< max_payload
  std::vector<std::int64_t> round_trips_ns;  ///< of a few questions to the server
  /// Subjects that are not permitted, of those that a follower of this site needs, and of those that the
  /// relay beside the server needs besides.
  std::vector<std::string> refused_to_follow, refused_to_publish;
  std::map<std::string, transport::NatsMonitor::Heard> sessions;  ///< that relays announce now
  std::uint8_t foreign_version = 0;  ///< of a relay that speaks another version; 0: none was heard
};

/// Connects and listens for about three seconds. What it publishes to try the permissions is for a session
/// that does not exist, or means nothing. `session`: to look for; empty: any.
[[nodiscard]] NatsFacts nats_facts(const transport::NatsOptions& options, const std::string& site,
                                   const std::string& session);

/// Judges: reached, permissions, max_payload, latency, sessions.
[[nodiscard]] std::vector<Check> judge(const NatsFacts& facts);

}  // namespace tandem::doctor
