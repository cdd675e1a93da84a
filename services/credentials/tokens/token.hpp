#pragma once
// Tokens of one fixed format: SECURITY.md, "The gateway".

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "services/credentials/tokens/keys.hpp"
#include "tandem/result.hpp"

namespace tandem::tokens {

enum class Role : std::uint8_t {
  kWatch,  ///< sees the session
  kAct,    ///< also sends inputs
};
[[nodiscard]] std::optional<Role> read_role(std::string_view text);
[[nodiscard]] std::string_view role_name(Role role);

struct Claims {
  Role role = Role::kWatch;
  std::int64_t not_before_s = 0, expires_s = 0;  ///< seconds since 1970
  std::string name = {};                         ///< whom it was made for, for a log; may be empty
  std::string session = {};                      ///< the only one that it is for; empty: any
};

/// A longer token is refused before it is read.
inline constexpr std::size_t kMaxTokenBytes = 1024;
/// How far apart the clocks may be of the machine that makes a token and the one that checks it.
inline constexpr std::int64_t kClockToleranceS = 60;
/// The longest time for which a token is made.
inline constexpr std::int64_t kLongestS = std::int64_t{366} * 86'400;
inline constexpr std::size_t kMaxNameBytes = 64;

/// Errors: kInvalidArgument (times, the name's or the session's characters).
[[nodiscard]] Result<std::string> sign(const Claims& claims, const SecretKey& key);

enum class Denial : std::uint8_t {
  kWrong,    ///< none, of another key, changed, or not of the format
  kExpired,  ///< what follows is said only of tokens that one of the keys has signed
  kEarly,
  kRole,     ///< a role that does not exist
  kSession,  ///< it is for another session
};

struct Checked {
  Claims claims;
  Fingerprint key = 0;  ///< the one that it was signed with
};
/// `token`: untrusted. `now_s`: seconds since 1970.
[[nodiscard]] tl::expected<Checked, Denial> check(std::string_view token, std::span<const PublicKey> keys,
                                                  std::string_view session, std::int64_t now_s);

}  // namespace tandem::tokens
