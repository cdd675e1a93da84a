#include "services/gateway/web_request.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "services/credentials/tokens/token.hpp"

namespace tandem::gateway {
namespace {

// Browsers keep one cookie for all ports of a host, so that two gateways need two names.
std::string cookie_name(lws* wsi) {
  const std::string host = header(wsi, WSI_TOKEN_HOST);
  const std::size_t colon = host.rfind(':');
  std::string name = "tandem_token";
  if (colon == std::string::npos || host.find(']', colon) != std::string::npos) return name;
  const std::string port = host.substr(colon + 1);
  const bool digits = std::ranges::all_of(port, [](unsigned char c) { return std::isdigit(c) != 0; });
  return digits && port.size() <= 5 ? name + '_' + port : name;
}

using TokenText = std::array<char, tokens::kMaxTokenBytes + 64>;

/// A header that no proxy needs for itself.
std::string own_token(lws* wsi) {
  constexpr std::string_view kName = "tandem-token:";
  TokenText text{};
  const int size = lws_hdr_custom_copy(wsi, text.data(), static_cast<int>(text.size()), kName.data(),
                                       static_cast<int>(kName.size()));
  return size > 0 ? text.data() : std::string();
}

std::string bearer_of(lws* wsi) {
  constexpr std::string_view kBearer = "Bearer ";
  const std::string given = header(wsi, WSI_TOKEN_HTTP_AUTHORIZATION);
  return given.starts_with(kBearer) ? given.substr(kBearer.size()) : std::string();
}

// Runs WebAssembly, connects to this gateway, and gets nothing from elsewhere.
constexpr std::string_view kPolicy =
    "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self' data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'self'";

}  // namespace

std::string header(lws* wsi, lws_token_indexes token) {
  std::string text(static_cast<std::size_t>(std::max(lws_hdr_total_length(wsi, token), 0)) + 1, '\0');
  const int size = lws_hdr_copy(wsi, text.data(), static_cast<int>(text.size()), token);
  text.resize(static_cast<std::size_t>(std::max(size, 0)));
  return text;
}

bool names(std::string_view list, std::string_view wanted) {
  while (!list.empty()) {
    const std::size_t size = std::min(list.find_first_of(", \t"), list.size());
    if (list.substr(0, size) == wanted) return true;
    list.remove_prefix(std::min(size + 1, list.size()));
  }
  return false;
}

bool has_body(lws* wsi) {
  const std::string length = header(wsi, WSI_TOKEN_HTTP_CONTENT_LENGTH);
  return lws_hdr_total_length(wsi, WSI_TOKEN_HTTP_TRANSFER_ENCODING) > 0 ||
         (!length.empty() && length != "0");
}

std::string header_token_of(lws* wsi) {
  if (std::string own = own_token(wsi); !own.empty()) return own;
  return bearer_of(wsi);
}

std::string token_of(lws* wsi) {
  if (std::string own = own_token(wsi); !own.empty()) return own;
  TokenText text{};
  std::size_t size = text.size() - 1;
  if (lws_http_cookie_get(wsi, cookie_name(wsi).c_str(), text.data(), &size) == 0) return text.data();
  if (std::string given = bearer_of(wsi); !given.empty()) return given;
  text = {};
  const char* const given = lws_get_urlarg_by_name(wsi, "token=", text.data(), static_cast<int>(text.size()));
  return given != nullptr ? given : "";
}

std::string cookie_of(lws* wsi, std::string_view token, std::int64_t lasts_s, bool encrypted) {
  // Without a path it holds for where the page is, also behind a proxy that serves it in a folder.
  std::string cookie = fmt::format("{}={}; HttpOnly; SameSite=Strict", cookie_name(wsi), token);
  if (lasts_s > 0) cookie += fmt::format("; Max-Age={}", lasts_s);
  if (encrypted) cookie += "; Secure";
  return cookie;
}

bool proxy_says_https(lws* wsi) {
  constexpr std::string_view kName = "x-forwarded-proto:";
  std::array<char, 16> text{};
  const int size = lws_hdr_custom_copy(wsi, text.data(), static_cast<int>(text.size()), kName.data(),
                                       static_cast<int>(kName.size()));
  return size > 0 && std::string_view(text.data()) == "https";
}

SafeHeads::SafeHeads(const std::vector<std::string>& origins) : policy_(kPolicy) {
  for (const std::string& origin : origins) {
    if (origin != "*") policy_ += ' ' + origin;
  }
  heads_[0] = {&heads_[1], nullptr, "content-security-policy:", policy_.c_str()};
  heads_[1] = {&heads_[2], nullptr, "x-content-type-options:", "nosniff"};
  // The address of a page may contain its token.
  heads_[2] = {nullptr, nullptr, "referrer-policy:", "no-referrer"};
}

}  // namespace tandem::gateway
