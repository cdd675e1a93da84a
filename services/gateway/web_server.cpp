#include "services/gateway/web_server.hpp"

#include <fmt/format.h>
#include <libwebsockets.h>
#include <strings.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <unordered_map>
#include <utility>

#include "sdk/wire/clock.hpp"
#include "sdk/wire/units.hpp"
#include "services/gateway/entrance/certificate.hpp"
#include "services/gateway/entrance/listener.hpp"
#include "services/gateway/entrance/visits.hpp"
#include "services/gateway/service.hpp"
#include "services/gateway/web_connection.hpp"
#include "services/gateway/web_request.hpp"
#include "services/program/system/descriptor.hpp"

namespace tandem::gateway {
namespace {

static_assert(Outgoing::kHeadroom >= LWS_PRE);

constexpr const char* kSubprotocol = "tandem.4";
constexpr std::string_view kPath = "/tandem";
constexpr std::size_t kChunkBytes = std::size_t{16} << 10U;  // of a file
constexpr int kRefusedSeconds = 5, kFileSeconds = 30;
// Taken or turned away at once, before those that are in are served.
constexpr int kArrivalsAtOnce = 128;
// Told by HTTP that they are turned away, a second; the rest just end.
constexpr accounts::TokenBucket kTold{20, 20};
constexpr unsigned kTooManyRequests = 429;
constexpr std::size_t kOwnDescriptors = 16;  // of libwebsockets: the listener, pipes
constexpr std::size_t kMaxHeaderBytes = 2048;
// A silent connection gets a ping, and is ended if it does not answer.
constexpr lws_retry_bo_t kIdlePolicy{.retry_ms_table = nullptr,
                                     .retry_ms_table_count = 0,
                                     .conceal_count = 0,
                                     .secs_since_valid_ping = 15,
                                     .secs_since_valid_hangup = 45,
                                     .jitter_percent = 0};

using transport::steady_ns;
using transport::wall_s;

}  // namespace

struct WebServer::Impl {
  Impl(const WebOptions& options, Listener the_listener, const Site& the_site, Service& the_service)
      : site(the_site),
        service(the_service),
        listener(std::move(the_listener)),
        visits(options.address_limits, options.connections, options.trusted_proxies),
        encrypted(!options.tls_cert.empty()),
        tls_cert(options.tls_cert),
        tls_key(options.tls_key),
        heads(options.origins) {}
  ~Impl() {
    if (context != nullptr) lws_context_destroy(context);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  Impl(Impl&&) = delete;
  Impl& operator=(Impl&&) = delete;

  static Impl& of(lws* wsi) { return *static_cast<Impl*>(lws_context_user(lws_get_context(wsi))); }
  static int on_http(lws* wsi, lws_callback_reasons reason, void* user, void* in, std::size_t len);
  static int on_socket(lws* wsi, lws_callback_reasons reason, void* user, void* in, std::size_t len);
  static void on_tick(lws_sorted_usec_list_t* sul);

  // Arrivals
  void take_arrivals();
  void arrive(system::Descriptor connection, const sockaddr_storage& peer);
  void turn_away(const system::Descriptor& connection, TurnedAway why);
  static Visit& visit(lws* wsi) { return *static_cast<Visit*>(lws_get_opaque_user_data(wsi)); }
  void ask(lws* wsi) { visits.ask(visit(wsi), header(wsi, WSI_TOKEN_X_FORWARDED_FOR)); }
  void end_unwanted(std::int64_t now_ns);

  // HTTP
  int respond(lws* wsi, void* user, std::string_view path);
  int send_head(lws* wsi, void* user, unsigned status, std::string_view type, std::string_view cache,
                bool compressed, std::string_view cookie = {});
  int log_in(lws* wsi, void* user);
  int send_body(lws* wsi, void* user);
  static int complete(lws* wsi, const Exchange& exchange);
  static int confirm_upgrade(lws* wsi);

  // WebSocket
  int open(lws* wsi, void* user);
  int established(lws* wsi, Connection& connection);
  int receive(lws* wsi, Connection& connection, const void* in, std::size_t len);
  int write(lws* wsi, Connection& connection);
  static int end(lws* wsi, Refusal refusal, std::string reason = {});
  void ask_to_write();
  void let_go();
  void end_viewer(ViewerId id, Refusal why, std::string reason = {});
  void end_silent();
  void end_over_cap();
  void end_over();
  [[nodiscard]] Result<std::string> read_certificate();

  struct Tick {
    lws_sorted_usec_list_t sul{};  // first, because libwebsockets hands back its address
    Impl* self = nullptr;
  };

  const Site& site;
  Service& service;
  Listener listener;
  Visits visits;
  const bool encrypted;
  const std::string tls_cert, tls_key;
  const SafeHeads heads;
  ssl_ctx_st* tls = nullptr;  // of libwebsockets
  accounts::TokenBucket told = kTold;
  lws_vhost* vhost = nullptr;
  lws* entrance = nullptr;  // of the listener
  int ticks = 0;
  lws_context* context = nullptr;
  std::array<lws_protocols, 3> protocols{};
  std::unordered_map<ViewerId, lws*> connections;
  std::vector<ViewerId> ids;   // kept to reuse its memory
  std::vector<Visit*> listed;  // likewise
  Tick tick;
};

void WebServer::Impl::take_arrivals() {
  for (int i = 0; i < kArrivalsAtOnce; ++i) {
    Listener::Accepted got = listener.accept();
    if (got.outcome == Listener::Outcome::kNothing) return;
    if (got.outcome == Listener::Outcome::kConnection) {
      arrive(std::move(got.connection), got.peer);
      continue;
    }
    service.turned_away(TurnedAway::kDescriptors);
    if (i + 1 < kArrivalsAtOnce) continue;
    lws_rx_flow_control(entrance, 0);  // until the next tick
  }
}

void WebServer::Impl::arrive(system::Descriptor connection, const sockaddr_storage& peer) {
  const auto key = address_key(reinterpret_cast<const sockaddr&>(peer)).value_or(AddressKey{});
  const auto arrived = visits.arrive(key, steady_ns());
  if (!arrived) return turn_away(connection, arrived.error());
  lws_adopt_desc_t adopt{};
  adopt.vh = vhost;
  adopt.type = static_cast<lws_adoption_type>(LWS_ADOPT_SOCKET | LWS_ADOPT_HTTP | LWS_ADOPT_ALLOW_SSL);
  adopt.fd.sockfd = connection.release();  // closed by libwebsockets, also if it refuses it
  adopt.opaque = *arrived;
  lws* const wsi = lws_adopt_descriptor_vhost_via_info(&adopt);
  if (wsi != nullptr) {
    (*arrived)->wsi = wsi;
  } else {
    visits.leave(*arrived);  // unless that has happened
  }
}

void WebServer::Impl::turn_away(const system::Descriptor& connection, TurnedAway why) {
  service.turned_away(why);
  if (!encrypted && told.take(steady_ns())) say_too_many(connection);
}

void WebServer::Impl::end_unwanted(std::int64_t now_ns) {
  visits.list_waiting(listed);
  for (const Visit* const by : listed) lws_callback_on_writable(by->wsi);
  const auto end_listed = [&](TurnedAway why, bool also_greeted) {
    for (const Visit* const by : listed) {
      if (also_greeted || !by->greeted) service.turned_away(why);
      lws_set_timeout(by->wsi, PENDING_TIMEOUT_CLOSE_SEND, LWS_TO_KILL_ASYNC);
    }
  };
  visits.list_slow(now_ns, listed);
  end_listed(TurnedAway::kSlow, false);
  visits.list_floods(
      now_ns, [](const Visit& by) { return received_bytes(lws_get_socket_fd(by.wsi)); }, listed);
  end_listed(TurnedAway::kBytes, true);
}

int WebServer::Impl::complete(lws* wsi, const Exchange& exchange) {
  if (exchange.last) return -1;
  Visits::answered(visit(wsi), steady_ns());
  return lws_http_transaction_completed(wsi) != 0 ? -1 : 0;
}

int WebServer::Impl::send_head(lws* wsi, void* user, unsigned status, std::string_view type,
                               std::string_view cache, bool compressed, std::string_view cookie) {
  std::array<unsigned char, LWS_PRE + kMaxHeaderBytes> buffer{};
  unsigned char* const start = buffer.data() + LWS_PRE;
  unsigned char* const end = buffer.data() + buffer.size() - 1;
  unsigned char* at = start;
  const auto add = [&](const char* name, std::string_view value) {
    return lws_add_http_header_by_name(wsi, reinterpret_cast<const unsigned char*>(name),
                                       reinterpret_cast<const unsigned char*>(value.data()),
                                       static_cast<int>(value.size()), &at, end) == 0;
  };
  const Exchange& exchange = *slot<Exchange>(user);
  const bool strict = encrypted && !is_address(header(wsi, WSI_TOKEN_HOST));
  const bool good = lws_add_http_common_headers(wsi, status, std::string(type).c_str(), exchange.body.size(),
                                                &at, end) == 0 &&
                    add("cache-control:", cache) && (!compressed || add("content-encoding:", "gzip")) &&
                    (cookie.empty() || add("set-cookie:", cookie)) &&
                    (status != HTTP_STATUS_UNAUTHORIZED || add("www-authenticate:", kChallenge)) &&
                    (!exchange.last || add("connection:", "close")) &&
                    (!strict || add("strict-transport-security:", kStrictTransport)) &&
                    lws_finalize_write_http_header(wsi, start, &at, end) == 0;
  if (!good) return -1;
  if (lws_hdr_total_length(wsi, WSI_TOKEN_HEAD_URI) > 0 || exchange.body.empty())
    return complete(wsi, exchange);
  lws_callback_on_writable(wsi);
  return 0;
}

// The page hands over the token of its address, and has the browser show it from then on. Only by a header
// that a link or a picture on a page of another site cannot send: otherwise that page could have browsers
// show a token of its own choice.
int WebServer::Impl::log_in(lws* wsi, void* user) {
  Exchange& exchange = *slot<Exchange>(user);
  const std::string token = header_token_of(wsi);
  const auto pass = service.log_in({.origin = header(wsi, WSI_TOKEN_ORIGIN),
                                    .host = header(wsi, WSI_TOKEN_HOST),
                                    .token = token,
                                    .address = address_text(visit(wsi).client),
                                    .inputs = {}});
  if (!pass) {
    exchange.own = std::string(closing(pass.error()).reason) + '\n';
  } else {
    exchange.own = pass->may_act ? "act\n" : "watch\n";
  }
  exchange.body = exchange.own;
  if (!pass) return send_head(wsi, user, HTTP_STATUS_UNAUTHORIZED, "text/plain", "no-store", false);
  const bool safe = encrypted || (visits.is_trusted(visit(wsi).peer) && proxy_says_https(wsi));
  const std::int64_t lasts_s = pass->over_s == 0 ? 0 : std::max<std::int64_t>(pass->over_s - wall_s(), 1);
  const std::string cookie = pass->key == 0 ? "" : cookie_of(wsi, token, lasts_s, safe);
  return send_head(wsi, user, HTTP_STATUS_OK, "text/plain", "no-store", false, cookie);
}

int WebServer::Impl::respond(lws* wsi, void* user, std::string_view path) {
  drop<Exchange>(user);
  Exchange& exchange = *(slot<Exchange>(user) = new Exchange());
  const auto say = [&](unsigned status, std::string text, std::string_view type) {
    exchange.own = std::move(text);
    exchange.body = exchange.own;
    return send_head(wsi, user, status, type, "no-store", false);
  };
  // Nobody here reads a body. libwebsockets would take one that comes in chunks for the next request, and a
  // proxy in front of it would then give that one's answer to somebody else. Behind a header whose name is
  // the beginning of another's (as X-A: of X-Auth-Token:) libwebsockets 4.1 even overlooks the next one, such
  // as Transfer-Encoding; so through a proxy every request is the last of its connection.
  exchange.last = has_body(wsi) || visits.is_trusted(visit(wsi).peer);
  const bool reads =
      lws_hdr_total_length(wsi, WSI_TOKEN_GET_URI) > 0 || lws_hdr_total_length(wsi, WSI_TOKEN_HEAD_URI) > 0;
  if (!visit(wsi).account->requests.take(steady_ns())) {
    service.turned_away(TurnedAway::kRequests);
    exchange.last = true;  // who sends many at once is not answered each
    return say(kTooManyRequests, "too many requests from your address\n", "text/plain");
  }
  if (!reads) return say(HTTP_STATUS_METHOD_NOT_ALLOWED, "GET only\n", "text/plain");
  if (path == "/healthz") {
    Service::Health health = service.health();
    return say(health.good ? HTTP_STATUS_OK : HTTP_STATUS_SERVICE_UNAVAILABLE, std::move(health.json),
               "application/json");
  }
  if (path == "/login") return log_in(wsi, user);
  const Site::File* file = site.find(path);
  if (file == nullptr && path == "/" && site.empty())
    return say(HTTP_STATUS_NOT_FOUND, std::string(kNoPage) + '\n', "text/plain");
  if (file == nullptr) return say(HTTP_STATUS_NOT_FOUND, "not found\n", "text/plain");
  const bool compressed =
      !file->gzip.empty() && header(wsi, WSI_TOKEN_HTTP_ACCEPT_ENCODING).find("gzip") != std::string::npos;
  exchange.body = compressed ? file->gzip : file->bytes;
  return send_head(wsi, user, HTTP_STATUS_OK, file->type,
                   file->immutable ? "public, max-age=31536000, immutable" : "no-cache", compressed);
}

int WebServer::Impl::send_body(lws* wsi, void* user) {
  if (user == nullptr || slot<Exchange>(user) == nullptr) return 0;
  Exchange& exchange = *slot<Exchange>(user);
  Visit& by = visit(wsi);
  lws_set_timeout(wsi, PENDING_TIMEOUT_HTTP_CONTENT, kFileSeconds);
  by.waits_for_bytes = !by.account->bytes.has(steady_ns());
  if (by.waits_for_bytes) return 0;
  std::array<unsigned char, LWS_PRE + kChunkBytes> buffer{};
  const std::size_t size = std::min(exchange.body.size(), kChunkBytes);
  std::memcpy(buffer.data() + LWS_PRE, exchange.body.data(), size);
  exchange.body.remove_prefix(size);
  const bool last = exchange.body.empty();
  by.account->bytes.spend(static_cast<double>(size));
  if (lws_write(wsi, buffer.data() + LWS_PRE, size, last ? LWS_WRITE_HTTP_FINAL : LWS_WRITE_HTTP) <
      static_cast<int>(size))
    return -1;
  if (last) return complete(wsi, exchange);
  lws_callback_on_writable(wsi);
  return 0;
}

int WebServer::Impl::on_http(lws* wsi, lws_callback_reasons reason, void* user, void* in, std::size_t len) {
  switch (reason) {
    case LWS_CALLBACK_OPENSSL_LOAD_EXTRA_SERVER_VERIFY_CERTS:
      of(wsi).tls = static_cast<ssl_ctx_st*>(user);
      return 0;
    case LWS_CALLBACK_RAW_RX_FILE:
      of(wsi).take_arrivals();
      return 0;
    case LWS_CALLBACK_WSI_DESTROY:
      of(wsi).visits.leave(static_cast<const Visit*>(lws_get_opaque_user_data(wsi)));
      return 0;
    case LWS_CALLBACK_HTTP:
      of(wsi).ask(wsi);
      return of(wsi).respond(wsi, user, {static_cast<const char*>(in), len});
    case LWS_CALLBACK_HTTP_WRITEABLE:
      return of(wsi).send_body(wsi, user);
    case LWS_CALLBACK_HTTP_DROP_PROTOCOL:
    case LWS_CALLBACK_CLOSED_HTTP:
      drop<Exchange>(user);
      return 0;
    case LWS_CALLBACK_HTTP_CONFIRM_UPGRADE:
      of(wsi).ask(wsi);
      return confirm_upgrade(wsi);
    case LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION:
      return -1;  // asked for by the name of this protocol
    default:
      return 0;
  }
}

// Only WebSocket: libwebsockets would also upgrade to HTTP/2, whose streams are no connections of ours. And
// without this, a client that asks for another WebSocket would see only that the connection ends.
int WebServer::Impl::confirm_upgrade(lws* wsi) {
  const auto refuse = [&](unsigned status, const char* why) {
    return lws_return_http_status(wsi, status, why) != 0 ? -1 : 1;
  };
  if (strcasecmp(header(wsi, WSI_TOKEN_UPGRADE).c_str(), "websocket") != 0)
    return refuse(HTTP_STATUS_BAD_REQUEST, "there is an upgrade to WebSocket only");
  if (has_body(wsi)) return refuse(HTTP_STATUS_BAD_REQUEST, "a request for a WebSocket has no body");
  if (header(wsi, WSI_TOKEN_GET_URI) != kPath)
    return refuse(HTTP_STATUS_NOT_FOUND, "the WebSocket is at /tandem");
  if (!names(header(wsi, WSI_TOKEN_PROTOCOL), kSubprotocol))
    return refuse(HTTP_STATUS_BAD_REQUEST, "the WebSocket speaks tandem.4 only");
  return 0;
}

// The headers exist only now; a refusal is sent as soon as a close frame can be.
int WebServer::Impl::open(lws* wsi, void* user) {
  Service::Request request{.origin = header(wsi, WSI_TOKEN_ORIGIN),
                           .host = header(wsi, WSI_TOKEN_HOST),
                           .token = token_of(wsi),
                           .address = {},
                           .inputs = {}};
  auto connection = std::make_unique<Connection>();
  Visit& by = visit(wsi);
  const bool may_join = visits.join(by, steady_ns());
  connection->account = by.account;
  request.inputs = {by.account, &by.account->inputs};
  request.address = address_text(by.client);
  if (!may_join) {
    connection->refused = Refusal::kAddressJoins;
    service.refused(*connection->refused);
  } else {
    const auto opened = service.open(request);
    if (const auto* id = std::get_if<ViewerId>(&opened)) {
      connection->id = *id;
    } else {
      connection->refused = std::get<Refusal>(opened);
    }
  }
  slot<Connection>(user) = connection.release();
  return 0;
}

int WebServer::Impl::established(lws* wsi, Connection& connection) {
  keep_little_unsent(lws_get_socket_fd(wsi));
  if (connection.refused) {
    lws_set_timeout(wsi, PENDING_TIMEOUT_CLOSE_SEND, kRefusedSeconds);
  } else {
    connections[connection.id] = wsi;
  }
  lws_callback_on_writable(wsi);
  return 0;
}

// Returns what a callback returns to end the connection.
int WebServer::Impl::end(lws* wsi, Refusal refusal, std::string reason) {
  const Closing& why = closing(refusal);
  if (reason.empty()) reason = why.reason;
  lws_close_reason(wsi, static_cast<lws_close_status>(why.code),
                   reinterpret_cast<unsigned char*>(reason.data()), reason.size());
  return -1;
}

int WebServer::Impl::receive(lws* wsi, Connection& connection, const void* in, std::size_t len) {
  if (connection.refused) return 0;
  if (!connection.account->bytes.has(steady_ns())) {
    service.refused(Refusal::kAddressBytes);
    return end(wsi, Refusal::kAddressBytes);
  }
  connection.account->bytes.spend(static_cast<double>(len));
  if (lws_frame_is_binary(wsi) == 0) return end(wsi, Refusal::kMalformed);
  const auto* const bytes = static_cast<const std::byte*>(in);
  const bool first = lws_is_first_fragment(wsi) != 0;
  if (first) connection.message.clear();
  // One byte more than the limit is enough to refuse the message.
  const std::size_t room = kMaxViewerBytes + 1 - connection.message.size();
  connection.message.insert(connection.message.end(), bytes, bytes + std::min(len, room));
  const bool whole = lws_is_final_fragment(wsi) != 0 && lws_remaining_packet_payload(wsi) == 0;
  if (!whole && connection.message.size() <= kMaxViewerBytes) return 0;
  const auto refusal = service.receive(connection.id, connection.message);
  connection.message.clear();
  return refusal ? end(wsi, *refusal) : 0;
}

int WebServer::Impl::write(lws* wsi, Connection& connection) {
  if (connection.refused) return end(wsi, *connection.refused, std::move(connection.why));
  while (true) {
    const Gateway::Next next = service.next(connection.id);
    if (!next.message) return 0;
    const std::size_t size = next.message->size();
    auto* const bytes = reinterpret_cast<unsigned char*>(next.message->to_send());
    if (lws_write(wsi, bytes, size, LWS_WRITE_BINARY) < static_cast<int>(size)) return -1;
    if (!next.more) return 0;
    if (lws_send_pipe_choked(wsi) != 0) break;
  }
  lws_callback_on_writable(wsi);
  return 0;
}

void WebServer::Impl::ask_to_write() {
  service.list_ready(ids);
  for (const ViewerId id : ids) {
    const auto found = connections.find(id);
    if (found != connections.end()) lws_callback_on_writable(found->second);
  }
}

// A viewer that takes nothing takes no close frame either, so its time is limited.
void WebServer::Impl::end_viewer(ViewerId id, Refusal why, std::string reason) {
  const auto found = connections.find(id);
  if (found == connections.end()) return;
  lws* const wsi = found->second;
  Connection& connection = *slot<Connection>(lws_wsi_user(wsi));
  connection.refused = why;
  connection.why = std::move(reason);
  service.refused(why);
  connections.erase(found);
  service.closed(id);
  lws_set_timeout(wsi, PENDING_TIMEOUT_CLOSE_SEND, kRefusedSeconds);
  lws_callback_on_writable(wsi);
}

void WebServer::Impl::end_silent() {
  service.list_silent(ids);
  for (const ViewerId id : ids) end_viewer(id, Refusal::kSilent);
}

void WebServer::Impl::end_over_cap() {
  std::vector<std::pair<ViewerId, std::string>> over;
  service.list_over_cap(over);
  for (auto& [id, why] : over) end_viewer(id, Refusal::kCap, std::move(why));
}

void WebServer::Impl::end_over() {
  std::vector<std::pair<ViewerId, Refusal>> over;
  service.list_over(over);
  for (const auto& [id, why] : over) end_viewer(id, why);
}

Result<std::string> WebServer::Impl::read_certificate() {
  if (!encrypted) return std::string();
  const auto read = Certificate::read(tls_cert, tls_key, wall_s());
  if (!read) return tl::unexpected(read.error());
  return read->use(tls).map([&] { return read->until(); });
}

// They take no close frame either.
void WebServer::Impl::let_go() {
  service.list_not_reading(ids);
  for (const ViewerId id : ids) {
    const auto found = connections.find(id);
    if (found != connections.end())
      lws_set_timeout(found->second, PENDING_TIMEOUT_CLOSE_SEND, LWS_TO_KILL_ASYNC);
  }
}

int WebServer::Impl::on_socket(lws* wsi, lws_callback_reasons reason, void* user, void* in, std::size_t len) {
  if (reason == LWS_CALLBACK_EVENT_WAIT_CANCELLED) {
    of(wsi).ask_to_write();
    return 0;
  }
  if (reason == LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION) return of(wsi).open(wsi, user);
  if (user == nullptr || slot<Connection>(user) == nullptr) return 0;
  Connection& connection = *slot<Connection>(user);
  switch (reason) {
    case LWS_CALLBACK_ESTABLISHED:
      return of(wsi).established(wsi, connection);
    case LWS_CALLBACK_RECEIVE:
      return of(wsi).receive(wsi, connection, in, len);
    case LWS_CALLBACK_SERVER_WRITEABLE:
      return of(wsi).write(wsi, connection);
    case LWS_CALLBACK_CLOSED:
    case LWS_CALLBACK_WSI_DESTROY:
      if (!connection.refused) {
        of(wsi).connections.erase(connection.id);
        of(wsi).service.closed(connection.id);
      }
      drop<Connection>(user);
      return 0;
    default:
      return 0;
  }
}

void WebServer::Impl::on_tick(lws_sorted_usec_list_t* sul) {
  Impl& self = *reinterpret_cast<Tick*>(sul)->self;
  if (self.service.tick()) self.service.reloaded(self.read_certificate());
  self.ask_to_write();
  self.let_go();
  self.end_silent();
  self.end_over_cap();
  const std::int64_t now_ns = steady_ns();
  self.end_unwanted(now_ns);
  if (self.ticks++ % 10 == 0) {
    self.visits.forget(now_ns);
    self.end_over();
  }
  lws_rx_flow_control(self.entrance, LWS_RXFLOW_REASON_APPLIES_ENABLE | LWS_RXFLOW_REASON_USER_BOOL |
                                         LWS_RXFLOW_REASON_FLAG_PROCESS_NOW);
  lws_sul_schedule(self.context, 0, sul, on_tick, 100 * LWS_US_PER_MS);
}

Result<std::unique_ptr<WebServer>> WebServer::create(const WebOptions& options, const Site& site,
                                                     Service& service) {
  // Says what is wrong, which libwebsockets would not.
  if (!options.tls_cert.empty()) {
    const auto good = Certificate::read(options.tls_cert, options.tls_key, wall_s());
    if (!good) return tl::unexpected(good.error());
  }
  auto listener = Listener::open(options.address, options.port);
  if (!listener) return tl::unexpected(listener.error());
  auto impl = std::make_unique<Impl>(options, std::move(*listener), site, service);
  constexpr std::size_t kReceiveBytes = 2 * kMaxViewerBytes;
  impl->protocols[0] = {"http", Impl::on_http, sizeof(void*), 0, 0, nullptr, 0};
  impl->protocols[1] = {kSubprotocol, Impl::on_socket, sizeof(void*), kReceiveBytes, 0, nullptr, 0};

  // The callbacks of connections count their errors, which must not fill a log.
  lws_set_log_level(0, nullptr);
  lws_context_creation_info info{};
  info.port = CONTEXT_PORT_NO_LISTEN_SERVER;  // the listener is ours, because libwebsockets' stops for all
  info.protocols = impl->protocols.data();
  info.user = impl.get();
  info.headers = impl->heads.list();
  info.fd_limit_per_thread = static_cast<unsigned>(options.connections + kOwnDescriptors);
  info.retry_and_idle_policy = &kIdlePolicy;
  info.timeout_secs = Visits::kHandshakeNs / kSecond;
  info.keepalive_timeout = Visits::kKeptNs / kSecond;
  info.server_string = "tandem-gateway";
  info.alpn = "http/1.1";
  if (!options.tls_cert.empty()) {
    info.options |= LWS_SERVER_OPTION_DO_SSL_GLOBAL_INIT;
    info.ssl_cert_filepath = options.tls_cert.c_str();
    info.ssl_private_key_filepath = options.tls_key.c_str();
  }
  impl->context = lws_create_context(&info);
  if (impl->context == nullptr) {
    return fail(
        ErrorCode::kIo,
        options.tls_cert.empty()
            ? fmt::format("cannot listen on {} port {}", options.address, options.port)
            : fmt::format("{} and {} are not a certificate and its key", options.tls_cert, options.tls_key));
  }
  impl->vhost = lws_get_vhost_by_name(impl->context, "default");
  lws_sock_file_fd_type entrance{};
  entrance.filefd = dup(impl->listener.fd());  // libwebsockets closes it
  impl->entrance = lws_adopt_descriptor_vhost(impl->vhost, LWS_ADOPT_RAW_FILE_DESC, entrance,
                                              impl->protocols[0].name, nullptr);
  if (impl->entrance == nullptr) return fail(ErrorCode::kIo, "cannot watch the listening socket");
  impl->tick.self = impl.get();
  lws_sul_schedule(impl->context, 0, &impl->tick.sul, Impl::on_tick, 1);
  return std::unique_ptr<WebServer>(new WebServer(std::move(impl)));
}

WebServer::WebServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
WebServer::~WebServer() = default;

void WebServer::run(const std::atomic<bool>& stop) {
  while (!stop.load(std::memory_order_relaxed)) {
    if (lws_service(impl_->context, 0) < 0) return;
  }
}

void WebServer::wake() { lws_cancel_service(impl_->context); }

std::uint16_t WebServer::port() const { return impl_->listener.port(); }

}  // namespace tandem::gateway
