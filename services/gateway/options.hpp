#pragma once
// The options of tandem-gateway, checked and complete.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "services/gateway/gateway.hpp"
#include "services/gateway/web_server.hpp"
#include "services/program/configuration/common.hpp"
#include "services/program/logging/log.hpp"
#include "services/program/metrics/address.hpp"

namespace tandem::gateway {

struct GatewayOptions {
  std::uint32_t domain = 0;
  std::string profile = {};  ///< of the network (deploy/dds); empty: CYCLONEDDS_URI decides
  std::string session = "default";
  std::string from;  ///< NATS servers of a relay; empty: DDS
  std::string from_credentials,
      from_ca;                       ///< files for NATS: its user, the authorities; empty: none, the system's
  std::string site;                  ///< of this gateway on NATS
  std::string state;                 ///< file of KeptState, with `from`; empty: none
  std::string secure;                ///< folder of its identity for DDS Security; empty: none
  std::string prefer = "computing";  ///< chooses the stream that all viewers play; see CoreOptions
  WebOptions web;
  Limits limits;
  std::string viewer;                   ///< folder of its files; empty: none
  std::string token_file;               ///< a text that lets viewers act; empty: none
  std::vector<std::string> token_keys;  ///< files with public keys of signed tokens
  std::vector<std::string> origins;
  std::optional<metrics::Address> metrics;  ///< empty: none are served
  logging::LogOptions log;
};

/// Prints help, version and errors itself.
[[nodiscard]] configuration::Parsed<GatewayOptions> parse_command_line(int argc, const char* const* argv);

}  // namespace tandem::gateway
