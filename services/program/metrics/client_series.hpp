#pragma once
// The metrics and the readiness of a program that is a client of a session: gateway, recorder.

#include <cstdint>
#include <string>

#include "services/program/metrics/page.hpp"
#include "services/program/metrics/rate_watch.hpp"
#include "tandem/client_types.hpp"

namespace tandem::metrics {

/// Figures of a moment. No text that came over the network is in them, except in `status`.
struct ClientNow {
  ClientStatus status;
  double lag_s = 0;  ///< from publishing a frame to applying it, over about the last half second
};

/// Adds what every client has; of texts only `session`, which the operator chose.
void describe(Page& page, const std::string& session, const ClientNow& now);

/// Whether the client follows its session. Not thread-safe.
class ClientWatch {
 public:
  /// Call several times a second.
  void saw(const ClientStatus& status, std::int64_t now_ns);
  /// For Health::beat(): a literal that says why the client does not follow; null if it does.
  [[nodiscard]] const char* obstacle() const { return obstacle_; }

 private:
  RateWatch frames_;
  const char* obstacle_ = "it looks for the session";
};

}  // namespace tandem::metrics
