#pragma once
// --domain and --session, as every command that speaks DDS has them, and what clients have.

#include <cstdint>
#include <string>

#include "sdk/transport/dds/dds_ports.hpp"
#include "sdk/transport/port.hpp"
#include "services/commandline/commandline.hpp"

namespace tandem::tool {

/// Both outlive `command`.
inline void add_endpoint_options(commandline::Command command, std::uint32_t& domain, std::string& session) {
  command.add_option("--domain", domain, "DDS domain").range(0U, transport::kMaxDomain).show_default();
  command.add_option("--session", session, "Session name")
      .check([](const std::string& name) {
        const auto ok = transport::check_session_name(name);
        return ok ? std::string() : ok.error().message;
      })
      .show_default();
}

/// --prefer, of what a client is told. Outlives `command`.
inline void add_prefer_option(commandline::Command command, std::string& prefer) {
  command
      .add_option(
          "--prefer", prefer,
          "Of a session's streams: auto (fewest bits, where they are cheap to follow), bandwidth (fewest "
          "bits), computing (cheapest), error (smallest), or a name")
      .show_default();
}

}  // namespace tandem::tool
