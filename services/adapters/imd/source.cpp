#include "services/adapters/imd/source.hpp"

#include <fmt/format.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <memory>
#include <utility>

namespace tandem::imd {
namespace {

// GROMACS looks for clients once a second.
constexpr std::chrono::seconds kHandshakeLimit{10};

}  // namespace

Source::Source(Options options) : options_(std::move(options)), reader_(options_.atoms) {}

Source::~Source() {
  if (socket_ >= 0) {
    // LAMMPS would end the run at a KILL, and an engine that gets nothing may go on sending for a while.
    std::vector<std::byte> out;
    append_head(out, Type::kDisconnect, 0);
    send(out);
    ::shutdown(socket_, SHUT_RDWR);
  }
  if (thread_.joinable()) thread_.join();
  if (socket_ >= 0) ::close(socket_);
}

Result<void> Source::dial() {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* list = nullptr;
  if (const int wrong = ::getaddrinfo(options_.host.c_str(), options_.port.c_str(), &hints, &list);
      wrong != 0)
    return fail(ErrorCode::kTransport, fmt::format("{}: {}", place(), ::gai_strerror(wrong)));
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> addresses(list, &::freeaddrinfo);
  std::string why;
  for (const addrinfo* a = list; a != nullptr; a = a->ai_next) {
    socket_ = ::socket(a->ai_family, a->ai_socktype | SOCK_CLOEXEC, a->ai_protocol);
    if (socket_ >= 0 && ::connect(socket_, a->ai_addr, a->ai_addrlen) == 0) return {};
    why = std::strerror(errno);
    if (socket_ >= 0) ::close(std::exchange(socket_, -1));
  }
  return fail(ErrorCode::kTransport, fmt::format("no IMD engine at {}: {}", place(), why));
}

Result<Session> Source::connect() {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(options_.patience_s);
  for (;;) {
    const auto dialled = dial();
    if (dialled) break;
    if (std::chrono::steady_clock::now() > end) return tl::unexpected(dialled.error());
    std::this_thread::sleep_for(std::chrono::milliseconds{200});
  }
  const int on = 1;
  ::setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  thread_ = std::thread([this] { read(); });
  std::unique_lock lock(mutex_);
  if (!changed_.wait_for(lock, kHandshakeLimit, [this] { return session_ || !failure_.empty(); }))
    return fail(ErrorCode::kTimeout,
                fmt::format("{} says nothing: is it an IMD engine, without another client?", place()));
  if (!failure_.empty()) return fail(ErrorCode::kMalformed, failure_);
  return *session_;
}

void Source::read() {
  std::vector<std::byte> bytes(1U << 18U);
  for (;;) {
    const ssize_t got = ::recv(socket_, bytes.data(), bytes.size(), 0);
    if (got < 0 && errno == EINTR) continue;
    // Only this thread counts the frames.
    if (got <= 0)
      return end(fmt::format("{} closed the connection after {} frames", place(), newest_.number));
    const auto good = reader_.take(
        std::span(bytes).first(static_cast<std::size_t>(got)),
        [this](const Session& session) {
          std::vector<std::byte> out;
          append_head(out, Type::kGo, 0);
          if (options_.rate > 0) append_head(out, Type::kRate, options_.rate);
          send(out);
          const std::lock_guard lock(mutex_);
          session_ = session;
          changed_.notify_all();
        },
        [this](Frame& frame) { take(frame); });
    if (!good) return end(fmt::format("{}: {}", place(), good.error().message));
  }
}

void Source::end(const std::string& why) {
  const std::lock_guard lock(mutex_);
  failure_ = why;
  changed_.notify_all();
}

void Source::take(Frame& frame) {
  const std::lock_guard lock(mutex_);
  newest_.number = frame.number;
  std::swap(newest_.earlier, newest_.before);
  std::swap(newest_.before, newest_.now);
  std::swap(newest_.now, frame.positions);
  std::swap(newest_.velocities, frame.velocities);
  newest_.moment = frame.moment;
  newest_.box = frame.box;
  changed_.notify_all();
}

bool Source::wait(std::uint64_t after, std::chrono::milliseconds limit, Newest& out) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, limit, [&] { return newest_.number > after || !failure_.empty(); });
  if (newest_.number <= after) return false;
  out = newest_;
  return true;
}

bool Source::send(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent <= 0) return false;  // read() finds out why
    bytes = bytes.subspan(static_cast<std::size_t>(sent));
  }
  return true;
}

void Source::send_forces(std::span<const std::int32_t> atoms, std::span<const float> forces) {
  std::vector<std::byte> out;
  append_forces(out, atoms, forces, session_ && session_->swapped);
  send(out);
}

std::string Source::failure() const {
  const std::lock_guard lock(mutex_);
  return failure_;
}

}  // namespace tandem::imd
