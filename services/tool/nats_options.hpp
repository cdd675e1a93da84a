#pragma once
// --nats and what belongs to it, of `tandem top` and `tandem doctor`.

#include <string>

#include "sdk/transport/nats/nats_bus.hpp"
#include "sdk/transport/nats/site_name.hpp"
#include "services/commandline/commandline.hpp"

namespace tandem::tool {

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
  command.add_option("--nats-credentials", flags.credentials, "File of a NATS user (.creds)").needs(nats);
  command
      .add_option("--nats-ca", flags.tls_ca, "File with the authorities that are trusted, PEM [the system's]")
      .needs(nats);
  command
      .add_option("--site", flags.site,
                  "Name of this site on NATS, which its NATS user is permitted [the host's name]")
      .check(transport::nats::refusal_of_site_name)
      .needs(nats);
}

}  // namespace tandem::tool
