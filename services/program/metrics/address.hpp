#pragma once
// Where a program serves its metrics: the value of --metrics.

#include <cstdint>
#include <string>
#include <string_view>

#include "tandem/result.hpp"

namespace tandem::metrics {

struct Address {
  std::string host = "127.0.0.1";  ///< an address of IPv4 or IPv6 in numbers, the latter without brackets
  std::uint16_t port = 0;          ///< 0: any free one

  bool operator==(const Address&) const = default;
};

/// Reads PORT, ADDRESS:PORT or [ADDRESS]:PORT. A port alone is one of 127.0.0.1, and so is `localhost:PORT`.
/// Errors: kInvalidArgument, which says what is expected.
[[nodiscard]] Result<Address> read_address(std::string_view text);
/// As in an address of the web, which has an IPv6 address in brackets.
[[nodiscard]] std::string to_text(const Address& address);
/// True if only programs of this machine can reach it.
[[nodiscard]] bool is_loopback(const Address& address);

}  // namespace tandem::metrics
