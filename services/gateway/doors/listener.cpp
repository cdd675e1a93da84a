#include "services/gateway/doors/listener.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

namespace tandem::gateway {
namespace {

constexpr int kOn = 1, kOff = 0;
// Those who wait here are taken within milliseconds; the kernel may allow fewer.
constexpr int kBacklog = 4096;
// Of the log, of files and of DDS.
constexpr std::size_t kOtherDescriptors = 128;

int open_reserve() { return ::open("/dev/null", O_RDONLY | O_CLOEXEC); }

std::string bind_and_listen(int fd, const sockaddr* address, socklen_t size) {
  setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &kOn, sizeof kOn);
  if (address->sa_family == AF_INET6) setsockopt(fd, IPPROTO_IPV6, IPV6_V6ONLY, &kOff, sizeof kOff);
  if (bind(fd, address, size) != 0 || listen(fd, kBacklog) != 0) return std::strerror(errno);
  return {};
}

}  // namespace

Result<Listener> Listener::open(const std::string& address, std::uint16_t port) {
  const auto cannot = [&](std::string_view why) {
    return fail(ErrorCode::kIo, fmt::format("cannot listen on {} port {}: {}", address, port, why));
  };
  sockaddr_in6 six{};
  sockaddr_in four{};
  six.sin6_family = AF_INET6;
  four.sin_family = AF_INET;
  six.sin6_port = four.sin_port = htons(port);
  const bool is_six = inet_pton(AF_INET6, address.c_str(), &six.sin6_addr) == 1;
  if (!is_six && inet_pton(AF_INET, address.c_str(), &four.sin_addr) != 1)
    return cannot("not an IPv4 or IPv6 address");
  const int fd = socket(is_six ? AF_INET6 : AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0) return cannot(std::strerror(errno));
  Listener listener(fd);
  const std::string why = is_six ? bind_and_listen(fd, reinterpret_cast<const sockaddr*>(&six), sizeof six)
                                 : bind_and_listen(fd, reinterpret_cast<const sockaddr*>(&four), sizeof four);
  if (!why.empty()) return cannot(why);
  return listener;
}

Listener::Listener(int fd) : fd_(fd), reserve_(open_reserve()) {}
Listener::Listener(Listener&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)), reserve_(std::exchange(other.reserve_, -1)) {}
Listener::~Listener() {
  if (fd_ >= 0) close(fd_);
  if (reserve_ >= 0) close(reserve_);
}

std::uint16_t Listener::port() const {
  sockaddr_storage own{};
  socklen_t size = sizeof own;
  getsockname(fd_, reinterpret_cast<sockaddr*>(&own), &size);
  return ntohs(own.ss_family == AF_INET6 ? reinterpret_cast<const sockaddr_in6&>(own).sin6_port
                                         : reinterpret_cast<const sockaddr_in&>(own).sin_port);
}

Listener::Accepted Listener::accept() {
  Accepted got;
  const auto take = [&] {
    socklen_t size = sizeof got.peer;
    return accept4(fd_, reinterpret_cast<sockaddr*>(&got.peer), &size, SOCK_CLOEXEC | SOCK_NONBLOCK);
  };
  do got.fd = take();
  while (got.fd < 0 && (errno == EINTR || errno == ECONNABORTED));
  if (got.fd >= 0) {
    setsockopt(got.fd, IPPROTO_TCP, TCP_NODELAY, &kOn, sizeof kOn);
    got.outcome = Outcome::kConnection;
    return got;
  }
  if (errno == EAGAIN || errno == EWOULDBLOCK) return got;
  got.outcome = Outcome::kNoDescriptor;
  if (reserve_ >= 0) close(reserve_);
  const int fd = take();
  if (fd >= 0) close(fd);
  // Without a descriptor the kernel does not say whether anybody waits.
  else if (errno == EAGAIN || errno == EWOULDBLOCK)
    got.outcome = Outcome::kNothing;
  got.fd = -1;
  reserve_ = open_reserve();
  return got;
}

std::size_t connections_that_fit(std::size_t wanted) {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return wanted;
  const rlim_t needed = wanted + kOtherDescriptors;
  if (limit.rlim_cur < needed) {
    limit.rlim_cur = std::min<rlim_t>(needed, limit.rlim_max);
    if (setrlimit(RLIMIT_NOFILE, &limit) != 0) getrlimit(RLIMIT_NOFILE, &limit);
  }
  if (limit.rlim_cur >= needed) return wanted;
  return limit.rlim_cur > 2 * kOtherDescriptors ? limit.rlim_cur - kOtherDescriptors : limit.rlim_cur / 2;
}

}  // namespace tandem::gateway
