#pragma once
// Options that several commands share: --domain, --profile, --session and --secure of those that use DDS,
// --prefer of clients, --nats of those that look at NATS servers instead.

#include <fmt/format.h>

#include <cstdint>
#include <string>

#include "sdk/transport/dds/dds_ports.hpp"
#include "sdk/transport/nats/nats_bus.hpp"
#include "sdk/transport/nats/site_name.hpp"
#include "sdk/wire/port.hpp"
#include "services/program/commandline/commandline.hpp"
#include "services/tool/print_error.hpp"

namespace tandem::tool {

/// --domain and --profile. Both outlive `command`.
inline void add_domain_options(commandline::Command command, std::uint32_t& domain, std::string& profile,
                               transport::Side side = transport::Side::kClient) {
  command.add_option("--domain", domain, "DDS domain").range(0U, transport::kMaxDomain).show_default();
  command.add_option("--profile", profile, transport::kProfileHelp).check([side](const std::string& text) {
    return transport::refusal_of_profile(text, side);
  });
}

/// Why the text is no session's name; empty: it is one.
inline std::string refusal_of_session(const std::string& name) {
  const auto ok = transport::check_session_name(name);
  return ok ? std::string() : ok.error().message;
}

/// These and --session. All outlive `command`.
inline void add_endpoint_options(commandline::Command command, std::uint32_t& domain, std::string& profile,
                                 std::string& session, transport::Side side = transport::Side::kClient) {
  add_domain_options(command, domain, profile, side);
  command.add_option("--session", session, "Session name").check(refusal_of_session).show_default();
}

/// `secure` outlives `command`.
inline void add_secure_option(commandline::Command command, std::string& secure) {
  command
      .add_option(
          "--secure", secure,
          "Folder of this program's identity for DDS Security, made by `tandem pki issue`; those without one "
          "are then strangers")
      .not_empty();
}

/// Says on stderr what the profile uses, if there is one. Call it when the domain is open.
inline void tell_profile(const char* program, std::uint32_t domain, const std::string& profile,
                         transport::Side side = transport::Side::kClient) {
  if (!profile.empty())
    print_error(fmt::format("{}: {}\n", program, transport::describe_dds_profile(domain, profile, side)));
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

struct NatsFlags {
  std::string url;  ///< empty: DDS
  std::string credentials, tls_ca;
  std::string site = transport::nats::default_site_name();

  [[nodiscard]] transport::NatsOptions connection(const char* program) const {
    return {.url = url, .name = program, .credentials = credentials, .tls_ca = tls_ca};
  }
};

/// `flags` outlives `command`, which has --domain, --profile and --secure.
inline void add_nats_options(commandline::Command command, NatsFlags& flags, const std::string& what) {
  const commandline::Option nats =
      command
          .add_option("--nats", flags.url,
                      "NATS servers (nats:// or tls://, divided by commas) " + what + " instead of DDS")
          .check([](const std::string& text) {
            return transport::is_nats_url(text) ? std::string() : "expected nats:// or tls://";
          })
          .excludes({"--domain", "--profile", "--secure"});
  command.add_option("--nats-credentials", flags.credentials, "File of a NATS user (.creds)")
      .not_empty()
      .needs(nats);
  command
      .add_option("--nats-ca", flags.tls_ca, "File with the authorities that are trusted, PEM [the system's]")
      .not_empty()
      .needs(nats);
  command
      .add_option("--site", flags.site,
                  "Name of this site on NATS, which its NATS user is permitted [the host's name]")
      .check(transport::nats::refusal_of_site_name)
      .needs(nats);
}

}  // namespace tandem::tool
