// What can be said of a connection before it is made. libnats reads a user's file when it connects, and names
// neither file nor cure.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "sdk/transport/nats/nats_bus.hpp"

namespace tandem::transport {
namespace {

constexpr std::size_t kMaxBytes = 1U << 20U;
constexpr unsigned kEverybody = 06;

tl::unexpected<Error> bad(const std::string& path, const std::string& what, const std::string& cure) {
  return fail(ErrorCode::kInvalidArgument, path + " " + what + ": " + cure);
}

Result<std::string> read(const std::string& path, bool secret, const std::string& cure) {
  const int opened = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);  // a pipe must stop nobody
  if (opened < 0) return bad(path, std::string("cannot be read (") + std::strerror(errno) + ")", cure);
  std::string text;
  struct stat about {};
  const bool regular = ::fstat(opened, &about) == 0 && S_ISREG(about.st_mode);
  std::array<char, 4096> piece{};
  for (ssize_t size = 1; regular && size > 0 && text.size() <= kMaxBytes;) {
    size = ::read(opened, piece.data(), piece.size());
    if (size > 0) text.append(piece.data(), static_cast<std::size_t>(size));
  }
  ::close(opened);
  if (!regular) return bad(path, "is no file", cure);
  if (secret && (about.st_mode & kEverybody) != 0)
    return bad(path, "can be read or changed by everybody", "chmod 600 " + path);
  return text;
}

bool has(const std::string& text, const char* what) { return text.find(what) != std::string::npos; }

}  // namespace

Result<void> check_nats_files(const NatsOptions& options) {
  if (!options.credentials.empty()) {
    const char* const cure = "give the file of a NATS user (.creds), as `nsc generate creds` writes it";
    const auto text = read(options.credentials, true, cure);
    if (!text) return tl::unexpected(text.error());
    if (!has(*text, "-----BEGIN NATS USER JWT-----") || !has(*text, "-----BEGIN USER NKEY SEED-----"))
      return bad(options.credentials, "has no NATS user with its seed", cure);
  }
  if (!options.tls_ca.empty()) {
    const char* const cure = "give the certificates of the authorities that sign those of the NATS server";
    const auto text = read(options.tls_ca, false, cure);
    if (!text) return tl::unexpected(text.error());
    if (!has(*text, "-----BEGIN CERTIFICATE-----"))
      return bad(options.tls_ca, "has no certificate (PEM)", cure);
    if (!has(options.url, "tls://"))
      return bad(options.tls_ca, "is for a connection with TLS", "begin the address with tls://");
  }
  return {};
}

std::string warning_without_tls(const std::string& url) {
  // One address with tls:// makes all of them so.
  if (url.empty() || has(url, "tls://")) return {};
  for (std::size_t at = 0; at < url.size();) {
    const std::size_t comma = std::min(url.find(',', at), url.size());
    std::string host = url.substr(at, comma - at);
    host.erase(0, std::min(host.find("://") + 3, host.size()));
    if (const std::size_t user = host.rfind('@'); user != std::string::npos) host.erase(0, user + 1);
    if (!host.starts_with("127.") && !host.starts_with("localhost") && !host.starts_with("[::1]"))
      return without_password(url) +
             " is without TLS (tls://): everybody on the way can read the session and a password, and change both";
    at = comma + 1;
  }
  return {};
}

}  // namespace tandem::transport
