#include "services/engines/door/channel.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace tandem::engine::door {
namespace {

static_assert(kMaxPathBytes < sizeof sockaddr_un::sun_path);

tl::unexpected<Error> hung_up() { return fail(ErrorCode::kIo, "the engine hung up"); }

std::optional<ucred> credentials(int socket) {
  ucred peer{};
  socklen_t length = sizeof peer;
  if (::getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &peer, &length) != 0) return std::nullopt;
  return peer;
}

std::optional<sockaddr_un> address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() > kMaxPathBytes) return std::nullopt;
  std::memcpy(address.sun_path, path.data(), path.size());
  return address;
}

const sockaddr* generic(const sockaddr_un& address) {
  return reinterpret_cast<const sockaddr*>(&address);  // NOLINT: as bind(2) wants it
}

// An address of the network in numbers, as HOST:PORT; empty if it is none.
std::string text_of(const sockaddr_storage& address, socklen_t length) {
  std::array<char, NI_MAXHOST> host{};
  std::array<char, NI_MAXSERV> port{};
  if (::getnameinfo(reinterpret_cast<const sockaddr*>(&address), length, host.data(), host.size(),  // NOLINT
                    port.data(), port.size(), NI_NUMERICHOST | NI_NUMERICSERV) != 0)
    return {};
  const bool v6 = address.ss_family == AF_INET6;
  return fmt::format("{}{}{}:{}", v6 ? "[" : "", host.data(), v6 ? "]" : "", port.data());
}

void set_option(int socket, int level, int name, int value) {
  ::setsockopt(socket, level, name, &value, sizeof value);
}

bool is_of_network(int socket) {
  int domain = AF_UNIX;
  socklen_t length = sizeof domain;
  return ::getsockopt(socket, SOL_SOCKET, SO_DOMAIN, &domain, &length) == 0 && domain != AF_UNIX;
}

}  // namespace

Channel::Channel(system::Descriptor socket) : socket_(std::move(socket)) {
  const int flags = ::fcntl(socket_.get(), F_GETFL);
  ::fcntl(socket_.get(), F_SETFL, flags | O_NONBLOCK);
  ::fcntl(socket_.get(), F_SETFD, FD_CLOEXEC);
  if (is_of_network(socket_.get())) {
    set_option(socket_.get(), IPPROTO_TCP, TCP_NODELAY, 1);
    // An engine whose machine is gone is noticed after a minute, also while nothing is asked.
    set_option(socket_.get(), SOL_SOCKET, SO_KEEPALIVE, 1);
    set_option(socket_.get(), IPPROTO_TCP, TCP_KEEPIDLE, 30);
    set_option(socket_.get(), IPPROTO_TCP, TCP_KEEPINTVL, 10);
    set_option(socket_.get(), IPPROTO_TCP, TCP_KEEPCNT, 3);
  } else if (const auto who = credentials(socket_.get())) {
    peer_ = who->pid;
  }
}

std::string Channel::from() const {
  if (peer_ != 0) return fmt::format("process {}", peer_);
  sockaddr_storage address{};
  socklen_t length = sizeof address;
  const bool known =
      ::getpeername(socket_.get(), reinterpret_cast<sockaddr*>(&address), &length) == 0;  // NOLINT
  const std::string text = known ? text_of(address, length) : std::string();
  return text.empty() ? "a process that is not known" : text;
}

Result<void> Channel::flush() {
  while (unsent()) {
    iovec part{.iov_base = out_.data() + sent_, .iov_len = out_.size() - sent_};
    msghdr message{};
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    alignas(cmsghdr) std::array<std::byte, CMSG_SPACE(sizeof(int))> control{};
    if (passed_ >= 0) {
      message.msg_control = control.data();
      message.msg_controllen = control.size();
      cmsghdr* const head = CMSG_FIRSTHDR(&message);
      head->cmsg_level = SOL_SOCKET;
      head->cmsg_type = SCM_RIGHTS;
      head->cmsg_len = CMSG_LEN(sizeof(int));
      std::memcpy(CMSG_DATA(head), &passed_, sizeof passed_);
    }
    const ssize_t sent = ::sendmsg(socket_.get(), &message, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent < 0 && errno == EINTR) continue;
    if (sent < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return {};
    if (sent < 0) return hung_up();
    passed_ = -1;
    sent_ += static_cast<std::size_t>(sent);
  }
  out_.clear();
  sent_ = 0;
  return {};
}

Result<std::optional<Reader::Message>> Channel::receive() {
  for (;;) {
    auto room = reader_.room();
    if (!room) return tl::unexpected(room.error());
    if (!room->empty()) {
      const ssize_t got = ::recv(socket_.get(), room->data(), room->size(), MSG_DONTWAIT);
      if (got < 0 && errno == EINTR) continue;
      if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return std::nullopt;
      if (got <= 0) return hung_up();
      reader_.filled(static_cast<std::size_t>(got));
    }
    if (const auto message = reader_.take()) return message;
  }
}

Result<Listener> Listener::open(const std::string& path) {
  const auto refuse = [&path](const char* what) {
    return fail(ErrorCode::kIo, fmt::format("{}: {}: {}", path, what, std::strerror(errno)));
  };
  const auto address = address_of(path);
  if (!address)
    return fail(ErrorCode::kInvalidArgument, fmt::format("{}: the path of a socket has 1 to {} bytes, not {}",
                                                         path, kMaxPathBytes, path.size()));
  // What a server that was killed left behind; nothing else is removed.
  struct stat there {};
  if (::lstat(path.c_str(), &there) == 0 && S_ISSOCK(there.st_mode)) {
    const system::Descriptor probe(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    if (::connect(probe.get(), generic(*address), sizeof *address) == 0 || errno == EAGAIN)
      return fail(ErrorCode::kConflict, fmt::format("{}: another server waits for its engine there", path));
    ::unlink(path.c_str());
  }
  Listener listener;
  listener.socket_ = system::Descriptor(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!listener.socket_.is_open()) return refuse("no socket");
  const mode_t before = ::umask(0177);
  const int bound = ::bind(listener.socket_.get(), generic(*address), sizeof *address);
  ::umask(before);
  if (bound != 0) return refuse("no socket can be made there");
  listener.place_ = path;
  if (::listen(listener.socket_.get(), 4) != 0) return refuse("nobody can connect");
  return listener;
}

Result<Listener> Listener::open_port(const std::string& host, std::uint16_t port) {
  addrinfo wanted{};
  wanted.ai_flags = AI_NUMERICHOST | AI_NUMERICSERV | AI_PASSIVE;
  wanted.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (::getaddrinfo(host.c_str(), std::to_string(port).c_str(), &wanted, &found) != 0)
    return fail(ErrorCode::kInvalidArgument, fmt::format("{}: not an address in numbers", host));
  Listener listener;
  listener.is_port_ = true;
  listener.socket_ =
      system::Descriptor(::socket(found->ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const int fd = listener.socket_.get();
  set_option(fd, SOL_SOCKET, SO_REUSEADDR, 1);  // what was said to an engine before may still be under way
  const bool good = fd >= 0 && ::bind(fd, found->ai_addr, found->ai_addrlen) == 0 && ::listen(fd, 8) == 0;
  const int why = errno;
  ::freeaddrinfo(found);
  if (!good)
    return fail(ErrorCode::kIo,
                fmt::format("nobody can connect at {} port {}: {}", host, port, std::strerror(why)));
  sockaddr_storage address{};
  socklen_t length = sizeof address;
  ::getsockname(fd, reinterpret_cast<sockaddr*>(&address), &length);  // NOLINT: as getsockname(2) wants it
  listener.place_ = "tcp:" + text_of(address, length);
  return listener;
}

Listener::Listener(Listener&& other) noexcept
    : socket_(std::move(other.socket_)), place_(std::exchange(other.place_, {})), is_port_(other.is_port_) {}

Listener& Listener::operator=(Listener&& other) noexcept {
  std::swap(socket_, other.socket_);
  std::swap(place_, other.place_);
  std::swap(is_port_, other.is_port_);
  return *this;
}

Listener::~Listener() {
  if (!place_.empty() && !is_port_) ::unlink(place_.c_str());
}

std::optional<Channel> Listener::accept(std::string& told) {
  if (!socket_.is_open()) return std::nullopt;
  system::Descriptor socket(::accept4(socket_.get(), nullptr, nullptr, SOCK_CLOEXEC));
  if (!socket.is_open()) return std::nullopt;
  if (is_port_) return Channel(std::move(socket));  // it has to show the token
  const auto who = credentials(socket.get());
  if (who && who->uid == ::geteuid()) return Channel(std::move(socket));
  told = fmt::format("process {} of user {} knocked at {}: refused", who ? who->pid : 0, who ? who->uid : 0,
                     place_);
  return std::nullopt;
}

}  // namespace tandem::engine::door
