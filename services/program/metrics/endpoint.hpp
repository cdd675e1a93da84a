#pragma once
// Serves a program's metrics and health over HTTP.

#include <cstdint>
#include <functional>
#include <memory>

#include "services/program/metrics/address.hpp"
#include "services/program/metrics/health.hpp"
#include "services/program/metrics/page.hpp"
#include "tandem/result.hpp"

namespace tandem::metrics {

/// The bounds of what a stranger can cause.
struct EndpointLimits {
  std::size_t connections = 32;           ///< the oldest one makes room for a new one
  std::int64_t longest_ns = 5 * kSecond;  ///< for a connection, from its start to its end
  std::int64_t per_second = 1000;         ///< connections that are accepted; more of them wait in the kernel
  std::int64_t burst = 100;               ///< connections at once
  std::int64_t page_ns = kSecond / 10;    ///< a page serves all scrapes within this time
};

/// Errors: kTransport, if this machine does not have the address. Whether its port is free is not looked at.
[[nodiscard]] Result<void> check_address(const Address& address);

/// Answers GET /metrics, /healthz and /readyz in one thread, from the constructor to the destructor.
class Endpoint {
 public:
  /// Adds the program's figures to the page. Called in the endpoint's thread, so it must not wait for the
  /// program's work.
  using Describe = std::function<void(Page&)>;

  /// Listens. `health` must outlive it, and so must all that `describe` uses. Errors: kIo (the address cannot
  /// be listened on, such as a port in use), kUnsupported (a build without prometheus-cpp).
  [[nodiscard]] static Result<std::unique_ptr<Endpoint>> create(const Address& address, const Health& health,
                                                                Describe describe,
                                                                const EndpointLimits& limits = {});
  ~Endpoint();
  Endpoint(const Endpoint&) = delete;
  Endpoint& operator=(const Endpoint&) = delete;

  /// With the port that was taken where any free one was asked for.
  [[nodiscard]] const Address& address() const;
  /// What the log should say about it.
  [[nodiscard]] std::string notice() const;

 private:
  struct Impl;
  explicit Endpoint(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::metrics
