#include "services/gateway/doors/admission.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <fstream>

namespace tandem::gateway {
namespace {

constexpr std::size_t kLeastToken = 16, kMostToken = 128;

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

// True for names that no other party can point elsewhere.
bool is_address(const std::string& name) {
  std::array<unsigned char, 16> address{};
  return name == "localhost" || inet_pton(AF_INET, name.c_str(), address.data()) == 1 ||
         inet_pton(AF_INET6, name.c_str(), address.data()) == 1;
}

bool is_token_character(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '_' || c == '~' || c == '-';
}

}  // namespace

bool Admission::token_fits(std::string_view given) const {
  if (token_.empty()) return true;
  unsigned wrong = given.size() == token_.size() ? 0 : 1;
  for (std::size_t i = 0; i < token_.size(); ++i) {
    const char c = i < given.size() ? given[i] : '\0';
    wrong |= static_cast<unsigned char>(c ^ token_[i]);
  }
  return wrong == 0;
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
  return site == lower(host) && is_address(name_of(site));
}

Result<std::string> read_token(const std::string& path) {
  std::ifstream in(path);
  if (!in) return fail(ErrorCode::kIo, fmt::format("{}: cannot be opened: {}", path, std::strerror(errno)));
  std::string token;
  if (!std::getline(in, token))
    return fail(ErrorCode::kIo, fmt::format("{}: cannot be read, or is empty", path));
  if (token.size() < kLeastToken || token.size() > kMostToken ||
      !std::ranges::all_of(token, is_token_character)) {
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("{}: the first line must be a token of {} to {} characters of [A-Za-z0-9._~-]",
                            path, kLeastToken, kMostToken));
  }
  return token;
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
