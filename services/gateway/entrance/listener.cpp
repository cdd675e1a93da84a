#include "services/gateway/entrance/listener.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <linux/tcp.h>
#include <netinet/in.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <utility>

namespace tandem::gateway {
namespace {

constexpr int kOn = 1, kOff = 0;
// Maximum unsent bytes in the kernel for one connection. A small value decides late what is sent next; a
// larger one makes only slow viewers wait.
constexpr int kUnsentBytes = 16 * 1024;
constexpr int kSendBufferBytes = 256 * 1024;
// Those who wait here are taken within milliseconds; the kernel may allow fewer.
constexpr int kBacklog = 4096;
// Of the log, of files and of DDS.
constexpr std::size_t kOtherDescriptors = 128;

system::Descriptor open_reserve() { return system::Descriptor(::open("/dev/null", O_RDONLY | O_CLOEXEC)); }

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
  Listener listener(
      system::Descriptor(socket(is_six ? AF_INET6 : AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)));
  const int fd = listener.fd();
  if (fd < 0) return cannot(std::strerror(errno));
  const std::string why = is_six ? bind_and_listen(fd, reinterpret_cast<const sockaddr*>(&six), sizeof six)
                                 : bind_and_listen(fd, reinterpret_cast<const sockaddr*>(&four), sizeof four);
  if (!why.empty()) return cannot(why);
  return listener;
}

Listener::Listener(system::Descriptor socket) : socket_(std::move(socket)), reserve_(open_reserve()) {}

std::uint16_t Listener::port() const {
  sockaddr_storage own{};
  socklen_t size = sizeof own;
  getsockname(fd(), reinterpret_cast<sockaddr*>(&own), &size);
  return ntohs(own.ss_family == AF_INET6 ? reinterpret_cast<const sockaddr_in6&>(own).sin6_port
                                         : reinterpret_cast<const sockaddr_in&>(own).sin_port);
}

Listener::Accepted Listener::accept() {
  Accepted got;
  const auto take = [&] {
    socklen_t size = sizeof got.peer;
    return system::Descriptor(
        accept4(fd(), reinterpret_cast<sockaddr*>(&got.peer), &size, SOCK_CLOEXEC | SOCK_NONBLOCK));
  };
  do got.connection = take();
  while (!got.connection.is_open() && (errno == EINTR || errno == ECONNABORTED));
  if (got.connection.is_open()) {
    setsockopt(got.connection.get(), IPPROTO_TCP, TCP_NODELAY, &kOn, sizeof kOn);
    got.outcome = Outcome::kConnection;
    return got;
  }
  if (errno == EAGAIN || errno == EWOULDBLOCK) return got;
  got.outcome = Outcome::kNoDescriptor;
  reserve_ = system::Descriptor();
  // Without a descriptor the kernel does not say whether anybody waits.
  if (!take().is_open() && (errno == EAGAIN || errno == EWOULDBLOCK)) got.outcome = Outcome::kNothing;
  reserve_ = open_reserve();
  return got;
}

void say_too_many(const system::Descriptor& connection) {
  std::array<char, 1024> said{};  // what is not read makes the kernel drop the answer
  [[maybe_unused]] const ssize_t read = recv(connection.get(), said.data(), said.size(), MSG_DONTWAIT);
  constexpr std::string_view kAnswer =
      "HTTP/1.1 429 Too Many Requests\r\nconnection: close\r\nretry-after: 10\r\ncontent-type: text/plain\r\n"
      "content-length: 40\r\n\r\ntoo many connections from your address\r\n";
  [[maybe_unused]] const ssize_t sent =
      send(connection.get(), kAnswer.data(), kAnswer.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
  shutdown(connection.get(), SHUT_WR);
}

void keep_little_unsent(int connection) {
  setsockopt(connection, IPPROTO_TCP, TCP_NOTSENT_LOWAT, &kUnsentBytes, sizeof kUnsentBytes);
  setsockopt(connection, SOL_SOCKET, SO_SNDBUF, &kSendBufferBytes, sizeof kSendBufferBytes);
}

std::uint64_t received_bytes(int connection) {
  tcp_info info{};
  socklen_t size = sizeof info;
  return getsockopt(connection, IPPROTO_TCP, TCP_INFO, &info, &size) == 0 ? info.tcpi_bytes_received : 0;
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
