#pragma once
// HTTP and WebSocket. The source uses libwebsockets, which this header hides.

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "services/gateway/entrance/addresses.hpp"
#include "services/gateway/entrance/admission.hpp"
#include "services/gateway/gateway.hpp"
#include "services/gateway/site.hpp"
#include "tandem/result.hpp"

namespace tandem::gateway {

struct WebOptions {
  std::string address = "127.0.0.1";  ///< of IPv4 or IPv6
  std::uint16_t port = 8080;          ///< 0: any free one
  std::string tls_cert, tls_key;      ///< files; empty: no TLS
  std::size_t connections = 512;      ///< maximum number of connections of all kinds
  AddressLimits address_limits;
  std::vector<std::string> trusted_proxies;  ///< addresses whose X-Forwarded-For counts
  std::vector<std::string> origins;  ///< whose pages may show the viewer in a frame; * counts for none
};

/// Serves the viewer's files and the connections of viewers. Their number is limited; a handler deals with
/// their messages.
class WebServer {
 public:
  /// Called by run(), in its thread.
  class Handler {
   public:
    struct Request {
      std::string origin, host, token;                ///< empty if missing
      std::string address;                            ///< of the client, for the log
      std::shared_ptr<accounts::TokenBucket> inputs;  ///< of the viewers of its address
    };
    virtual ~Handler() = default;
    virtual std::variant<ViewerId, Refusal> open(const Request& request) = 0;
    /// What the token of a request allows now. Joins nobody; counts and logs a refusal.
    virtual tl::expected<Pass, Refusal> log_in(const Request& request) = 0;
    virtual std::optional<Refusal> receive(ViewerId id, std::span<const std::byte> message) = 0;
    virtual Gateway::Next next(ViewerId id) = 0;
    virtual void closed(ViewerId id) = 0;
    virtual void list_ready(std::vector<ViewerId>& out) = 0;
    virtual void list_not_reading(std::vector<ViewerId>& out) = 0;
    virtual void list_silent(std::vector<ViewerId>& out) = 0;
    /// Viewers whose pass counts no more.
    virtual void list_over(std::vector<std::pair<ViewerId, Refusal>>& out) = 0;
    /// Counts a refusal that the server itself decided.
    virtual void refused(Refusal refusal) = 0;
    virtual void turned_away(TurnedAway why) = 0;
    /// Ten times a second. True if the certificate has to be read again; reloaded() then follows.
    virtual bool tick() = 0;
    /// `certificate`: when the new one ends; empty without TLS. An error: the old one is used further.
    virtual void reloaded(const Result<std::string>& certificate) = 0;
    /// A JSON object for /healthz, and whether it is answered by 200 or by 503.
    struct Health {
      std::string json;
      bool good = true;
    };
    virtual Health health() = 0;
  };

  /// Listens. `site` and `handler` must outlive it. Errors: kIo (the address cannot be listened on, a file of
  /// TLS cannot be used).
  [[nodiscard]] static Result<std::unique_ptr<WebServer>> create(const WebOptions& options, const Site& site,
                                                                 Handler& handler);
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;
  WebServer(WebServer&&) = delete;
  WebServer& operator=(WebServer&&) = delete;
  ~WebServer();

  /// Serves until `stop`, and a maximum of 0.1 s longer.
  void run(const std::atomic<bool>& stop);
  /// Tells the server that list_ready() has something new. Thread-safe.
  void wake();
  [[nodiscard]] std::uint16_t port() const;

 private:
  struct Impl;
  explicit WebServer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::gateway
