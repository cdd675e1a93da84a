#include "services/program/process/service_notifier.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdlib>
#include <string>
#include <vector>

namespace tandem {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr std::int64_t kSecond = 1'000'000'000;

/// systemd's end of the socket, with a watchdog of 8 s.
class Manager {
 public:
  Manager() : socket_(socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    const std::string name = "tandem-notifier-test-" + std::to_string(getpid());
    name.copy(address.sun_path + 1, name.size());  // an abstract name begins with a 0
    const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
    bound_ = bind(socket_, reinterpret_cast<const sockaddr*>(&address), size) == 0;
    setenv("NOTIFY_SOCKET", ("@" + name).c_str(), 1);
    setenv("WATCHDOG_USEC", "8000000", 1);
    setenv("WATCHDOG_PID", std::to_string(getpid()).c_str(), 1);
  }
  ~Manager() {
    close(socket_);
    for (const char* name : {"NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID"}) unsetenv(name);
  }
  Manager(const Manager&) = delete;
  Manager& operator=(const Manager&) = delete;
  Manager(Manager&&) = delete;
  Manager& operator=(Manager&&) = delete;

  [[nodiscard]] bool bound() const { return bound_; }
  [[nodiscard]] std::vector<std::string> heard() const {
    std::vector<std::string> all;
    char text[512];
    for (ssize_t size = 0; (size = recv(socket_, text, sizeof text, 0)) >= 0;)
      all.emplace_back(text, static_cast<std::size_t>(size));
    return all;
  }

 private:
  int socket_;
  bool bound_ = false;
};

TEST(ServiceNotifier, SaysOnceThatItIsReadyAndFourTimesInTheWatchdogsTimeThatItIsAlive) {
  const Manager manager;
  ASSERT_TRUE(manager.bound());
  ServiceNotifier notifier;
  EXPECT_THAT(manager.heard(), IsEmpty());
  notifier.alive(100 * kSecond);
  EXPECT_THAT(manager.heard(), ElementsAre("READY=1", "WATCHDOG=1"));
  notifier.alive(101 * kSecond);
  EXPECT_THAT(manager.heard(), IsEmpty());
  notifier.alive(102 * kSecond);
  EXPECT_THAT(manager.heard(), ElementsAre("WATCHDOG=1"));
}

TEST(ServiceNotifier, TellsItsStatusFromTimeToTime) {
  const Manager manager;
  ServiceNotifier notifier;
  EXPECT_TRUE(notifier.wants_status(100 * kSecond));
  EXPECT_FALSE(notifier.wants_status(101 * kSecond));
  EXPECT_TRUE(notifier.wants_status(105 * kSecond));
  notifier.tell("frame 7");
  EXPECT_THAT(manager.heard(), ElementsAre("STATUS=frame 7"));
}

TEST(ServiceNotifier, AsksForMoreTimeWhileAProgramWaitsForWhatItNeeds) {
  const Manager manager;
  ServiceNotifier notifier;
  notifier.starting("waits", 100 * kSecond);
  notifier.starting("waits", 101 * kSecond);
  notifier.starting("waits", 106 * kSecond);
  EXPECT_THAT(manager.heard(), ElementsAre("EXTEND_TIMEOUT_USEC=30000000\nSTATUS=waits",
                                           "EXTEND_TIMEOUT_USEC=30000000\nSTATUS=waits"));
  notifier.alive(107 * kSecond);
  notifier.starting("waits", 120 * kSecond);
  EXPECT_THAT(manager.heard(), ElementsAre("READY=1", "WATCHDOG=1"));
}

TEST(ServiceNotifier, SaysThatItReloadsAndThatItStops) {
  const Manager manager;
  {
    ServiceNotifier notifier;
    notifier.alive(2 * kSecond);
    notifier.reloading(3 * kSecond);
    notifier.reloaded();
  }
  EXPECT_THAT(manager.heard(), ElementsAre("READY=1", "WATCHDOG=1", "RELOADING=1\nMONOTONIC_USEC=3000000",
                                           "READY=1", "STOPPING=1"));
}

TEST(ServiceNotifier, AProgramThatWasNeverReadySaysNothingAtItsEnd) {
  const Manager manager;
  { const ServiceNotifier notifier; }
  EXPECT_THAT(manager.heard(), IsEmpty());
}

TEST(ServiceNotifier, IsSilentWithoutSystemd) {
  unsetenv("NOTIFY_SOCKET");
  ServiceNotifier notifier;
  notifier.alive(kSecond);
  EXPECT_FALSE(notifier.wants_status(kSecond));
}

}  // namespace
}  // namespace tandem
