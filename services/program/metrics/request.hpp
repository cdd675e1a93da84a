#pragma once
// As much of HTTP as a scrape needs, without a socket.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace tandem::metrics {

/// Maximum size of a request, which is its line and headers. Prometheus sends about 300 bytes.
inline constexpr std::size_t kMaxRequestBytes = 8192;

struct Request {
  enum class Method : std::uint8_t { kGet, kHead, kOther };
  Method method = Method::kOther;
  std::string_view path;  ///< without a query; a part of the text that was read
};

/// What was received so far. Untrusted: any bytes.
struct Reading {
  bool complete = false;           ///< its headers have ended
  std::optional<Request> request;  ///< empty in a complete reading: not HTTP
};
[[nodiscard]] Reading read_request(std::string_view received);

/// A whole answer, after which the connection ends. `head`: the headers alone.
[[nodiscard]] std::string response(int status, std::string_view type, std::string_view body, bool head);

}  // namespace tandem::metrics
