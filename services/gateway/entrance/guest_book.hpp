#pragma once
// Who came from where, was refused, or did what: lines for the log, without secrets.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "services/gateway/entrance/admission.hpp"
#include "services/program/token_bucket.hpp"

namespace tandem::gateway {

struct Guest {
  std::string address;  ///< of IPv4, or the first 64 bits of one of IPv6
  std::string origin;   ///< of its page; empty if it named none. Untrusted
  Pass pass;
  std::int64_t since_ns = 0;
};

/// Makes lines of the form `audit: EVENT key=value ...`. What strangers can cause has a rate; what is above
/// it is counted, and the next line of that kind says how many were left out. Not thread-safe.
class GuestBook {
 public:
  static constexpr accounts::TokenBucket kRefusals{0.5, 5};  ///< lines a second, and at once
  static constexpr accounts::TokenBucket kComings{2, 100};
  static constexpr accounts::TokenBucket kDeeds{2, 100};

  using Line = std::optional<std::string>;
  [[nodiscard]] Line came(std::uint64_t viewer, Guest guest, std::int64_t now_ns);
  [[nodiscard]] Line refused(std::string_view address, std::string_view origin, std::string_view reason,
                             std::int64_t now_ns);
  /// `deeds`: what its inputs were and became.
  [[nodiscard]] Line did(std::uint64_t viewer, std::string_view deeds, std::int64_t now_ns);
  [[nodiscard]] Line left(std::uint64_t viewer, std::int64_t now_ns);

  [[nodiscard]] const std::map<std::uint64_t, Guest>& guests() const { return guests_; }

 private:
  struct Kind {
    accounts::TokenBucket rate;
    std::uint64_t left_out = 0;
  };
  static Line limited(Kind& kind, std::string line, std::int64_t now_ns);

  std::map<std::uint64_t, Guest> guests_;
  Kind refusals_{kRefusals}, comings_{kComings}, deeds_{kDeeds};
};

}  // namespace tandem::gateway
