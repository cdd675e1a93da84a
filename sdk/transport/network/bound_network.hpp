#pragma once
// The network to which Cyclone DDS has bound a domain: whether it is still there, and how the domain ends
// without it.

#include <cstdint>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "sdk/transport/network/address_watch.hpp"

namespace tandem::transport {

/// What decides to what a domain is bound.
struct Binding {
  std::vector<std::string> interfaces = {};  ///< that the profile uses
  bool chosen_by_user = false;               ///< the interface was named, or there is a CYCLONEDDS_URI
};

/// Made before the domain is opened. Not thread-safe.
class BoundNetwork {
 public:
  BoundNetwork() : before_(own_udp_sockets()) {}

  /// The domain was opened.
  void opened(const Binding& binding);
  /// Looks at the machine's addresses once a second. `now_ns` is a steady clock.
  NetworkState look(std::int64_t now_ns);
  /// As AddressWatch.
  [[nodiscard]] std::string line() const { return watch_ ? watch_->line() : std::string(); }
  [[nodiscard]] bool awaits_network() const { return watch_ && watch_->awaits_network(); }
  [[nodiscard]] const std::vector<std::uint32_t>& ports() const { return ports_; }

 private:
  static constexpr std::int64_t kLookNs = 1'000'000'000;

  std::vector<OwnSocket> before_;
  std::vector<std::uint32_t> ports_;  // at which the domain hears what comes by loopback
  std::optional<AddressWatch> watch_;
  NetworkState state_ = NetworkState::kThere;
  std::int64_t next_ns_ = 0;
};

/// While it lives, a byte comes to each of the ports by loopback now and then. When Cyclone DDS ends a
/// domain, its threads wait for a packet to themselves, which never comes once the interface is gone.
class Knocking {
 public:
  explicit Knocking(const std::vector<std::uint32_t>& ports);

 private:
  std::jthread thread_;
};

}  // namespace tandem::transport
