#pragma once
// Two network namespaces and the link between them. Nothing outlives the objects: the kernel removes a
// namespace without processes and descriptors, and its devices with it.

#include <memory>
#include <string>
#include <thread>

#include "sdk/transport/simulated/bottleneck.hpp"
#include "services/program/system/descriptor.hpp"
#include "tandem/result.hpp"

namespace tandem::lab {

/// A network namespace with `lo` and one device, `tandem0`, whose packets come out of a descriptor.
struct Enclave {
  system::Descriptor name_space;  ///< for setns()
  system::Descriptor device;
};

/// `address`: the IPv4 address of its device in 10.77.0.0/24. Errors: kIo, which names what was not
/// permitted.
[[nodiscard]] Result<Enclave> make_enclave(const std::string& address);

struct LinkCounts {
  std::uint64_t bytes_there = 0, dropped = 0;
};

/// Carries packets between the devices of two enclaves, which must outlive it, in a thread of its own.
class Link {
 public:
  Link(const Enclave& server, const Enclave& clients, const transport::simulated::BottleneckOptions& options);
  ~Link();
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;
  /// Stops the link. Returns what it carried to the clients in its last `seconds`, and all that it dropped.
  LinkCounts finish(double seconds);

 private:
  struct State;
  std::unique_ptr<State> state_;
  std::jthread thread_;
};

}  // namespace tandem::lab
