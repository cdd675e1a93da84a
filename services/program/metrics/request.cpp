#include "services/program/metrics/request.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace tandem::metrics {
namespace {

std::string_view reason_of(int status) {
  switch (status) {
    case 200:
      return "OK";
    case 400:
      return "Bad Request";
    case 404:
      return "Not Found";
    case 405:
      return "Method Not Allowed";
    case 431:
      return "Request Header Fields Too Large";
    default:
      return "Service Unavailable";
  }
}

// METHOD SP PATH SP HTTP/1.x
std::optional<Request> read_line(std::string_view line) {
  const std::size_t first = line.find(' ');
  const std::size_t last = line.rfind(' ');
  if (first == std::string_view::npos || first == last) return std::nullopt;
  const std::string_view method = line.substr(0, first);
  const std::string_view target = line.substr(first + 1, last - first - 1);
  if (method.empty() || !target.starts_with('/') || target.find(' ') != std::string_view::npos ||
      !line.substr(last + 1).starts_with("HTTP/1."))
    return std::nullopt;
  Request request{.method = Request::Method::kOther, .path = target.substr(0, target.find('?'))};
  if (method == "GET") request.method = Request::Method::kGet;
  if (method == "HEAD") request.method = Request::Method::kHead;
  return request;
}

}  // namespace

Reading read_request(std::string_view received) {
  const std::size_t end = std::min(received.find("\r\n\r\n"), received.find("\n\n"));
  if (end == std::string_view::npos) return {};
  std::string_view line = received.substr(0, std::min(received.find('\n'), end));
  if (line.ends_with('\r')) line.remove_suffix(1);
  return {.complete = true, .request = read_line(line)};
}

std::string response(int status, std::string_view type, std::string_view body, bool head) {
  return fmt::format(
      "HTTP/1.1 {} {}\r\nContent-Type: {}\r\nContent-Length: {}\r\nCache-Control: no-store\r\n"
      "X-Content-Type-Options: nosniff\r\nConnection: close\r\n\r\n{}",
      status, reason_of(status), type, body.size(), head ? std::string_view() : body);
}

}  // namespace tandem::metrics
