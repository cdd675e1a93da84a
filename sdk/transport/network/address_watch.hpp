#pragma once
// Notices that the addresses that a program is bound to have left the machine, and that others can be had.

#include <cstdint>
#include <string>
#include <vector>

#include "sdk/transport/network/interfaces.hpp"

namespace tandem::transport {

/// What has become of the network to which a program is bound.
enum class NetworkState : std::uint8_t {
  kThere,
  kGone,   ///< its address has left this machine, and binding anew would not help: it may come back
  kMoved,  ///< only who binds anew is on the network
};

/// What Cyclone DDS is bound to: it looks at interfaces once, when a domain is opened.
struct BoundAddresses {
  std::vector<LocalAddress> addresses = {};  ///< without loopback; empty: nothing can be lost
  bool chosen_by_user = false;               ///< another interface would not be what the user asked for
  bool stopgap = false;  ///< bound to loopback only because there was no network, not because somebody asked
};

/// An address that comes back on the same device is as good as before. On a device that was made anew it is
/// not, even if it is the same one: the kernel has forgotten the multicast groups. Not thread-safe.
class AddressWatch {
 public:
  /// Addresses come one after the other (IPv6 before DHCP): binding anew waits until they have settled.
  static constexpr std::int64_t kSettledNs = 3'000'000'000;

  explicit AddressWatch(BoundAddresses bound) : bound_(std::move(bound)) {}

  /// `now`: the addresses of the machine at `now_ns`, of a steady clock.
  NetworkState look(const std::vector<LocalAddress>& now, std::int64_t now_ns);
  /// The state in a line for people; empty for kThere.
  [[nodiscard]] std::string line() const;
  [[nodiscard]] bool awaits_network() const { return bound_.stopgap; }

 private:
  [[nodiscard]] NetworkState judge(const std::vector<LocalAddress>& now);

  BoundAddresses bound_;
  NetworkState state_ = NetworkState::kThere;
  std::vector<LocalAddress> lost_;
  std::string instead_;         // where it could be bound now
  std::int64_t since_ns_ = -1;  // that it could be; negative: it could not
};

}  // namespace tandem::transport
