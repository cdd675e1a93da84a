#include "services/program/metrics/endpoint.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <deque>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "services/program/metrics/process_series.hpp"
#include "services/program/metrics/request.hpp"
#include "services/program/metrics/socket_address.hpp"
#include "services/program/system/descriptor.hpp"
#include "services/program/token_bucket.hpp"

namespace tandem::metrics {
namespace {

using system::Descriptor;
using transport::steady_ns;

tl::unexpected<Error> refuse(const Address& address, const char* what) {
  return fail(ErrorCode::kIo,
              fmt::format("metrics cannot be served at {}: {}: {}", to_text(address), what, strerror(errno)));
}

/// Listens, and sets the port that was taken.
Result<Descriptor> listen_at(Address& address) {
  SocketAddress at{};
  socklen_t size = to_socket_address(address, at);
  Descriptor fd(socket(at.any.sa_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (fd.get() < 0) return refuse(address, "socket");
  const int yes = 1;
  setsockopt(fd.get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
  if (bind(fd.get(), &at.any, size) != 0) return refuse(address, "bind");
  constexpr int kBacklog = 128;
  if (listen(fd.get(), kBacklog) != 0) return refuse(address, "listen");
  if (getsockname(fd.get(), &at.any, &size) == 0)
    address.port = ntohs(at.any.sa_family == AF_INET ? at.v4.sin_port : at.v6.sin6_port);
  return fd;
}

struct Connection {
  Descriptor fd;
  std::int64_t end_ns = 0;
  std::string received, answer = {};
  std::size_t sent = 0;
  bool over = false;

  [[nodiscard]] bool answering() const { return !answer.empty(); }
};

}  // namespace

struct Endpoint::Impl {
  Impl(Address at, Descriptor listening, const Health& state, Describe program, const EndpointLimits& bounds)
      : address(std::move(at)),
        limits(bounds),
        listener(std::move(listening)),
        stop_event(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
        health(&state),
        describe(std::move(program)),
        pace(static_cast<double>(std::max<std::int64_t>(bounds.per_second, 1)),
             static_cast<double>(bounds.burst)),
        thread([this](const std::stop_token& stop) { run(stop); }) {}
  ~Impl() {
    thread.request_stop();
    eventfd_write(stop_event.get(), 1);
    thread.join();
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void run(const std::stop_token& stop) {
    pthread_setname_np(pthread_self(), "metrics");
    while (!stop.stop_requested()) {
      wait();
      for (Connection& connection : connections) serve(connection);
      std::erase_if(connections, [](const Connection& connection) { return connection.over; });
      accept_due();
    }
  }

  /// Waits until a connection can go on, a new one may be accepted, or time is over for one.
  void wait() {
    const std::int64_t now_ns = steady_ns();
    std::int64_t until_ns = now_ns + 60 * kSecond;
    polled.assign(1, {.fd = stop_event.get(), .events = POLLIN, .revents = 0});
    if (const std::int64_t next_ns = next_accept_ns(now_ns); next_ns <= now_ns) {
      polled.push_back({.fd = listener.get(), .events = POLLIN, .revents = 0});
    } else {
      until_ns = next_ns;
    }
    for (const Connection& connection : connections) {
      polled.push_back({.fd = connection.fd.get(),
                        .events = static_cast<short>(connection.answering() ? POLLOUT : POLLIN),
                        .revents = 0});
      until_ns = std::min(until_ns, connection.end_ns);
    }
    const std::int64_t wait_ms =
        (std::max<std::int64_t>(until_ns - now_ns, 0) + kMillisecond - 1) / kMillisecond;
    poll(polled.data(), polled.size(), static_cast<int>(wait_ms));
  }

  std::int64_t next_accept_ns(std::int64_t now_ns) {
    return std::max(now_ns + pace.wait_ns(now_ns), paused_until_ns);
  }

  void accept_due() {
    for (std::int64_t now_ns = steady_ns(); next_accept_ns(now_ns) <= now_ns; now_ns = steady_ns()) {
      Descriptor fd(accept4(listener.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
      if (!fd.is_open()) {
        // No descriptors or no memory: waiting in poll() would not wait.
        if (errno != EAGAIN && errno != ECONNABORTED && errno != EINTR)
          paused_until_ns = now_ns + kSecond / 10;
        return;
      }
      pace.spend(1);
      if (connections.size() >= limits.connections) connections.pop_front();
      connections.push_back({.fd = std::move(fd), .end_ns = now_ns + limits.longest_ns, .received = {}});
      serve(connections.back());  // a scraper's request mostly is there already
      if (connections.back().over) connections.pop_back();
    }
  }

  void serve(Connection& connection) {
    if (!connection.answering()) receive(connection);
    if (connection.answering()) send_more(connection);
    if (steady_ns() >= connection.end_ns) connection.over = true;
  }

  void receive(Connection& connection) {
    std::array<char, 2048> piece{};
    while (!connection.over && !connection.answering()) {
      const ssize_t got = recv(connection.fd.get(), piece.data(), piece.size(), 0);
      if (got < 0 && (errno == EAGAIN || errno == EINTR)) return;
      if (got <= 0) {
        connection.over = true;
        return;
      }
      connection.received.append(piece.data(), static_cast<std::size_t>(got));
      const Reading reading = read_request(connection.received);
      if (reading.complete) {
        connection.answer = answer(reading.request);
      } else if (connection.received.size() > kMaxRequestBytes) {
        connection.answer = response(431, kPlain, "the request is too large\n", false);
      }
    }
  }

  static void send_more(Connection& connection) {
    while (connection.sent < connection.answer.size()) {
      const ssize_t sent = send(connection.fd.get(), connection.answer.data() + connection.sent,
                                connection.answer.size() - connection.sent, MSG_NOSIGNAL);
      if (sent < 0 && (errno == EAGAIN || errno == EINTR)) return;
      if (sent <= 0) break;
      connection.sent += static_cast<std::size_t>(sent);
    }
    shutdown(connection.fd.get(), SHUT_WR);
    connection.over = true;
  }

  std::string answer(const std::optional<Request>& request) {
    if (!request) return response(400, kPlain, "this is not HTTP\n", false);
    const bool head = request->method == Request::Method::kHead;
    if (request->method == Request::Method::kOther)
      return response(405, kPlain, "only GET and HEAD are served\n", false);
    if (request->path == "/metrics")
      return response(200, "text/plain; version=0.0.4; charset=utf-8", page(), head);
    if (request->path == "/healthz") return answer(health->alive(), head);
    if (request->path == "/readyz") return answer(health->ready(), head);
    return response(404, kPlain, "/metrics, /healthz and /readyz are served\n", head);
  }
  static std::string answer(const Health::Answer& state, bool head) {
    return response(state.good ? 200 : 503, kPlain, state.text, head);
  }

  /// Kept for a moment, so that many scrapes cost little more than one.
  const std::string& page() {
    const std::int64_t now_ns = steady_ns();
    if (!text.empty() && now_ns - text_ns < limits.page_ns) return text;
    Page made;
    made.gauge("tandem_build_info", "The version of the program, as a label", 1,
               {{"version", TANDEM_VERSION}});
    made.gauge("tandem_alive", "1 if the program's work goes on: /healthz", health->alive().good ? 1 : 0);
    made.gauge("tandem_ready", "1 if the program does what it is for: /readyz", health->ready().good ? 1 : 0);
    describe(made);
    describe_process(made);
    made.gauge("tandem_scrape_duration_seconds", "Time to make the last page before this one", made_s);
    text = to_text(made);
    text_ns = now_ns;
    made_s = static_cast<double>(steady_ns() - now_ns) / 1e9;
    return text;
  }

  static constexpr std::string_view kPlain = "text/plain; charset=utf-8";

  Address address;
  EndpointLimits limits;
  Descriptor listener, stop_event;
  const Health* health;
  Describe describe;
  // Of the thread alone.
  accounts::TokenBucket pace;  // of connections that are accepted
  std::int64_t paused_until_ns = 0;
  std::deque<Connection> connections;  // oldest first
  std::vector<pollfd> polled;
  std::string text;
  std::int64_t text_ns = 0;
  double made_s = 0;
  std::jthread thread;  // last: all above is there when it starts
};

Result<std::unique_ptr<Endpoint>> Endpoint::create(const Address& address, const Health& health,
                                                   Describe describe, const EndpointLimits& limits) {
  if (!has_text()) {
    return fail(ErrorCode::kUnsupported,
                "this build has no metrics: prometheus-cpp (prometheus-cpp-dev) was missing");
  }
  Address at = address;
  auto listener = listen_at(at);
  if (!listener) return tl::unexpected(listener.error());
  return std::unique_ptr<Endpoint>(new Endpoint(
      std::make_unique<Impl>(std::move(at), std::move(*listener), health, std::move(describe), limits)));
}

Result<void> check_address(const Address& address) {
  Address any_port{.host = address.host};
  if (listen_at(any_port)) return {};
  return fail(ErrorCode::kTransport, to_text(address) + ": no interface of this machine has this address");
}

Endpoint::Endpoint(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Endpoint::~Endpoint() = default;

const Address& Endpoint::address() const { return impl_->address; }

std::string Endpoint::notice() const {
  return fmt::format("metrics at http://{}/metrics{}", to_text(impl_->address),
                     is_loopback(impl_->address) ? "" : ", for every host that can reach this address");
}

}  // namespace tandem::metrics
