#pragma once
// HTTP and WebSocket. The source uses libwebsockets, which this header hides.

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "services/gateway/entrance/addresses.hpp"
#include "services/gateway/site.hpp"
#include "tandem/result.hpp"

namespace tandem::gateway {

class Service;

struct WebOptions {
  std::string address = "127.0.0.1";  ///< of IPv4 or IPv6
  std::uint16_t port = 8080;          ///< 0: any free one
  std::string tls_cert, tls_key;      ///< files; empty: no TLS
  std::size_t connections = 512;      ///< maximum number of connections of all kinds
  AddressLimits address_limits;
  std::vector<std::string> trusted_proxies;  ///< addresses whose X-Forwarded-For counts
  std::vector<std::string> origins;  ///< whose pages may show the viewer in a frame; * counts for none
};

/// Serves the viewer's files and the connections of viewers. Their number is limited; the service deals with
/// their messages.
class WebServer {
 public:
  /// Listens. `site` and `service` must outlive it. Errors: kIo (the address cannot be listened on, a file of
  /// TLS cannot be used).
  [[nodiscard]] static Result<std::unique_ptr<WebServer>> create(const WebOptions& options, const Site& site,
                                                                 Service& service);
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
