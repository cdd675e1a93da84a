#include "services/gateway/entrance/addresses.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>

#include <algorithm>
#include <cstring>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::gateway {
namespace {

constexpr double kBurstSeconds = 4;

AddressKey key_of(const in_addr& address) {
  AddressKey key{};
  key[10] = key[11] = 0xFF;  // as IPv6 writes an address of IPv4
  std::memcpy(key.data() + 12, &address, sizeof address);
  return key;
}

AddressKey key_of(const in6_addr& address) {
  AddressKey key{};
  const bool four = IN6_IS_ADDR_V4MAPPED(&address) != 0;
  std::memcpy(key.data(), &address, four ? 16 : 8);
  return key;
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
  return text;
}

double per_second(const AddressLimits& limits, double times) {
  return std::max(1.0, times * static_cast<double>(limits.connections));
}

}  // namespace

std::optional<AddressKey> address_key(std::string_view text) {
  text = trimmed(text);
  if (text.starts_with('[')) {
    text = text.substr(1, text.find(']') - 1);
  } else if (std::ranges::count(text, ':') == 1) {
    text = text.substr(0, text.find(':'));
  }
  const std::string copy(text);
  in_addr four{};
  in6_addr six{};
  if (inet_pton(AF_INET, copy.c_str(), &four) == 1) return key_of(four);
  if (inet_pton(AF_INET6, copy.c_str(), &six) == 1) return key_of(six);
  return std::nullopt;
}

std::optional<AddressKey> address_key(const sockaddr& address) {
  if (address.sa_family == AF_INET) return key_of(reinterpret_cast<const sockaddr_in&>(address).sin_addr);
  if (address.sa_family == AF_INET6) return key_of(reinterpret_cast<const sockaddr_in6&>(address).sin6_addr);
  return std::nullopt;
}

std::string address_text(const AddressKey& key) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  in6_addr six{};
  std::memcpy(&six, key.data(), key.size());
  if (IN6_IS_ADDR_V4MAPPED(&six) != 0) {
    inet_ntop(AF_INET, key.data() + 12, text.data(), text.size());
    return text.data();
  }
  inet_ntop(AF_INET6, &six, text.data(), text.size());
  return std::string(text.data()) + "/64";
}

AddressKey client_address(const AddressKey& peer, std::string_view forwarded_for,
                          std::span<const AddressKey> trusted) {
  AddressKey at = peer;
  while (std::ranges::find(trusted, at) != trusted.end() && !forwarded_for.empty()) {
    const std::size_t comma = forwarded_for.rfind(',');
    const auto hop = address_key(forwarded_for.substr(comma == std::string_view::npos ? 0 : comma + 1));
    if (!hop) return at;
    at = *hop;
    forwarded_for = forwarded_for.substr(0, comma == std::string_view::npos ? 0 : comma);
  }
  return at;
}

AddressAccount::AddressAccount(const AddressLimits& limits)
    : arrivals(per_second(limits, 0.5), per_second(limits, 1)),
      requests(per_second(limits, 2), per_second(limits, 8)),
      joins(limits.joins_per_minute / 60, limits.joins_per_minute),
      bytes(limits.bytes_per_second, kBurstSeconds * limits.bytes_per_second),
      inputs(limits.inputs_per_second, limits.inputs_per_second),
      received(per_second(limits, kReceivedPerSecond),
               kBurstSeconds * per_second(limits, kReceivedPerSecond)) {}

bool AddressAccount::rested(std::int64_t now_ns) {
  return connections == 0 && arrivals.full(now_ns) && requests.full(now_ns) && joins.full(now_ns) &&
         bytes.full(now_ns) && inputs.full(now_ns) && received.full(now_ns);
}

AccountPtr Addresses::of(const AddressKey& address) {
  if (const auto found = accounts_.find(address); found != accounts_.end()) return found->second;
  if (accounts_.size() >= kMaxAddresses) return others_;
  return accounts_.emplace(address, account()).first->second;
}

std::optional<TurnedAway> Addresses::arrive(AddressAccount& account, std::int64_t now_ns) const {
  if (!account.received.has(now_ns)) return TurnedAway::kBytes;
  if (account.connections >= limits_.connections) return TurnedAway::kConnections;
  if (account.handshakes >= std::max<std::size_t>(limits_.connections / 4, 1)) return TurnedAway::kHandshakes;
  if (!account.arrivals.take(now_ns)) return TurnedAway::kArrivals;
  ++account.connections;
  ++account.handshakes;
  return std::nullopt;
}

bool Addresses::arrive_behind_proxy(AddressAccount& account) const {
  if (account.connections >= limits_.connections) return false;
  ++account.connections;
  return true;
}

void Addresses::leave(AddressAccount& account, bool was_greeted) {
  TANDEM_ASSERT(account.connections > 0 && (was_greeted || account.handshakes > 0));
  --account.connections;
  if (!was_greeted) --account.handshakes;
}

void Addresses::forget(std::int64_t now_ns) {
  std::erase_if(accounts_, [now_ns](const auto& entry) { return entry.second->rested(now_ns); });
}

}  // namespace tandem::gateway
