#include "services/program/metrics/endpoint.hpp"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstring>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#ifdef TANDEM_PROMETHEUS
namespace tandem::metrics {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

/// A client's socket, ended with the object.
class Caller {
 public:
  explicit Caller(const Endpoint& endpoint) : fd_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_port = htons(endpoint.address().port);
    inet_pton(AF_INET, endpoint.address().host.c_str(), &at.sin_addr);
    sockaddr any{};
    static_assert(sizeof(any) == sizeof(at));
    std::memcpy(&any, &at, sizeof(at));
    EXPECT_EQ(connect(fd_, &any, sizeof(any)), 0);
  }
  ~Caller() { close(fd_); }
  Caller(const Caller&) = delete;
  Caller& operator=(const Caller&) = delete;

  void say(std::string_view text) const { send(fd_, text.data(), text.size(), MSG_NOSIGNAL); }
  /// Everything until the end of the connection.
  [[nodiscard]] std::string hear() const {
    std::string all;
    std::array<char, 4096> piece{};
    for (ssize_t got = 0; (got = recv(fd_, piece.data(), piece.size(), 0)) > 0;)
      all.append(piece.data(), static_cast<std::size_t>(got));
    return all;
  }

 private:
  int fd_;
};

std::string get(const Endpoint& endpoint, const std::string& path) {
  const Caller caller(endpoint);
  caller.say("GET " + path + " HTTP/1.1\r\n\r\n");
  return caller.hear();
}

class EndpointTest : public testing::Test {
 protected:
  std::unique_ptr<Endpoint> start(const EndpointLimits& limits = {}) {
    auto made = Endpoint::create(
        {"127.0.0.1", 0}, health, [this](Page& page) { page.count("tandem_pages_total", "Pages", ++pages); },
        limits);
    EXPECT_TRUE(made.has_value());
    return std::move(*made);
  }

  Health health;
  std::atomic<int> pages = 0;
};

TEST_F(EndpointTest, ServesMetricsAndHealth) {
  const auto endpoint = start();
  EXPECT_THAT(get(*endpoint, "/metrics"), HasSubstr("\ntandem_pages_total 1\n"));
  EXPECT_THAT(get(*endpoint, "/healthz"), StartsWith("HTTP/1.1 200 "));
  EXPECT_THAT(get(*endpoint, "/readyz"), StartsWith("HTTP/1.1 503 "));
  health.beat(transport::steady_ns(), nullptr);
  EXPECT_THAT(get(*endpoint, "/readyz"), StartsWith("HTTP/1.1 200 "));
  health.beat(transport::steady_ns() - 2 * Health::kHangsNs, nullptr);
  EXPECT_THAT(get(*endpoint, "/healthz"), StartsWith("HTTP/1.1 503 "));
  EXPECT_THAT(get(*endpoint, "/"), StartsWith("HTTP/1.1 404 "));
}

TEST_F(EndpointTest, APortInUseIsToldInOneLine) {
  const auto endpoint = start();
  const auto second = Endpoint::create(endpoint->address(), health, [](Page&) {});
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::kIo);
  EXPECT_THAT(second.error().message, HasSubstr("Address already in use"));
  EXPECT_THAT(second.error().message, HasSubstr(to_text(endpoint->address())));
}

TEST_F(EndpointTest, APortIsFreeAgainAtOnce) {
  auto endpoint = start();
  const Address address = endpoint->address();
  static_cast<void>(get(*endpoint, "/metrics"));
  endpoint.reset();
  EXPECT_TRUE(Endpoint::create(address, health, [](Page&) {}).has_value());
}

TEST_F(EndpointTest, ManyScrapesShareAPage) {
  const auto endpoint = start({.page_ns = 60 * kSecond});
  for (int i = 0; i < 50; ++i) EXPECT_THAT(get(*endpoint, "/metrics"), HasSubstr("tandem_pages_total 1\n"));
  EXPECT_EQ(pages, 1);
}

TEST_F(EndpointTest, TheOldestConnectionMakesRoom) {
  const auto endpoint = start({.connections = 4, .longest_ns = 60 * kSecond});
  std::vector<std::unique_ptr<Caller>> silent;
  for (int i = 0; i < 12; ++i) silent.push_back(std::make_unique<Caller>(*endpoint));
  EXPECT_THAT(get(*endpoint, "/healthz"), StartsWith("HTTP/1.1 200 "));
  EXPECT_EQ(silent.front()->hear(), "");  // ended
}

TEST_F(EndpointTest, ARequestThatDoesNotEndIsEnded) {
  const auto endpoint = start({.longest_ns = kSecond / 10});
  const Caller caller(*endpoint);
  caller.say("GET /metrics HTTP/1.1\r\nX: ");
  EXPECT_EQ(caller.hear(), "");
}

TEST_F(EndpointTest, ARequestThatComesByteByByteIsEnded) {
  const auto endpoint = start({.longest_ns = kSecond / 5});
  const Caller caller(*endpoint);
  caller.say("GET /metrics HTTP/1.1\r\nX: ");
  const std::jthread drips([&caller](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      caller.say("x");
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  });
  EXPECT_EQ(caller.hear(), "");
}

TEST_F(EndpointTest, ALargeRequestIsRefused) {
  const auto endpoint = start();
  const Caller caller(*endpoint);
  caller.say("GET /metrics HTTP/1.1\r\nX: " + std::string(9000, 'x'));
  EXPECT_THAT(caller.hear(), testing::AnyOf("", StartsWith("HTTP/1.1 431 ")));
}

TEST_F(EndpointTest, ConnectionsComeAtABoundedRate) {
  const auto endpoint = start({.per_second = 50, .burst = 5});
  const std::int64_t began_ns = transport::steady_ns();
  for (int i = 0; i < 25; ++i) EXPECT_THAT(get(*endpoint, "/healthz"), StartsWith("HTTP/1.1 200 "));
  EXPECT_GE(transport::steady_ns() - began_ns, 19 * kSecond / 50);
}

TEST_F(EndpointTest, EndsWhileSomebodyIsConnected) {
  auto endpoint = start({.longest_ns = 60 * kSecond});
  const Caller caller(*endpoint);
  caller.say("GET");
  endpoint.reset();
  EXPECT_EQ(caller.hear(), "");
}

}  // namespace
}  // namespace tandem::metrics
#endif
