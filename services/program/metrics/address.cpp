#include "services/program/metrics/address.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>

#include <array>

#include "services/program/number.hpp"

namespace tandem::metrics {
namespace {

constexpr std::string_view kLocalhost = "127.0.0.1";

tl::unexpected<Error> refuse(std::string_view text) {
  return fail(ErrorCode::kInvalidArgument,
              "must be PORT, ADDRESS:PORT or [ADDRESS]:PORT, with an address in numbers and a port of 0 to "
              "65535, not '" +
                  std::string(text.substr(0, 100)) + "'");
}

bool is_address(const std::string& host) {
  std::array<unsigned char, sizeof(in6_addr)> bytes{};
  const int family = host.find(':') == std::string::npos ? AF_INET : AF_INET6;
  return inet_pton(family, host.c_str(), bytes.data()) == 1;
}

}  // namespace

Result<Address> read_address(std::string_view text) {
  Address address;
  const std::size_t colon = text.rfind(':');
  std::string_view port = text;
  if (colon != std::string_view::npos) {
    std::string_view host = text.substr(0, colon);
    port = text.substr(colon + 1);
    const bool bracketed = host.size() > 2 && host.front() == '[' && host.back() == ']';
    if (bracketed) host = host.substr(1, host.size() - 2);
    if (bracketed != (host.find(':') != std::string_view::npos)) return refuse(text);
    address.host = host == "localhost" ? kLocalhost : host;
  }
  const auto read = text::number<std::uint16_t>(port);
  if (!read || !is_address(address.host)) return refuse(text);
  address.port = *read;
  return address;
}

std::string to_text(const Address& address) {
  const bool v6 = address.host.find(':') != std::string::npos;
  return (v6 ? "[" + address.host + "]" : address.host) + ":" + std::to_string(address.port);
}

bool is_loopback(const Address& address) { return address.host.starts_with("127.") || address.host == "::1"; }

}  // namespace tandem::metrics
