#pragma once
// The ports of a relay's sides: DDS or NATS, as its options say.

#include <atomic>
#include <cstdint>
#include <memory>

#include "sdk/transport/port.hpp"
#include "services/relay/options.hpp"

namespace tandem::relay {

/// Makes ports. Both arguments must outlive it. Errors of its members: those of the ports.
class Sides {
 public:
  Sides(const Options& options, const std::atomic<bool>& stop);
  /// A client of the session that is passed on.
  [[nodiscard]] Result<std::unique_ptr<transport::ClientPort>> follow(transport::ClientId id) const;
  /// The server of the session on the other side.
  [[nodiscard]] Result<std::unique_ptr<transport::ServerPort>> publish(
      const transport::SessionMessage& session) const;
  /// Says in the log from where to where the session goes.
  void tell() const;

 private:
  const Options* options_;
  const std::atomic<bool>* stop_;
  std::uint32_t sender_;  ///< tells this process from others on NATS
};

}  // namespace tandem::relay
