#include "sdk/transport/websocket/web_address.hpp"

#include <algorithm>
#include <charconv>

namespace tandem::transport {
namespace {

constexpr std::size_t kMaxUrlBytes = 4096;
constexpr std::string_view kSocket = "tandem";  // the last part of the WebSocket's path

tl::unexpected<Error> refuse(const std::string& why) {
  return fail(ErrorCode::kInvalidArgument, "a url is wss://HOST[:PORT]/ or ws://HOST[:PORT]/: " + why);
}

bool is_printable(std::string_view text) {
  return std::ranges::all_of(text, [](char c) { return c > ' ' && c < '\x7f'; });
}

/// The part in front of the first of `marks`, which is cut off `rest`.
std::string_view cut(std::string_view& rest, std::string_view marks) {
  const std::size_t at = std::min(rest.find_first_of(marks), rest.size());
  const std::string_view head = rest.substr(0, at);
  rest.remove_prefix(at);
  return head;
}

Result<std::uint16_t> read_port(std::string_view text) {
  std::uint16_t port = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  if (error != std::errc() || end != text.data() + text.size() || port == 0)
    return refuse("a port is a number from 1 to 65535");
  return port;
}

}  // namespace

std::string WebAddress::text() const {
  const bool bare = host.find(':') != std::string::npos;
  return std::string(encrypted ? "wss://" : "ws://") + (bare ? "[" + host + "]" : host) + ":" +
         std::to_string(port) + path;
}

Result<WebAddress> read_web_address(std::string_view url) {
  if (url.size() > kMaxUrlBytes) return refuse("it is longer than 4,096 bytes");
  if (!is_printable(url)) return refuse("it has a character that has to be written with %");
  WebAddress address;
  const std::size_t scheme_end = url.find("://");
  const std::string_view scheme = url.substr(0, scheme_end == std::string_view::npos ? 0 : scheme_end);
  if (scheme == "wss" || scheme == "https") {
    address.encrypted = true;
  } else if (scheme != "ws" && scheme != "http") {
    return refuse("it begins with wss://, ws://, https:// or http://");
  }
  url.remove_prefix(scheme_end + 3);
  if (const std::size_t mark = url.find('#'); mark != std::string_view::npos) {
    address.token = url.substr(mark + 1);
    url = url.substr(0, mark);
  }
  std::string_view authority = cut(url, "/?");
  if (authority.find('@') != std::string_view::npos) return refuse("it names a user; a gateway has tokens");
  if (authority.starts_with('[')) {
    const std::size_t end = authority.find(']');
    if (end == std::string_view::npos) return refuse("an IPv6 address stands in [ ]");
    address.host = authority.substr(1, end - 1);
    authority.remove_prefix(end + 1);
  } else {
    address.host = cut(authority, ":");
  }
  if (address.host.empty()) return refuse("the host is missing");
  address.port = address.encrypted ? 443 : 80;
  if (!authority.empty()) {
    if (authority.front() != ':') return refuse("behind the host stands :PORT or /");
    const auto port = read_port(authority.substr(1));
    if (!port) return tl::unexpected<Error>(port.error());
    address.port = *port;
  }
  if (url.find('?') != std::string_view::npos)
    return refuse("nothing may stand behind '?'; a token is an option of its own, or stands behind '#'");
  address.path = url.empty() ? "/" : std::string(url);
  if (!address.path.ends_with("/" + std::string(kSocket))) {
    if (!address.path.ends_with('/')) address.path += '/';
    address.path += kSocket;
  }
  return address;
}

}  // namespace tandem::transport
