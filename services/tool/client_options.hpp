#pragma once
// How a headless client comes to its session, over DDS or over a gateway, and which stream it plays.

#include "services/tool/endpoint_options.hpp"
#include "services/tool/headless_client.hpp"

namespace tandem::tool {

/// `client` outlives `command`.
inline void add_client_options(commandline::Command command, HeadlessOptions& client) {
  add_domain_options(command, client.domain, client.profile);
  command
      .add_option("--session", client.session,
                  "Session name (default: `default`; with --url the gateway's session)")
      .check(refusal_of_session);
  add_secure_option(command, client.secure);
  command
      .add_option(
          "--url", client.url,
          "Join over a gateway instead of DDS: wss://HOST[:PORT]/ or ws://HOST[:PORT]/, also the address of "
          "its page, whose token may stand behind #. --domain and --profile are then not used")
      .excludes({"--secure"});
  command.add_option("--token-file", client.token_file, "With --url: file with the token for the gateway")
      .existing_file();
  command
      .add_option("--tls-ca", client.tls_ca,
                  "With --url: PEM file that the gateway's certificate is checked by (default: the system's)")
      .existing_file();
  add_prefer_option(command, client.prefer);
}

}  // namespace tandem::tool
