#pragma once
// The connections of a gateway from their first packet on: whose each is, and until when it has to say
// something.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "sdk/wire/units.hpp"
#include "services/gateway/entrance/addresses.hpp"
#include "tandem/result.hpp"

struct lws;  // a connection of libwebsockets

namespace tandem::gateway {

/// One connection. It shakes hands until the headers of its first request are there.
struct Visit {
  lws* wsi = nullptr;               ///< for its owner
  AccountPtr account;               ///< of the peer, or of the client behind a trusted proxy
  AddressKey peer{}, client{};      ///< the client is another one behind a trusted proxy
  bool counted = false;             ///< in `account`
  bool greeted = false;             ///< has shaken hands
  bool waits_for_bytes = false;     ///< a file goes on when its address may have more
  std::int64_t due_ns = INT64_MAX;  ///< ended then, unless the headers of a request came
  std::uint64_t received = 0;       ///< bytes, when they were last counted
};

/// Keeps all visits, and counts them in the accounts of their addresses. Not thread-safe.
class Visits {
 public:
  static constexpr std::int64_t kHandshakeNs = 3 * kSecond;  ///< until the first request
  static constexpr std::int64_t kKeptNs = 15 * kSecond;      ///< from an answer to the next request

  /// `most`: visits of all addresses at a time. `trusted_proxies`: addresses; what is none is left out.
  Visits(const AddressLimits& limits, std::size_t most, const std::vector<std::string>& trusted_proxies);

  /// A visit that lasts until leave(), or why there is none.
  [[nodiscard]] tl::expected<Visit*, TurnedAway> arrive(const AddressKey& peer, std::int64_t now_ns);
  /// Without an effect on what is no visit, or no more.
  void leave(const Visit* visit);

  /// The headers of a request are there. Each request through a proxy may be another client's.
  /// `forwarded_for` is untrusted.
  void ask(Visit& visit, std::string_view forwarded_for);
  /// Its request was answered; another one may follow.
  static void answered(Visit& visit, std::int64_t now_ns) { visit.due_ns = now_ns + kKeptNs; }
  /// Whether it may become a viewer's, after ask().
  [[nodiscard]] bool join(Visit& visit, std::int64_t now_ns);

  /// Lists the visits whose time is over, once each. Replaces `out`.
  void list_slow(std::int64_t now_ns, std::vector<Visit*>& out);
  /// Counts what came by each since the last call, and lists those by which more came than their share while
  /// their address is over its limit. Call it ten times a second. `received_by`: bytes since its start.
  /// Replaces `out`.
  void list_floods(std::int64_t now_ns, const std::function<std::uint64_t(const Visit&)>& received_by,
                   std::vector<Visit*>& out);
  /// Lists the visits whose file waited, once for each wait. Replaces `out`.
  void list_waiting(std::vector<Visit*>& out);
  /// Forgets addresses that are gone and would be treated as new ones.
  void forget(std::int64_t now_ns) { addresses_.forget(now_ns); }

  [[nodiscard]] bool is_trusted(const AddressKey& peer) const;
  [[nodiscard]] std::size_t size() const { return visits_.size(); }

 private:
  Addresses addresses_;
  std::size_t most_;
  std::vector<AddressKey> trusted_;
  std::map<const Visit*, std::unique_ptr<Visit>> visits_;
};

}  // namespace tandem::gateway
