#include "sdk/transport/network/address_watch.hpp"

#include <algorithm>

namespace tandem::transport {
namespace {

/// Whether a program that was bound to `mine` could be bound to `other` instead.
bool serves_as(const LocalAddress& other, const LocalAddress& mine) {
  return is_v6(other.address) == is_v6(mine.address) && !other.loopback &&
         (other.is_of_a_network() || !mine.is_of_a_network());
}

}  // namespace

NetworkState AddressWatch::judge(const std::vector<LocalAddress>& now) {
  const auto offer = [this](const LocalAddress& address) {
    instead_ = address.interface + " " + address.address;
    return NetworkState::kMoved;
  };
  instead_.clear();
  lost_.clear();
  if (bound_.stopgap) {
    const auto network = std::ranges::find_if(now, &LocalAddress::is_of_a_network);
    return network == now.end() ? NetworkState::kThere : offer(*network);
  }
  for (const LocalAddress& mine : bound_.addresses)
    if (std::ranges::find(now, mine) == now.end()) lost_.push_back(mine);
  for (const LocalAddress& mine : lost_) {
    const auto again = std::ranges::find_if(now, [&mine](const LocalAddress& other) {
      return other.interface == mine.interface && serves_as(other, mine);
    });
    if (again != now.end()) return offer(*again);
  }
  if (lost_.empty() || lost_.size() < bound_.addresses.size()) return NetworkState::kThere;
  const auto other =
      std::ranges::find_if(now, [this](const LocalAddress& each) { return serves_as(each, lost_.front()); });
  return bound_.chosen_by_user || other == now.end() ? NetworkState::kGone : offer(*other);
}

NetworkState AddressWatch::look(const std::vector<LocalAddress>& now, std::int64_t now_ns) {
  state_ = judge(now);
  if (state_ != NetworkState::kMoved) {
    since_ns_ = -1;
  } else {
    if (since_ns_ < 0) since_ns_ = now_ns;
    if (now_ns - since_ns_ < kSettledNs) state_ = bound_.stopgap ? NetworkState::kThere : NetworkState::kGone;
  }
  return state_;
}

std::string AddressWatch::line() const {
  if (state_ == NetworkState::kThere) return {};
  if (bound_.stopgap)
    return "there is a network now (" + instead_ +
           "), and DDS still uses loopback alone, as there was none before";
  std::string gone;
  for (const LocalAddress& each : lost_)
    gone += (gone.empty() ? "" : ", ") + each.interface + " " + each.address;
  std::string text = "the network address that DDS is bound to (" + gone + ") is gone from this machine";
  return instead_.empty() ? text : text + "; it has " + instead_ + " now";
}

}  // namespace tandem::transport
