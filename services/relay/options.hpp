#pragma once
// The options of tandem-relay, checked and complete.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "services/follow/audience/writer.hpp"
#include "services/program/configuration/common.hpp"
#include "services/program/logging/log.hpp"
#include "services/program/metrics/address.hpp"

namespace tandem::relay {

/// One side of a relay.
struct Side {
  std::string url;          ///< of NATS; empty: DDS
  std::string credentials;  ///< file of a NATS user; empty: none
  std::string tls_ca;       ///< file of the authorities that are trusted; empty: the system's
  [[nodiscard]] bool is_dds() const { return url.empty(); }
};

struct RelayOptions {
  std::string session = "default";
  Side from, to;
  std::string folder = {};              ///< for an audience by HTTP, instead of the side `to`; empty: none
  audience::Writer::Options kept = {};  ///< of that folder
  std::string prefer = "bandwidth";     ///< which stream goes there; see CoreOptions
  std::string site;                     ///< of this relay on NATS
  std::uint32_t domain = 0;             ///< of the side that is DDS
  std::string profile = {};             ///< of its network
  std::string secure = {};              ///< folder of an identity for DDS Security
  std::uint32_t client_limit = 256;
  std::string state = {};  ///< file of KeptState, of a side `from` that is NATS; empty: none
  std::size_t log_bytes = 64U << 20U;
  std::optional<metrics::Address> metrics;  ///< empty: none are served
  logging::LogOptions log;
  [[nodiscard]] bool serves_dds() const { return folder.empty() && to.is_dds(); }
};

/// Prints help, version and errors itself.
[[nodiscard]] configuration::Parsed<RelayOptions> parse_command_line(int argc, const char* const* argv);

}  // namespace tandem::relay
