#pragma once
// Options that several commands share: --domain, --session and --secure of those that use DDS, --prefer of
// clients.

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

/// `secure` outlives `command`.
inline void add_secure_option(commandline::Command command, std::string& secure) {
  command.add_option(
      "--secure", secure,
      "Folder of this program's identity for DDS Security, made by `tandem pki issue`; those without one "
      "are then strangers");
}

/// `prefer` outlives `command`.
inline void add_prefer_option(commandline::Command command, std::string& prefer) {
  command
      .add_option(
          "--prefer", prefer,
          "The stream to play: `auto` takes the fewest bits that this machine can follow, `bandwidth` the "
          "fewest bits, `computing` the cheapest predicted step, `error` the smallest error; or a stream's "
          "name")
      .show_default();
}

}  // namespace tandem::tool
