#include "sdk/transport/network/bound_network.hpp"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <stop_token>

namespace tandem::transport {

void BoundNetwork::opened(const Binding& binding) {
  BoundAddresses bound{.addresses = {}, .chosen_by_user = binding.chosen_by_user};
  bool loopback_only = false, v6 = false;
  const std::vector<LocalAddress> here = local_addresses();
  for (const OwnSocket& socket : own_udp_sockets()) {
    if (std::ranges::find(before_, socket) != before_.end()) continue;
    v6 = socket.v6;
    if (socket.address.empty()) ports_.push_back(socket.port);
    const auto local = std::ranges::find(here, socket.address, &LocalAddress::address);
    if (local == here.end()) continue;
    if (local->loopback) {
      loopback_only = true;
    } else if (std::ranges::find(bound.addresses, *local) == bound.addresses.end()) {
      bound.addresses.push_back(*local);
    }
  }
  if (bound.addresses.empty() && !loopback_only) {  // it sends from the socket that hears all
    for (const std::string& name : binding.interfaces) {
      const auto local = std::ranges::find_if(here, [&](const LocalAddress& each) {
        return each.interface == name && !each.loopback && v6 == is_v6(each.address);
      });
      if (local != here.end()) bound.addresses.push_back(*local);
    }
  }
  bound.stopgap = loopback_only && bound.addresses.empty() && !binding.chosen_by_user;
  if (bound.stopgap || !bound.addresses.empty()) watch_.emplace(std::move(bound));
  before_.clear();
}

NetworkState BoundNetwork::look(std::int64_t now_ns) {
  if (!watch_ || now_ns < next_ns_) return state_;
  next_ns_ = now_ns + kLookNs;
  return state_ = watch_->look(local_addresses(), now_ns);
}

Knocking::Knocking(const std::vector<std::uint32_t>& ports)
    : thread_([ports](const std::stop_token& stop) {
        std::mutex mutex;
        std::condition_variable_any ended;
        std::unique_lock lock(mutex);
        do {
          for (const std::uint32_t port : ports) send_byte_to_loopback(port);
        } while (!ended.wait_for(lock, stop, std::chrono::milliseconds(20),
                                 [&stop] { return stop.stop_requested(); }));
      }) {}

}  // namespace tandem::transport
