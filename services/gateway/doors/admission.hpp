#pragma once
// Decides which requests may open a connection.

#include <string>
#include <string_view>
#include <vector>

#include "tandem/result.hpp"

namespace tandem::gateway {

/// Refuses web pages of other sites, which run in the same browsers and can reach the loopback. Thread-safe.
class Admission {
 public:
  /// `token`: empty if none is needed. `origins`: SCHEME://HOST[:PORT], or * for all.
  Admission(std::string token, std::vector<std::string> origins)
      : token_(std::move(token)), origins_(std::move(origins)) {}

  /// Takes the same time wherever the first wrong character is.
  [[nodiscard]] bool token_fits(std::string_view given) const;
  /// `origin`, `host`: the request's headers, empty if missing. Browsers always send the origin. A page that
  /// this gateway served at an IP address may connect. A page that it served under a name may connect only if
  /// the origin is listed, because anybody can make a name point anywhere.
  [[nodiscard]] bool origin_fits(std::string_view origin, std::string_view host) const;

 private:
  std::string token_;
  std::vector<std::string> origins_;
};

/// A token is 16 to 128 characters of [A-Za-z0-9._~-], which need no escape in an address, and a line of its
/// own. Errors: kIo, kInvalidArgument.
[[nodiscard]] Result<std::string> read_token(const std::string& path);
/// Errors: kInvalidArgument.
[[nodiscard]] Result<void> check_origin(const std::string& origin);

}  // namespace tandem::gateway
