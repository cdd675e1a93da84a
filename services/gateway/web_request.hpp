#pragma once
// What a request says, and what every answer has in its head.

#include <libwebsockets.h>

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace tandem::gateway {

/// Empty if it is missing.
[[nodiscard]] std::string header(lws* wsi, lws_token_indexes token);

/// Whether a list of subprotocols, with commas and spaces between them, has this one.
[[nodiscard]] bool names(std::string_view list, std::string_view wanted);

/// Whether the request says that a body follows, of whatever length.
[[nodiscard]] bool has_body(lws* wsi);

/// The token in a header, Tandem-Token or else Authorization: Bearer; empty if it is not there. Untrusted. No
/// page of another site can have a browser send it. Authorization may be a proxy's own.
[[nodiscard]] std::string header_token_of(lws* wsi);

/// The token of a request; empty if it has none. Untrusted. The first of these counts: Tandem-Token, the
/// gateway's cookie, Authorization: Bearer, ?token=.
[[nodiscard]] std::string token_of(lws* wsi);

/// What an answer 401 has as WWW-Authenticate, so that the page tells it from that of a proxy.
inline constexpr std::string_view kChallenge = "Bearer realm=\"tandem\"";

/// The value of Set-Cookie that makes a browser give this token to this gateway and to no script. `lasts_s`:
/// 0 for as long as the browser runs.
[[nodiscard]] std::string cookie_of(lws* wsi, std::string_view token, std::int64_t lasts_s, bool encrypted);

/// Whether a proxy says that its client came over TLS. Only a trusted one may be believed.
[[nodiscard]] bool proxy_says_https(lws* wsi);

/// Heads of every answer. `origins`: pages that may show the viewer in a frame; * counts for none. Not
/// copied, because libwebsockets keeps the address of the list.
class SafeHeads {
 public:
  explicit SafeHeads(const std::vector<std::string>& origins);
  SafeHeads(const SafeHeads&) = delete;
  SafeHeads& operator=(const SafeHeads&) = delete;
  SafeHeads(SafeHeads&&) = delete;
  SafeHeads& operator=(SafeHeads&&) = delete;
  ~SafeHeads() = default;

  [[nodiscard]] const lws_protocol_vhost_options* list() const { return heads_.data(); }

 private:
  std::string policy_;
  std::array<lws_protocol_vhost_options, 3> heads_{};
};

/// Strict-Transport-Security in answers over TLS to a host name: browsers then use TLS only, for half a year.
inline constexpr std::string_view kStrictTransport = "max-age=15552000";

}  // namespace tandem::gateway
