#include "sdk/client/api/ports.hpp"

#ifdef TANDEM_WITH_DDS
#include "sdk/transport/dds/dds_ports.hpp"
#endif
#ifdef TANDEM_WITH_WEBSOCKET
#include "sdk/transport/websocket/websocket_port.hpp"
#endif

namespace tandem::api {
namespace {

using Port = Result<std::unique_ptr<transport::ClientPort>>;

std::string text(const char* option) { return option != nullptr ? option : ""; }

#ifdef TANDEM_WITH_DDS
static_assert(kMaxDomain == transport::kMaxDomain);

Port open_dds(const tandem_options& options, const std::string& session, transport::ClientId client) {
  transport::DdsOptions dds;
  dds.domain = options.domain;
  dds.profile = text(options.profile);
  dds.session = session;
  dds.client = client;
  dds.secure = text(options.secure);
  dds.acts = options.role == TANDEM_PARTICIPANT;
  if (options.role == TANDEM_OBSERVER) dds.lease = transport::DdsOptions::kObserverLease;
  return transport::make_dds_client_port(dds);
}
#else
Port open_dds(const tandem_options& /*options*/, const std::string& /*session*/,
              transport::ClientId /*client*/) {
  return fail(ErrorCode::kUnsupported, "this library was built without DDS: join by a url");
}
#endif

#ifdef TANDEM_WITH_WEBSOCKET
Port open_websocket(const tandem_options& options) {
  return transport::make_websocket_client_port(
      {.url = text(options.url), .token = text(options.token), .tls_ca = text(options.tls_ca)});
}
#else
Port open_websocket(const tandem_options& /*options*/) {
  return fail(ErrorCode::kUnsupported, "this library was built without libwebsockets: join over DDS");
}
#endif

}  // namespace

Port open_port(const tandem_options& options, const std::string& session, transport::ClientId client) {
  return options.url != nullptr ? open_websocket(options) : open_dds(options, session, client);
}

}  // namespace tandem::api
