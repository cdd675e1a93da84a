#include "services/credentials/tokens/token.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "services/credentials/tokens/base64url.hpp"
#include "services/program/json/json.hpp"

namespace tandem::tokens {
namespace {

// {"alg":"EdDSA","typ":"JWT"}. No other header is read, so nobody can ask for another algorithm.
constexpr std::string_view kHeader = "eyJhbGciOiJFZERTQSIsInR5cCI6IkpXVCJ9.";
// Whole seconds that a double holds exactly; beyond that a number is no time.
constexpr double kMaxSeconds = 9e15;

bool is_plain(std::string_view text) {
  return text.size() <= kMaxNameBytes &&
         std::ranges::all_of(text, [](char c) { return c > ' ' && c <= '~' && c != '"' && c != '\\'; });
}

std::optional<std::int64_t> seconds(const Json& value) {
  const double number = value.number();
  if (!(std::abs(number) > 0 && std::abs(number) < kMaxSeconds)) return std::nullopt;
  return static_cast<std::int64_t>(number);
}

tl::unexpected<Denial> deny(Denial why) { return tl::unexpected<Denial>(why); }

tl::expected<Claims, Denial> read_claims(const std::vector<std::uint8_t>& payload, std::string_view session,
                                         std::int64_t now_s) {
  const auto json = Json::parse({payload.begin(), payload.end()});
  if (!json) return deny(Denial::kWrong);
  const Json& said = *json;  // whose const [] makes nothing
  const auto expires_s = seconds(said["exp"]);
  const auto not_before_s = said["nbf"].is_null() ? 0 : seconds(said["nbf"]);
  if (!expires_s || !not_before_s) return deny(Denial::kWrong);
  if (now_s >= *expires_s + kClockToleranceS) return deny(Denial::kExpired);
  if (now_s < *not_before_s - kClockToleranceS) return deny(Denial::kEarly);
  if (!said["aud"].is_null() && said["aud"].text() != session) return deny(Denial::kSession);
  const auto role = read_role(said["role"].text());
  if (!role) return deny(Denial::kRole);
  return Claims{.role = *role,
                .not_before_s = *not_before_s,
                .expires_s = *expires_s,
                .name = said["sub"].text().substr(0, kMaxNameBytes),
                .session = said["aud"].text()};
}

}  // namespace

std::optional<Role> read_role(std::string_view text) {
  if (text == "watch") return Role::kWatch;
  if (text == "act") return Role::kAct;
  return std::nullopt;
}

std::string_view role_name(Role role) { return role == Role::kAct ? "act" : "watch"; }

Result<std::string> sign(const Claims& claims, const SecretKey& key) {
  const std::int64_t lasts_s = claims.expires_s - claims.not_before_s;
  if (claims.not_before_s <= 0 || lasts_s <= 0 || lasts_s > kLongestS) {
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("a token lasts from 1 s to {} days", kLongestS / 86'400));
  }
  if (!is_plain(claims.name) || !is_plain(claims.session)) {
    return fail(
        ErrorCode::kInvalidArgument,
        fmt::format("the name and the session of a token have at most {} characters of ASCII, without "
                    "spaces, quotes and backslashes",
                    kMaxNameBytes));
  }
  Json said{{"role", role_name(claims.role)}, {"nbf", claims.not_before_s}, {"exp", claims.expires_s}};
  if (!claims.name.empty()) said["sub"] = claims.name;
  if (!claims.session.empty()) said["aud"] = claims.session;
  const std::string text = said.dump();
  std::string token(kHeader);
  token += to_base64url({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  const Signature signature = key.sign(token);
  return token + '.' + to_base64url(signature);
}

tl::expected<Checked, Denial> check(std::string_view token, std::span<const PublicKey> keys,
                                    std::string_view session, std::int64_t now_s) {
  if (token.size() > kMaxTokenBytes || !token.starts_with(kHeader)) return deny(Denial::kWrong);
  const std::size_t dot = token.rfind('.');
  const auto signed_by = from_base64url(token.substr(dot + 1));
  if (dot < kHeader.size() || !signed_by || signed_by->size() != kSignatureBytes) return deny(Denial::kWrong);
  Signature signature{};
  std::ranges::copy(*signed_by, signature.begin());
  const std::string_view message = token.substr(0, dot);
  // Nothing of the payload is read before it is known to come from a key.
  const auto key =
      std::ranges::find_if(keys, [&](const PublicKey& one) { return one.fits(signature, message); });
  if (key == keys.end()) return deny(Denial::kWrong);
  const auto payload = from_base64url(message.substr(kHeader.size()));
  if (!payload) return deny(Denial::kWrong);
  return read_claims(*payload, session, now_s).map([&](Claims&& claims) {
    return Checked{std::move(claims), key->id()};
  });
}

}  // namespace tandem::tokens
