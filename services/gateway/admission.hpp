#pragma once
// Decides which requests may open a connection.

#include <string>
#include <string_view>
#include <vector>

#include "tandem/result.hpp"

namespace tandem::gateway {

/// Web pages of other sites run in the same browsers, and reach what listens on the loopback. Thread-safe.
class Admission {
 public:
  /// `token`: empty where none is asked for. `origins`: SCHEME://HOST[:PORT], or * for all.
  Admission(std::string token, std::vector<std::string> origins)
      : token_(std::move(token)), origins_(std::move(origins)) {}

  /// Takes the same time wherever the first wrong character is.
  [[nodiscard]] bool token_fits(std::string_view given) const;
  /// `origin`, `host`: the request's headers, empty where there is none. No browser leaves the origin out. A
  /// page that came from this gateway by its address is let in; by a name only if the name is listed, as
  /// names can be made to point anywhere.
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
