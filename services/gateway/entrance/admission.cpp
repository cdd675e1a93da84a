#include "services/gateway/entrance/admission.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cctype>

#include "services/credentials/tokens/secret_file.hpp"

namespace tandem::gateway {
namespace {

constexpr std::size_t kLeastToken = 16, kMaxToken = 128;

std::string lower(std::string_view text) {
  std::string out(text);
  std::ranges::transform(out, out.begin(), [](char c) {
    return static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  });
  return out;
}

// HOST[:PORT] without its port, and without the brackets of an IPv6 address.
std::string name_of(std::string_view host) {
  if (host.starts_with('[')) return std::string(host.substr(1, host.find(']') - 1));
  return std::string(host.substr(0, host.find(':')));
}

bool is_token_character(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '_' || c == '~' || c == '-';
}

}  // namespace

bool is_address(std::string_view host) {
  const std::string name = name_of(host);
  std::array<unsigned char, 16> address{};
  return name == "localhost" || inet_pton(AF_INET, name.c_str(), address.data()) == 1 ||
         inet_pton(AF_INET6, name.c_str(), address.data()) == 1;
}

bool Admission::is_the_text(std::string_view given) const {
  const std::string& token = secrets_.token;
  unsigned wrong = given.size() == token.size() ? 0 : 1;
  for (std::size_t i = 0; i < token.size(); ++i) {
    const char c = i < given.size() ? given[i] : '\0';
    wrong |= static_cast<unsigned char>(c ^ token[i]);
  }
  return wrong == 0;
}

tl::expected<Pass, tokens::Denial> Admission::pass(std::string_view given, std::int64_t now_s) const {
  if (secrets_.empty()) return Pass{};
  if (!secrets_.token.empty() && is_the_text(given))
    return Pass{.may_act = true, .name = {}, .over_s = 0, .key = tokens::fingerprint(secrets_.token)};
  return tokens::check(given, secrets_.keys, session_, now_s).map([](tokens::Checked&& checked) {
    return Pass{.may_act = checked.claims.role == tokens::Role::kAct,
                .name = std::move(checked.claims.name),
                .over_s = checked.claims.expires_s + tokens::kClockToleranceS,
                .key = checked.key};
  });
}

std::optional<tokens::Denial> Admission::over(const Pass& pass, std::int64_t now_s) const {
  if (pass.over_s != 0 && now_s >= pass.over_s) return tokens::Denial::kExpired;
  if (secrets_.empty()) return std::nullopt;
  const bool known =
      (!secrets_.token.empty() && pass.key == tokens::fingerprint(secrets_.token)) ||
      std::ranges::any_of(secrets_.keys, [&](const tokens::PublicKey& key) { return key.id() == pass.key; });
  return known ? std::nullopt : std::optional(tokens::Denial::kWrong);
}

bool Admission::origin_fits(std::string_view origin, std::string_view host) const {
  if (origin.empty()) return true;
  const std::string wanted = lower(origin);
  for (const std::string& listed : origins_) {
    if (listed == "*" || lower(listed) == wanted) return true;
  }
  const std::size_t scheme = wanted.find("://");
  if (scheme == std::string::npos) return false;
  const std::string site = wanted.substr(scheme + 3);
  return site == lower(host) && is_address(site);
}

Result<std::string> read_token(const std::string& path) {
  const auto text = tokens::read_file(path, tokens::Others::kMayNotWrite);
  if (!text) return tl::unexpected(text.error());
  const std::string token = text->substr(0, text->find('\n'));
  if (token.size() < kLeastToken || token.size() > kMaxToken ||
      !std::ranges::all_of(token, is_token_character)) {
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("{}: the first line must be a token of {} to {} characters of [A-Za-z0-9._~-]",
                            path, kLeastToken, kMaxToken));
  }
  return token;
}

Result<Secrets> read_secrets(const std::string& token_file, const std::vector<std::string>& key_files) {
  Secrets secrets;
  if (!token_file.empty()) {
    auto token = read_token(token_file);
    if (!token) return tl::unexpected(token.error());
    secrets.token = std::move(*token);
    struct stat info = {};
    if (stat(token_file.c_str(), &info) == 0 && (info.st_mode & S_IROTH) != 0)
      secrets.warnings.push_back(fmt::format("{}: everybody on this machine can read the token: chmod 600 {}",
                                             token_file, token_file));
  }
  for (const std::string& file : key_files) {
    auto key = tokens::PublicKey::read(file);
    if (!key) return tl::unexpected(key.error());
    secrets.keys.push_back(std::move(*key));
  }
  return secrets;
}

Result<void> check_origin(const std::string& origin) {
  const bool good = origin == "*" ||
                    ((origin.starts_with("http://") || origin.starts_with("https://")) &&
                     origin.find('/', origin.find("://") + 3) == std::string::npos && origin.size() <= 256);
  if (good) return {};
  return fail(ErrorCode::kInvalidArgument,
              fmt::format("'{}' is not an origin: SCHEME://HOST[:PORT] without a path, or *", origin));
}

}  // namespace tandem::gateway
