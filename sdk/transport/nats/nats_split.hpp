#pragma once
// One connection to a NATS server for several ports of a program.

#include <memory>

#include "sdk/transport/nats/nats_bus.hpp"

namespace tandem::transport {

/// Hands out buses that share one: what several subscribe to comes over the connection once. Their subjects
/// have no wildcards. Like a bus, it belongs to one thread, but for publish() and wake(). A bus may outlive
/// this.
class NatsSplit {
 public:
  explicit NatsSplit(std::unique_ptr<NatsBus> bus);
  [[nodiscard]] std::unique_ptr<NatsBus> share();

 private:
  struct Shared;
  class Part;
  std::shared_ptr<Shared> shared_;
};

}  // namespace tandem::transport
