// Engines that come over the network: strangers, lies in the inline form, and what is saved on another
// machine.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <future>
#include <mutex>
#include <thread>

#include "services/engines/door/callers.hpp"
#include "services/engines/door/door.hpp"
#include "services/program/system/descriptor.hpp"

namespace tandem::engine::door {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

constexpr const char* kToken = "0123456789abcdef";

/// A server that waits at a port of its own.
class Waiting {
 public:
  explicit Waiting(double call_limit_s = 10) {
    DoorOptions options{.way = {.host = "127.0.0.1", .token = kToken}};
    options.call_limit_s = call_limit_s;
    options.start_limit_s = 5;
    options.stop = &stop_;
    options.log = [this](const std::string& line, bool) {
      const std::lock_guard lock(mutex_);
      lines_.push_back(line);
    };
    door_ = std::async(std::launch::async,
                       [options = std::move(options)]() mutable { return Door::open(std::move(options)); });
  }
  ~Waiting() { stop_ = true; }
  Waiting(const Waiting&) = delete;
  Waiting& operator=(const Waiting&) = delete;
  Waiting(Waiting&&) = delete;
  Waiting& operator=(Waiting&&) = delete;

  std::vector<std::string> lines() {
    const std::lock_guard lock(mutex_);
    return lines_;
  }
  bool says(const std::string& text) {
    return within([&] {
      for (const std::string& line : lines())
        if (line.find(text) != std::string::npos) return true;
      return false;
    });
  }
  int port() {
    int found = 0;
    within([&] {
      for (const std::string& line : lines())
        if (const auto at = line.rfind(':'); line.starts_with("waits"))
          found = std::stoi(line.substr(at + 1));
      return found != 0;
    });
    return found;
  }
  Result<std::unique_ptr<Door>> door() { return door_.get(); }

 private:
  static bool within(const std::function<bool()>& holds) {
    for (int i = 0; i < 1000; ++i) {
      if (holds()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds{10});
    }
    return false;
  }

  std::atomic<bool> stop_{false};
  std::mutex mutex_;
  std::vector<std::string> lines_;
  std::future<Result<std::unique_ptr<Door>>> door_;
};

class Stranger {
 public:
  explicit Stranger(int port) : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    timeval limit{.tv_sec = 10, .tv_usec = 0};
    ::setsockopt(socket_.get(), SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    EXPECT_EQ(::connect(socket_.get(), reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  }
  void send(std::string_view bytes) {
    EXPECT_EQ(::send(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL), ssize_t(bytes.size()));
  }
  void hello(std::string_view lines) {
    std::vector<std::byte> out;
    append(out, Type::kHello, lines);
    send({reinterpret_cast<const char*>(out.data()), out.size()});
  }
  /// What it is told until the server hangs up.
  std::string told() {
    std::string text;
    std::array<char, 4096> bytes{};
    for (ssize_t got = 1; got > 0;) {
      got = ::recv(socket_.get(), bytes.data(), bytes.size(), 0);
      if (got > 0) text.append(bytes.data(), static_cast<std::size_t>(got));
    }
    return text;
  }

 private:
  system::Descriptor socket_;
};

/// An engine that connects with the right token, as another program would.
void start_engine(int port, const std::string& words, const std::string& token = kToken) {
  const std::string command = "TANDEM_DOOR=tcp:127.0.0.1:" + std::to_string(port) +
                              " TANDEM_DOOR_TOKEN=" + token + " " + DOOR_ENGINE + " small " + words +
                              " 2>/dev/null &";
  ASSERT_EQ(std::system(command.c_str()), 0);
}

TEST(NetworkDoor, StrangersAreTurnedAwayAndTheEngineComesIn) {
  Waiting waiting;
  const int port = waiting.port();
  ASSERT_NE(port, 0);
  Stranger silent(port), web(port), nobody(port), liar(port), half(port);
  half.send("\1\0");
  web.send("GET / HTTP/1.1\r\nHost: x\r\n\r\n");
  EXPECT_THAT(web.told(), HasSubstr("unknown type"));
  nobody.hello("engine 1.1\nmemory inline\ncapacity 5\ndt 0.1\n");
  EXPECT_THAT(nobody.told(), HasSubstr("it showed no token"));
  liar.hello("engine 1.1\nmemory inline\ncapacity 5\ndt 0.1\ntoken 0123456789abcdeF\n");
  EXPECT_THAT(liar.told(), HasSubstr("did not show the token"));
  EXPECT_TRUE(waiting.says("called as an engine: refused"));
  for (const std::string& line : waiting.lines())
    EXPECT_EQ(line.find("0123456789"), std::string::npos) << line;
  start_engine(port, "good");
  const auto door = waiting.door();
  ASSERT_TRUE(door.has_value()) << door.error().message;
  for (int i = 0; i < 3; ++i) (*door)->step();
  EXPECT_EQ((*door)->failure(), "");
  EXPECT_EQ((*door)->bodies().position[0][5], 5.375F);
  Stranger second(port);
  second.hello("engine 1.1\n");
  for (int i = 0; i < 10; ++i) {
    static_cast<void>((*door)->failure());
    std::this_thread::sleep_for(std::chrono::milliseconds{25});
  }
  EXPECT_THAT(second.told(), HasSubstr("has an engine already"));
  (*door)->step();
  EXPECT_EQ((*door)->failure(), "");
}

TEST(NetworkDoor, AFloodOfSilentCallersDoesNotKeepTheEngineOut) {
  Waiting waiting;
  const int port = waiting.port();
  std::vector<std::unique_ptr<Stranger>> flood;
  for (std::size_t i = 0; i < 3 * Callers::kMaxCallers; ++i)
    flood.push_back(std::make_unique<Stranger>(port));
  start_engine(port, "good");
  const auto door = waiting.door();
  ASSERT_TRUE(door.has_value()) << door.error().message;
}

TEST(NetworkDoor, ACallerThatSaysNothingIsForgotten) {
  Waiting waiting(0.2);
  Stranger silent(waiting.port());
  EXPECT_THAT(silent.told(), HasSubstr("did not say HELLO in time"));
}

TEST(NetworkDoor, TheNextDoorOpensAtTheSamePlaceWhileTheOldOneIsThere) {
  const std::string path = ::testing::TempDir() + "next_door_" + std::to_string(::getpid());
  for (const bool network : {false, true}) {
    Way way{.path = path};
    const std::string place = network ? Listener::open_port("127.0.0.1", 0)->place() : path;  // a free port
    const std::string port = place.substr(place.rfind(':') + 1);
    if (network)
      way = {.host = "127.0.0.1", .port = static_cast<std::uint16_t>(std::stoi(port)), .token = kToken};
    std::unique_ptr<Door> before;
    for (int life = 0; life < 3; ++life) {
      const std::string command = "(sleep 0.2; TANDEM_DOOR_TOKEN=" + std::string(kToken) +
                                  " TANDEM_DOOR=" + place + " " + DOOR_ENGINE +
                                  " small exit 2 2>/dev/null) &";
      ASSERT_EQ(std::system(command.c_str()), 0);
      auto door = Door::open({.way = way});
      ASSERT_TRUE(door.has_value()) << door.error().message;
      for (int i = 0; i < 3; ++i) (*door)->step();
      EXPECT_THAT((*door)->failure(), HasSubstr("hung up in frame 2"));
      before = std::move(*door);
    }
  }
}

TEST(NetworkDoor, SharedMemoryNeedsTheSameMachine) {
  Waiting waiting;
  start_engine(waiting.port(), "shared");
  EXPECT_TRUE(waiting.says("needs `memory inline`"));
}

TEST(NetworkDoor, AnAddressNeedsATokenUnlessTheServerStartsTheEngine) {
  const auto door = Door::open({.way = {.host = "127.0.0.1", .token = "short"}});
  ASSERT_FALSE(door.has_value());
  EXPECT_THAT(door.error().message, HasSubstr("16 to 256"));
  EXPECT_NE(wrong_with_token("with blanks in between"), "");
  EXPECT_EQ(wrong_with_token(*make_token()), "");
}

struct Lie {
  const char* mode;
  const char* said;
};

class LieOverTheNetwork : public ::testing::TestWithParam<Lie> {};

TEST_P(LieOverTheNetwork, GetsOneClearLine) {
  DoorOptions options{
      .way = {.command = std::string("exec ") + DOOR_ENGINE + " small " + GetParam().mode + " 3",
              .host = "127.0.0.1"}};
  auto door = Door::open(std::move(options));
  ASSERT_TRUE(door.has_value()) << door.error().message;
  for (int i = 0; i < 5 && (*door)->failure().empty(); ++i) (*door)->step();
  EXPECT_THAT((*door)->failure(), HasSubstr(GetParam().said));
}

INSTANTIATE_TEST_SUITE_P(Modes, LieOverTheNetwork,
                         ::testing::Values(Lie{"exit", "hung up in frame 3 (exit code 3)"},
                                           Lie{"wrong-frame", "fewer than the"},
                                           Lie{"wrong-size", "fewer than the"},
                                           Lie{"inline-stale", "begun 2, frame 2, done 2 in frame 3"},
                                           Lie{"inline-long", "wrong size of 32 bytes in frame 3"},
                                           Lie{"inline-half", "fewer than the"},
                                           Lie{"huge", "DONE has 2147483647 bytes"},
                                           Lie{"half", "did not answer for 1 s in frame 3"},
                                           Lie{"hang", "did not answer for 1 s in frame 3"},
                                           Lie{"unknown", "unknown type 77"}, Lie{"twice", "frame 3"}),
                         [](const auto& lie) {
                           std::string name = lie.param.mode;
                           std::erase(name, '-');
                           return name;
                         });

}  // namespace
}  // namespace tandem::engine::door
