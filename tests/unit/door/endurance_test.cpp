// What lasts: engines that scribble over the memory, that end two hundred times, whose bodies are new in
// every frame. DOOR_SECONDS=600 scribbles for ten minutes; the default is two seconds.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>

#include "services/engines/door/door.hpp"
#include "services/host/frames/live_source.hpp"
#include "tests/unit/host/fakes.hpp"

namespace tandem::engine::door::of_endurance {
namespace {

using ::testing::AnyOf;
using ::testing::HasSubstr;

Result<std::unique_ptr<Door>> open_small(const std::string& mode) {
  std::string command = "exec " DOOR_ENGINE " small ";
  command += mode;
  return Door::open({.way = {.command = std::move(command)}});
}

host::HostConfig config_of_17() {
  host::HostConfig config = host::turning_config();
  config.streams[0].layout.capacity = 17;
  config.streams[0].layout.type_count = 1;
  config.streams[0].layout.radii.assign(1, 1000);
  config.extent = 60;
  return config;
}

// Whole frames of a server, encoded and applied, from memory that another process writes to without pause.
// The engine's end by a slot that is not whole is within the rules, and another one takes its place.
TEST(Endurance, AProcessThatScribblesOverAllOfTheMemory) {
  const char* const wanted = std::getenv("DOOR_SECONDS");
  const auto end =
      std::chrono::steady_clock::now() + std::chrono::seconds{wanted == nullptr ? 2 : std::atoi(wanted)};
  std::uint64_t frames = 0, engines = 0, hidden = 0;
  while (std::chrono::steady_clock::now() < end) {
    const auto door = open_small(engines % 2 == 0 ? "scribble-all 2" : "scribble 2");
    ASSERT_TRUE(door.has_value()) << door.error().message;
    ++engines;
    auto source = host::LiveSource::create(config_of_17(), **door);
    ASSERT_TRUE(source.has_value()) << source.error().message;
    host::Outbox outbox({});
    for (int i = 0; i < 5000 && std::chrono::steady_clock::now() < end; ++i) {
      (*source)->begin_next();
      while (!(*source)->next_ready()) std::this_thread::yield();
      if (!(*source)->next({}, outbox)) {
        EXPECT_THAT((*source)->error()->message,
                    AnyOf(HasSubstr("was written by something else, or is not whole"),
                          HasSubstr("more bodies appeared in a frame than a delta can tell")));
        break;
      }
      ++frames;
    }
    for (const std::string& line : (*source)->take_warnings(kSecond)) hidden += line.empty() ? 0U : 1U;
  }
  EXPECT_GT(frames, 0U);
  std::printf("%llu frames of %llu engines, %llu lines about bodies\n",
              static_cast<unsigned long long>(frames), static_cast<unsigned long long>(engines),
              static_cast<unsigned long long>(hidden));
}

TEST(Endurance, BodiesThatAreAllNewInEveryFrame) {
  const auto door = open_small("flap 1");
  ASSERT_TRUE(door.has_value()) << door.error().message;
  auto source = host::LiveSource::create(config_of_17(), **door);
  ASSERT_TRUE(source.has_value()) << source.error().message;
  host::Outbox outbox({});
  for (int i = 0; i < 600; ++i) {
    (*source)->begin_next();
    while (!(*source)->next_ready()) std::this_thread::yield();
    ASSERT_TRUE((*source)->next({}, outbox)) << (*source)->error()->message;
    if (i > 0) {
      ASSERT_EQ((*door)->events().size(), 34U) << "a death and a birth in each slot";
    }
  }
}

std::size_t descriptors() {
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator("/proc/self/fd"), {}));
}

long resident_kb() {
  std::ifstream file("/proc/self/statm");
  long size = 0, resident = 0;
  file >> size >> resident;
  return resident * (::sysconf(_SC_PAGESIZE) / 1024);
}

std::size_t folders() {
  std::size_t found = 0;
  for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::temp_directory_path()))
    if (entry.path().filename().string().starts_with("tandem-door-")) ++found;
  return found;
}

TEST(Endurance, TwoHundredEnginesLeaveNoDescriptorNoProcessNoFileAndNoMemory) {
  const auto live = [](int i) {
    auto door = open_small(i % 2 == 0 ? "exit 2" : "good");
    ASSERT_TRUE(door.has_value()) << door.error().message;
    (*door)->step();
    (*door)->step();
    EXPECT_EQ((*door)->failure().empty(), i % 2 == 1);
  };
  for (int i = 0; i < 20; ++i) live(i);
  const std::size_t before = descriptors(), files = folders();
  const long memory_kb = resident_kb();
  for (int i = 0; i < 200; ++i) live(i);
  EXPECT_EQ(descriptors(), before);
  EXPECT_LE(folders(), files) << "others of this machine may have ended";
  EXPECT_EQ(::waitpid(-1, nullptr, WNOHANG), -1) << "no child is left";
  EXPECT_LT(resident_kb() - memory_kb, 4096) << "a segment alone has 8 KiB, an engine's output more";
}

TEST(Stranger, OfAnotherUserCannotConnect) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can be another user";
  std::string path = "/tmp/door_stranger_";
  path += std::to_string(::getpid());
  const std::string command =
      "(while ! test -S $P; do sleep 0.01; done; TANDEM_DOOR=$P " DOOR_ENGINE " small good) &";
  ::setenv("P", path.c_str(), 1);
  ASSERT_EQ(std::system(command.c_str()), 0);
  const auto door = Door::open({.way = {.path = path}});
  ASSERT_TRUE(door.has_value()) << door.error().message;
  const pid_t stranger = ::fork();
  if (stranger == 0) {
    if (::setuid(65534) != 0) ::_exit(100);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::snprintf(address.sun_path, sizeof address.sun_path, "%s", path.c_str());
    const int fd = ::socket(AF_UNIX, SOCK_STREAM, 0);
    const bool in = ::connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
    ::_exit(in ? 0 : errno);
  }
  int how = 0;
  ASSERT_EQ(::waitpid(stranger, &how, 0), stranger);
  EXPECT_EQ(WEXITSTATUS(how), EACCES);
  (*door)->step();
  EXPECT_EQ((*door)->failure(), "");
}

}  // namespace
}  // namespace tandem::engine::door::of_endurance
