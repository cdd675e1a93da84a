#include "sdk/transport/websocket/gateway_link.hpp"

#include <libwebsockets.h>
#include <pthread.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <random>
#include <thread>
#include <utility>
#include <vector>

#include "sdk/wire/plain_text.hpp"

namespace tandem::transport {
namespace {

constexpr const char* kSubprotocol = "tandem.4";  // its number is protocol_version
constexpr lws_usec_t kFirstRetryUs = 250'000, kLastRetryUs = 5'000'000;
// As long as a gateway can give what was missed (idl/STATES.md, "The gateway"), attempts are no rarer than
// this.
constexpr lws_usec_t kHopeUs = 30'000'000, kLastRetryInHopeUs = 1'000'000;
constexpr unsigned kMaxDescriptors = 8;  // of libwebsockets: the connection, a pipe to wake it
constexpr std::size_t kReceiveBytes = 65'536;
constexpr int kHandshakeSeconds = 10;
constexpr std::size_t kMaxCloseReasonBytes = 160;
// A gateway is silent while its session is idle. It then gets a ping, and counts as lost if it does not
// answer.
constexpr lws_retry_bo_t kIdlePolicy{.retry_ms_table = nullptr,
                                     .retry_ms_table_count = 0,
                                     .conceal_count = 0,
                                     .secs_since_valid_ping = 5,
                                     .secs_since_valid_hangup = 10,
                                     .jitter_percent = 0};

/// The file with the certificates of authorities that this system trusts; empty: none was found.
std::string system_authorities() {
  if (const char* named = std::getenv("SSL_CERT_FILE")) return named;
  constexpr std::array<const char*, 3> kUsual{"/etc/ssl/certs/ca-certificates.crt",  // Debian, Arch, Alpine
                                              "/etc/pki/tls/certs/ca-bundle.crt",    // Fedora
                                              "/etc/ssl/ca-bundle.pem"};             // SUSE
  const auto found =
      std::find_if(kUsual.begin(), kUsual.end(), [](const char* path) { return access(path, R_OK) == 0; });
  return found != kUsual.end() ? *found : "";
}

/// Reads no more than the first line of a certificate: libwebsockets takes a file without one as it is.
Result<void> check_authorities(const std::string& path) {
  if (path.empty())
    return fail(ErrorCode::kIo, "this system has no file of trusted certificates: name one (tls_ca)");
  std::ifstream file(path);
  if (!file) return fail(ErrorCode::kIo, "cannot read the file of trusted certificates " + path);
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("-----BEGIN CERTIFICATE-----") ||
        line.starts_with("-----BEGIN TRUSTED CERTIFICATE-----"))
      return {};
  }
  return fail(ErrorCode::kIo, "no certificate (PEM) is in " + path);
}

/// Signals stay with the threads of the application, while this one makes a thread of ours.
class SignalsBlocked {
 public:
  SignalsBlocked() {
    sigset_t all;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before_);
  }
  ~SignalsBlocked() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  SignalsBlocked(const SignalsBlocked&) = delete;
  SignalsBlocked& operator=(const SignalsBlocked&) = delete;

 private:
  sigset_t before_{};
};

/// lws_create_context() ignores SIGPIPE for the whole process, which is the application's affair. Our thread
/// blocks all signals, so it needs no such help.
lws_context* create_context(const lws_context_creation_info& info) {
  struct sigaction before {};
  sigaction(SIGPIPE, nullptr, &before);
  lws_set_log_level(0, nullptr);
  lws_context* const made = lws_create_context(&info);
  sigaction(SIGPIPE, &before, nullptr);
  return made;
}

}  // namespace

struct GatewayLink::Impl {
  Impl(WebAddress to, std::size_t most, LinkHandler the_handler)
      : address(std::move(to)),
        host_header(address.host.find(':') == std::string::npos ? address.host : "[" + address.host + "]"),
        most_bytes(most),
        handler(std::move(the_handler)) {
    if (address.port != (address.encrypted ? 443 : 80)) host_header += ":" + std::to_string(address.port);
  }
  ~Impl() {
    ending = true;
    if (thread.joinable()) {
      lws_cancel_service(context);
      thread.join();
    }
    if (context != nullptr) lws_context_destroy(context);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  static int on_event(lws* wsi, lws_callback_reasons reason, void* user, void* in, std::size_t len);
  Result<void> open(const std::string& authorities);
  void work();
  void connect();
  int add_token(lws* wsi, void* in, std::size_t len);
  int receive(lws* wsi, const void* in, std::size_t len);
  int write(lws* wsi);
  void hear_close(const void* in, std::size_t len);
  void fail_to_connect(lws* wsi, const void* in, std::size_t len);
  /// `refused`: the gateway is there, and does not want this client now.
  void close(std::string why, bool refused);

  struct Retry {
    lws_sorted_usec_list_t sul{};
    Impl* link = nullptr;
  };

  const WebAddress address;
  std::string host_header;
  const std::size_t most_bytes;
  const LinkHandler handler;
  const std::array<lws_protocols, 2> protocols{
      {{kSubprotocol, on_event, 0, kReceiveBytes, 0, nullptr, 0}, {nullptr, nullptr, 0, 0, 0, nullptr, 0}}};
  lws_context* context = nullptr;
  lws* connection = nullptr;
  bool trying = false;  // from connect() to close()
  bool is_open = false;
  std::vector<std::byte> message;       // the received part of the current one
  std::vector<unsigned char> outgoing;  // with libwebsockets' headroom
  std::string farewell;                 // what the gateway said when it closed
  lws_usec_t retry_us = kFirstRetryUs, hope_until_us = 0;
  Retry retry;
  std::mt19937_64 random{std::random_device{}()};
  std::atomic<bool> ending = false;
  std::thread thread;
};

Result<void> GatewayLink::Impl::open(const std::string& authorities) {
  lws_context_creation_info info{};
  info.port = CONTEXT_PORT_NO_LISTEN;
  info.protocols = protocols.data();
  info.user = this;
  info.fd_limit_per_thread = kMaxDescriptors;
  info.timeout_secs = kHandshakeSeconds;
  info.gid = -1;
  info.uid = -1;
  const std::string file = authorities.empty() ? system_authorities() : authorities;
  if (address.encrypted) {
    if (auto good = check_authorities(file); !good) return good;
    info.options = LWS_SERVER_OPTION_DO_SSL_GLOBAL_INIT;
    info.client_ssl_ca_filepath = file.c_str();
  }
  context = create_context(info);
  if (context == nullptr) {
    return fail(ErrorCode::kTransport, address.encrypted ? "libwebsockets could not start with " + file
                                                         : "libwebsockets could not start");
  }
  const SignalsBlocked blocked;
  thread = std::thread([this] { work(); });
  return {};
}

void GatewayLink::Impl::work() {
  connect();
  while (!ending && lws_service(context, 0) >= 0) {
  }
}

void GatewayLink::Impl::connect() {
  farewell.clear();
  message.clear();
  lws_client_connect_info info{};
  info.context = context;
  info.address = address.host.c_str();
  info.port = address.port;
  info.path = address.path.c_str();
  info.host = host_header.c_str();
  info.protocol = kSubprotocol;
  info.local_protocol_name = kSubprotocol;
  info.retry_and_idle_policy = &kIdlePolicy;
  info.pwsi = &connection;
  if (address.encrypted) {
    info.ssl_connection = LCCSCF_USE_SSL;
    info.alpn = "http/1.1";
  }
  trying = true;
  // The callback may have told of the error already.
  if (lws_client_connect_via_info(&info) == nullptr && trying)
    close("no gateway answers at " + address.text(), false);
}

void GatewayLink::Impl::close(std::string why, bool refused) {
  connection = nullptr;
  is_open = trying = false;
  if (ending) return;
  if (handler.was_useful()) {
    retry_us = kFirstRetryUs;
    hope_until_us = lws_now_usecs() + kHopeUs;
  }
  if (refused) hope_until_us = 0;
  handler.closed(std::move(why));
  // Half of the wait is random, so that the clients of a gateway that comes back do not come at once.
  const lws_usec_t most_us =
      std::min(retry_us, lws_now_usecs() < hope_until_us ? kLastRetryInHopeUs : kLastRetryUs);
  const lws_usec_t wait_us = std::uniform_int_distribution<lws_usec_t>(most_us / 2, most_us)(random);
  retry_us = std::min(2 * retry_us, kLastRetryUs);
  retry.link = this;
  lws_sul_schedule(
      context, 0, &retry.sul,
      [](lws_sorted_usec_list_t* sul) { lws_container_of(sul, Retry, sul)->link->connect(); }, wait_us);
}

int GatewayLink::Impl::add_token(lws* wsi, void* in, std::size_t len) {
  if (address.token.empty()) return 0;
  const std::string value = "Bearer " + address.token;
  auto** const at = static_cast<unsigned char**>(in);
  return lws_add_http_header_by_name(wsi, reinterpret_cast<const unsigned char*>("authorization:"),
                                     reinterpret_cast<const unsigned char*>(value.data()),
                                     static_cast<int>(value.size()), at, *at + len);
}

int GatewayLink::Impl::receive(lws* wsi, const void* in, std::size_t len) {
  const auto* const bytes = static_cast<const std::byte*>(in);
  if (lws_frame_is_binary(wsi) == 0 || message.size() + len > most_bytes) {
    farewell = "the gateway at " + address.text() + " sent a message that is none of the protocol's";
    return -1;
  }
  lws_validity_confirmed(wsi);
  message.insert(message.end(), bytes, bytes + len);
  if (lws_is_final_fragment(wsi) == 0 || lws_remaining_packet_payload(wsi) != 0) return 0;
  handler.received(message);
  message.clear();
  return 0;
}

int GatewayLink::Impl::write(lws* wsi) {
  const auto next = handler.next_message();
  if (!next) return 0;
  outgoing.resize(LWS_PRE + next->size());
  std::transform(next->begin(), next->end(), outgoing.begin() + LWS_PRE,
                 [](std::byte b) { return std::to_integer<unsigned char>(b); });
  if (lws_write(wsi, outgoing.data() + LWS_PRE, next->size(), LWS_WRITE_BINARY) <
      static_cast<int>(next->size()))
    return -1;
  lws_callback_on_writable(wsi);
  return 0;
}

void GatewayLink::Impl::hear_close(const void* in, std::size_t len) {
  const auto* const bytes = static_cast<const unsigned char*>(in);
  if (len < 2) return;
  const unsigned code = bytes[0] * 256U + bytes[1];
  const std::string reason = plain_text({static_cast<const char*>(in) + 2, len - 2}, kMaxCloseReasonBytes);
  farewell = "the gateway at " + address.text() + " ended the connection: " + reason + " (" +
             std::to_string(code) + ")";
}

void GatewayLink::Impl::fail_to_connect(lws* wsi, const void* in, std::size_t len) {
  const unsigned status = lws_http_client_http_response(wsi);
  if (status != 0 && status != 101) {
    constexpr unsigned kNotFound = 404, kBad = 400, kTooMany = 429;
    std::string why = "HTTP " + std::to_string(status);
    if (status == kNotFound) why += ", so no gateway is at this path";
    if (status == kBad) why += ", so it is no gateway or speaks another version of the protocol";
    if (status == kTooMany) why += ", so too many connections come from this address";
    // A proxy says 502 or the like while its gateway is away.
    constexpr unsigned kLeastServerError = 500;
    return close(address.text() + " answers " + why, status < kLeastServerError);
  }
  const std::string detail =
      in != nullptr ? plain_text({static_cast<const char*>(in), len}, kMaxCloseReasonBytes) : std::string();
  if (address.encrypted && detail.find("SSL") != std::string::npos) {
    return close(
        "no TLS with " + address.text() +
            ": its certificate is of no authority that is trusted here (tls_ca), for another host, or expired; or the port speaks no TLS",
        true);
  }
  close("no gateway answers at " + address.text() + (detail.empty() ? "" : " (" + detail + ")"), false);
}

int GatewayLink::Impl::on_event(lws* wsi, lws_callback_reasons reason, void* /*user*/, void* in,
                                std::size_t len) {
  auto* const link = static_cast<Impl*>(lws_context_user(lws_get_context(wsi)));
  if (link == nullptr) return 0;
  switch (reason) {
    case LWS_CALLBACK_CLIENT_APPEND_HANDSHAKE_HEADER:
      return link->add_token(wsi, in, len);
    case LWS_CALLBACK_CLIENT_ESTABLISHED:
      link->is_open = true;
      link->handler.opened();
      lws_callback_on_writable(wsi);
      return 0;
    case LWS_CALLBACK_CLIENT_RECEIVE:
      return link->receive(wsi, in, len);
    case LWS_CALLBACK_CLIENT_WRITEABLE:
      return link->write(wsi);
    case LWS_CALLBACK_WS_PEER_INITIATED_CLOSE:
      link->hear_close(in, len);
      return 0;
    case LWS_CALLBACK_CLIENT_CONNECTION_ERROR:
      link->fail_to_connect(wsi, in, len);
      return 0;
    case LWS_CALLBACK_CLIENT_CLOSED:
      link->close(
          link->farewell.empty() ? "the connection to " + link->address.text() + " was lost" : link->farewell,
          !link->farewell.empty());
      return 0;
    case LWS_CALLBACK_EVENT_WAIT_CANCELLED:
      if (link->is_open) lws_callback_on_writable(link->connection);
      return 0;
    default:
      return 0;
  }
}

Result<std::unique_ptr<GatewayLink>> GatewayLink::start(WebAddress address, const std::string& authorities,
                                                        std::size_t most_message_bytes, LinkHandler handler) {
  auto impl = std::make_unique<Impl>(std::move(address), most_message_bytes, std::move(handler));
  if (auto opened = impl->open(authorities); !opened) return tl::unexpected<Error>(opened.error());
  return std::unique_ptr<GatewayLink>(new GatewayLink(std::move(impl)));
}

GatewayLink::GatewayLink(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
GatewayLink::~GatewayLink() = default;

void GatewayLink::notify() { lws_cancel_service(impl_->context); }

}  // namespace tandem::transport
