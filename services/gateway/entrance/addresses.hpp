#pragma once
// What one address may take of a gateway, so that it keeps nobody of another address out.

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sdk/core/lattice/assert.hpp"
#include "services/program/token_bucket.hpp"

struct sockaddr;

namespace tandem::gateway {

/// An IPv4 address, or the first 64 bits of an IPv6 address, which is what one host or one home has.
using AddressKey = std::array<std::uint8_t, 16>;

/// Errors: nothing if `text` is no address of IPv4 or IPv6. A port behind it, and brackets, are left out.
[[nodiscard]] std::optional<AddressKey> address_key(std::string_view text);
[[nodiscard]] std::optional<AddressKey> address_key(const sockaddr& address);

/// As people write it; of IPv6 the first 64 bits.
[[nodiscard]] std::string address_text(const AddressKey& key);

/// The address that a request comes from: `peer`, or behind trusted proxies the last hop of `forwarded_for`
/// that is none of them. Untrusted. A hop that is no address ends the search: then the proxy before it
/// counts.
[[nodiscard]] AddressKey client_address(const AddressKey& peer, std::string_view forwarded_for,
                                        std::span<const AddressKey> trusted);

/// Bytes from each connection that an address may have; a burst of 4 s. A viewer sends a tenth of it.
inline constexpr double kReceivedPerSecond = 16 * 1024;

struct AddressLimits {
  /// At a time; a quarter of them may be in a handshake, half may come and twice as many requests may be
  /// made in a second, and each may send kReceivedPerSecond.
  std::size_t connections = 64;
  double joins_per_minute = 120;               ///< of viewers; also the maximum burst
  double bytes_per_second = 16 * 1024 * 1024;  ///< of files to it and messages from it; burst of 4 s
  double inputs_per_second = 300;              ///< of all its viewers; also the maximum burst
};

/// Why a connection or a request is turned away before it is a viewer's.
enum class TurnedAway : std::uint8_t {
  kConnections,
  kHandshakes,
  kArrivals,
  kRequests,
  kSlow,
  kFull,
  kDescriptors,
  kBytes,
};
inline constexpr std::array<std::string_view, 8> kTurnedAway{
    "too many connections of an address",
    "too many handshakes of an address",
    "connections of an address came too fast",
    "too many requests of an address",
    "handshake took too long",
    "too many connections",
    "no file descriptor was free",
    "too many bytes from an address",
};
/// The same as values of a label.
inline constexpr std::array<std::string_view, kTurnedAway.size()> kTurnedAwayLabels{
    "connections", "handshakes", "arrivals", "requests", "slow", "full", "descriptors", "bytes",
};

/// What one address has, and what it may still do.
struct AddressAccount {
  explicit AddressAccount(const AddressLimits& limits);
  [[nodiscard]] bool rested(std::int64_t now_ns);

  std::size_t connections = 0, handshakes = 0;
  accounts::TokenBucket arrivals, requests, joins, bytes, inputs;
  accounts::TokenBucket received;  ///< bytes of all kinds from it, also those that make no message
};
using AccountPtr = std::shared_ptr<AddressAccount>;

/// Keeps an account for each address that has connections or had some lately. Not thread-safe.
class Addresses {
 public:
  /// Beyond this number all new addresses share one account.
  static constexpr std::size_t kMaxAddresses = 16'384;

  explicit Addresses(const AddressLimits& limits) : limits_(limits), others_(account()) {}

  [[nodiscard]] AccountPtr of(const AddressKey& address);
  /// Whether a connection may begin its handshake; if so it is counted until leave().
  [[nodiscard]] std::optional<TurnedAway> arrive(AddressAccount& account, std::int64_t now_ns) const;
  /// The connection has shaken hands.
  static void greeted(AddressAccount& account) {
    TANDEM_ASSERT(account.handshakes > 0);
    --account.handshakes;
  }
  static void leave(AddressAccount& account, bool was_greeted);
  /// Whether a connection that came through a proxy may be a viewer's; if so it is counted until leave().
  [[nodiscard]] bool arrive_behind_proxy(AddressAccount& account) const;
  /// Forgets addresses that are gone and would be treated as new ones.
  void forget(std::int64_t now_ns);
  [[nodiscard]] std::size_t size() const { return accounts_.size(); }

 private:
  [[nodiscard]] AccountPtr account() const { return std::make_shared<AddressAccount>(limits_); }

  AddressLimits limits_;
  std::map<AddressKey, AccountPtr> accounts_;
  AccountPtr others_;
};

}  // namespace tandem::gateway
