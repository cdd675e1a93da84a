#include "services/program/metrics/probe.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <string>
#include <thread>

#include "services/program/metrics/endpoint.hpp"
#include "services/program/metrics/socket_address.hpp"
#include "services/program/system/descriptor.hpp"

namespace tandem::metrics {
namespace {

using testing::HasSubstr;

constexpr std::int64_t kPatienceNs = kSecond / 5;

/// Listens on any free port, and gives the first request this answer. Without one it never accepts.
class Stranger {
 public:
  explicit Stranger(const std::string& answer = {}) : fd_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    SocketAddress at{};
    socklen_t size = to_socket_address(address_, at);
    EXPECT_EQ(bind(fd_.get(), &at.any, size), 0);
    EXPECT_EQ(listen(fd_.get(), 8), 0);
    EXPECT_EQ(getsockname(fd_.get(), &at.any, &size), 0);
    address_.port = ntohs(at.v4.sin_port);
    if (answer.empty()) return;
    thread_ = std::jthread([this, answer] {
      const system::Descriptor connection(accept(fd_.get(), nullptr, nullptr));
      std::array<char, 512> request{};
      EXPECT_GT(recv(connection.get(), request.data(), request.size(), 0), 0);
      send(connection.get(), answer.data(), answer.size(), MSG_NOSIGNAL);
    });
  }

  [[nodiscard]] const Address& address() const { return address_; }

 private:
  Address address_;
  system::Descriptor fd_;
  std::jthread thread_;
};

std::string refusal(const std::string& answer) {
  const Stranger stranger(answer);
  const auto said = ask({stranger.address()}, kPatienceNs);
  return said ? "accepted" : said.error().message;
}

TEST(MetricsProbe, ReadsAnAddressWithOrWithoutAPath) {
  EXPECT_EQ(read_question("9730")->path, "/healthz");
  EXPECT_EQ(read_question("9730")->address, (Address{"127.0.0.1", 9730}));
  EXPECT_EQ(read_question("[::1]:9730/readyz")->path, "/readyz");
  EXPECT_EQ(read_question("[::1]:9730/readyz")->address, (Address{"::1", 9730}));
  EXPECT_THAT(read_question("9730/metrics").error().message, HasSubstr("/healthz or /readyz"));
  EXPECT_THAT(read_question("9730/").error().message, HasSubstr("/healthz or /readyz"));
  EXPECT_THAT(read_question("host:1").error().message, HasSubstr("ADDRESS:PORT"));
}

#ifdef TANDEM_PROMETHEUS
TEST(MetricsProbe, HearsWhatAnEndpointSays) {
  Health health;
  const auto endpoint = Endpoint::create({}, health, [](Page&) {});
  ASSERT_TRUE(endpoint) << endpoint.error().message;
  const Question alive{(*endpoint)->address()}, ready{(*endpoint)->address(), "/readyz"};
  health.beat(transport::steady_ns(), nullptr);
  EXPECT_EQ(ask(alive, kSecond).value(), "alive");
  EXPECT_EQ(ask(ready, kSecond).value(), "ready");
  health.beat(transport::steady_ns(), "it joins the session");
  EXPECT_TRUE(ask(alive, kSecond));
  EXPECT_EQ(ask(ready, kSecond).error().message, "it joins the session");
}
#endif

TEST(MetricsProbe, SaysWhyThereIsNoAnswer) {
  Address closed;
  {
    const Stranger gone;
    closed = gone.address();
  }
  EXPECT_THAT(ask({closed}, kPatienceNs).error().message, HasSubstr("Connection refused"));
  const Stranger silent;
  EXPECT_THAT(ask({silent.address()}, kPatienceNs).error().message, HasSubstr("nothing came in time"));
}

TEST(MetricsProbe, BelievesNothingButAGoodAnswer) {
  EXPECT_EQ(refusal("HTTP/1.1 200 OK\r\n\r\nalive\n"), "accepted");
  EXPECT_EQ(refusal("HTTP/1.1 503 No\r\n\r\nit \x1b[31mhangs\nmore\n"), "it [31mhangs");
  EXPECT_EQ(refusal("HTTP/1.1 500 No\r\n\r\n"), "it answers with an error");
  EXPECT_THAT(refusal("SSH-2.0-OpenSSH\r\n"), HasSubstr("it does not speak HTTP"));
  EXPECT_THAT(refusal("HTTP/1.1 2000"), HasSubstr("it answers with an error"));
  EXPECT_EQ(refusal("HTTP/1.1 200 OK\r\n\r\n" + std::string(100'000, 'x')), "accepted") << "and is cut";
}

}  // namespace
}  // namespace tandem::metrics
