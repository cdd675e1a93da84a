#pragma once
// Decides which requests may open a connection, and what its viewer may do.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "services/credentials/tokens/token.hpp"
#include "tandem/result.hpp"

namespace tandem::gateway {

/// The permissions that a viewer got when it was admitted.
struct Pass {
  bool may_act = true;
  std::string name;             ///< by its token; may be empty
  std::int64_t over_s = 0;      ///< from this time on (seconds since 1970) it counts no more; 0: never
  tokens::Fingerprint key = 0;  ///< of the key or text that it was checked with; 0: none was asked for
};

/// The secrets that viewers are checked against. With neither of them, everybody may act.
struct Secrets {
  std::string token;                    ///< a text that lets its holder act; empty: none
  std::vector<tokens::PublicKey> keys;  ///< of signed tokens
  std::vector<std::string> warnings;    ///< lines for the log

  [[nodiscard]] bool empty() const { return token.empty() && keys.empty(); }
};

/// Refuses web pages of other sites, which run in the same browsers and can reach the loopback. Not
/// thread-safe.
class Admission {
 public:
  /// `origins`: SCHEME://HOST[:PORT], or * for all. `session`: the one that tokens must be for, if they name
  /// one.
  Admission(Secrets secrets, std::vector<std::string> origins, std::string session)
      : secrets_(std::move(secrets)), origins_(std::move(origins)), session_(std::move(session)) {}

  /// `given`: untrusted; empty if there is none. `now_s`: seconds since 1970. Takes the same time wherever
  /// the first wrong character is.
  [[nodiscard]] tl::expected<Pass, tokens::Denial> pass(std::string_view given, std::int64_t now_s) const;
  /// Nothing if the pass still holds: its time is not over, and its key still counts.
  [[nodiscard]] std::optional<tokens::Denial> over(const Pass& pass, std::int64_t now_s) const;
  /// `origin`, `host`: the request's headers, empty if missing. Browsers always send the origin. A page that
  /// this gateway served at an IP address may connect. A page that it served under a name may connect only if
  /// the origin is listed, because anybody can make a name point anywhere.
  [[nodiscard]] bool origin_fits(std::string_view origin, std::string_view host) const;

  /// From now on these count.
  void change(Secrets secrets) { secrets_ = std::move(secrets); }

 private:
  [[nodiscard]] bool is_the_text(std::string_view given) const;

  Secrets secrets_;
  std::vector<std::string> origins_;
  std::string session_;
};

/// True for a HOST[:PORT] that no other party can point elsewhere: an IP address or `localhost`.
[[nodiscard]] bool is_address(std::string_view host);

/// A token is 16 to 128 characters of [A-Za-z0-9._~-], which need no escape in an address, and a line of its
/// own. Errors: kIo, kInvalidArgument.
[[nodiscard]] Result<std::string> read_token(const std::string& path);
/// `token_file`: empty if there is none. Errors: those of read_token() and tokens::PublicKey::read().
[[nodiscard]] Result<Secrets> read_secrets(const std::string& token_file,
                                           const std::vector<std::string>& key_files);
/// Errors: kInvalidArgument.
[[nodiscard]] Result<void> check_origin(const std::string& origin);

}  // namespace tandem::gateway
