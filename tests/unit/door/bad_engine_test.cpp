// What bad engines get: one clear line, and never a crash.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>

#include <atomic>
#include <filesystem>

#include "services/engines/door/door.hpp"
#include "services/host/news/simulation_news.hpp"
#include "tests/unit/host/fakes.hpp"

namespace tandem::engine::door {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

Result<std::unique_ptr<Door>> open_small(const std::string& mode, std::vector<std::string>* lines = nullptr) {
  DoorOptions options{.way = {.command = std::string(mode.find(';') == std::string::npos ? "exec " : "") +
                                         DOOR_ENGINE + " small " + mode}};
  options.connect_limit_s = 1;
  options.start_limit_s = 1;
  if (lines != nullptr) options.log = [lines](const std::string& line, bool) { lines->push_back(line); };
  return Door::open(std::move(options));
}

std::string failure_of(const std::string& mode) {
  auto door = open_small(mode + " 3");
  if (!door) return "at the start: " + door.error().message;
  for (int i = 0; i < 5 && (*door)->failure().empty(); ++i) (*door)->step();
  return (*door)->failure();
}

struct Case {
  const char* mode;
  const char* said;
};

class BadEngine : public ::testing::TestWithParam<Case> {};

TEST_P(BadEngine, GetsOneClearLine) { EXPECT_THAT(failure_of(GetParam().mode), HasSubstr(GetParam().said)); }

INSTANTIATE_TEST_SUITE_P(
    Modes, BadEngine,
    ::testing::Values(
        Case{"exit", "hung up in frame 3 (exit code 3)"}, Case{"crash", "its last words: the last word"},
        Case{"orphan", "the engine ended with exit code 7 in frame 3"},
        Case{"hang",
             "did not answer for 1 s in frame 3: if it needs longer, it says so with a larger step_limit"},
        Case{"stop", "in frame 3: it is stopped"}, Case{"wrong-frame", "DONE is of frame 10 in frame 3"},
        Case{"wrong-slot", "DONE is of slot 9, not 0 in frame 3"},
        Case{"wrong-size", "wrong size of 23 bytes in frame 3"},
        Case{"stale", "begun 2, frame 2, done 2 in frame 3"}, Case{"twice", "frame 3"},
        Case{"unknown", "unknown type 77"}, Case{"huge", "DONE has 2147483647 bytes"},
        Case{"news-untold", "sent NEWS, but its HELLO has no line `news`, in frame 3"},
        Case{"news-frame", "NEWS is of frame 4 in frame 3"},
        Case{"news-long", "an entry of the engine's NEWS is longer than the message in frame 3"},
        Case{"news-key", "an entry of the engine's NEWS is longer than the message in frame 3"},
        Case{"news-short", "the engine's NEWS has a wrong size of 1 bytes in frame 3"},
        Case{"news-flood", "the engine's NEWS have more than 2097152 bytes in frame 3"},
        Case{"half", "did not answer for 1 s in frame 3"},
        Case{"error", "gave up in frame 3: the springs?[31m broke"}, Case{"punch", ""},
        Case{"silent", "did not connect within 1 s; what takes long belongs"},
        Case{"exit-early", "ended with exit code 4 before HELLO"},
        Case{"no-start", "1 s before START; what takes long belongs into its first step"},
        Case{"capacity", "`capacity 99999999`: '99999999'"}, Case{"no-dt", "says no dt"}),
    [](const auto& mode) {
      std::string name = mode.param.mode;
      std::erase(name, '-');
      return name;
    });

// It has said HELLO, and gets ready for longer than anybody wants to wait who ends the server.
TEST(SlowEngine, IsNotAwaitedByAServerThatIsToEnd) {
  DoorOptions options{.way = {.command = std::string("exec ") + DOOR_ENGINE + " small no-start 3"}};
  options.connect_limit_s = options.start_limit_s = 5;
  std::atomic<bool> stop{false};
  options.stop = &stop;
  options.idle = [&stop, calls = 0](bool) mutable { stop = ++calls > 50; };
  const auto door = Door::open(std::move(options));
  ASSERT_FALSE(door.has_value());
  EXPECT_THAT(door.error().message, HasSubstr("stopped before"));
}

// What a mirror says of a frame in which one body is wrong.
std::string mirrored(const std::string& mode) {
  auto door = open_small(mode + " 2");
  if (!door) return door.error().message;
  host::HostConfig config = host::turning_config();
  config.streams[0].layout.capacity = 17;
  config.streams[0].layout.type_count = 1;
  config.streams[0].layout.radii.assign(1, 1000);
  config.extent = 60;
  host::Mirror mirror = *host::make_mirror(config.streams, (*door)->bodies(), config.extent);
  for (int i = 0; i < 3; ++i) {
    (*door)->step();
    if (!(*door)->failure().empty()) return (*door)->failure();
    mirror.update((*door)->bodies(), (*door)->events());
  }
  return mirror.last_hidden();
}

TEST(BadBody, IsHiddenAndNamedWithSlotAndColumn) {
  EXPECT_EQ(mirrored("nan"), "slot 3 (its y is not a number)");
  EXPECT_THAT(mirrored("far"), HasSubstr("slot 4 (its z is 1e+30"));
  EXPECT_EQ(mirrored("norm"), "slot 5 (its orientation has norm 5.1)");
  EXPECT_EQ(mirrored("turn"), "slot 2 (its angular velocity is not a number)");
  EXPECT_THAT(mirrored("type"), HasSubstr("slot 6 (its type is 60000"));
  EXPECT_EQ(mirrored("dead"), "");
}

// A checkpoint less is no reason to end a session.
TEST(BadSave, IsNoCheckpointAndTheSessionGoesOn) {
  const auto said = [](const std::string& mode) {
    std::vector<std::string> lines;
    auto door = open_small(mode, &lines);
    EXPECT_TRUE(door.has_value()) << door.error().message;
    (*door)->step();
    std::vector<std::byte> saved;
    (*door)->save(saved);
    EXPECT_TRUE(saved.empty()) << mode;
    (*door)->step();
    EXPECT_EQ((*door)->failure(), "") << mode;
    return lines.empty() ? std::string() : lines.front();
  };
  EXPECT_THAT(said("save-lie"), HasSubstr("says that it saved 9 bytes of frame 1, but there are 8"));
  EXPECT_THAT(said("save-much"), HasSubstr("saved 1099511627776 bytes of frame 1, more than the 1073741824"));
  EXPECT_THAT(said("save-pipe"), HasSubstr("but there is no file"));
  EXPECT_EQ(said("save-none"), "");
}

TEST(Door, InputsAreRefusedByWhatTheEngineSaid) {
  const auto door = open_small("good");
  ASSERT_TRUE(door.has_value()) << door.error().message;
  const auto why = [&](const Input& input) { return (*door)->classify(input).reason; };
  EXPECT_EQ(why({.kind = 1, .values = {0, 0, 1}}), "small takes no gravity");
  EXPECT_EQ(why({.kind = 16, .bytes = std::vector<std::byte>(9)}),
            "an application's input has at most 8 bytes");
  EXPECT_EQ(why({.kind = 99}), "small takes no input of kind 99");
  EXPECT_EQ((*door)->classify({.kind = 16, .bytes = std::vector<std::byte>(8)}).effect,
            Classification::Effect::kImmediate);
}

class Listening final : public StepNews {
 public:
  bool set_key(std::string_view key, std::span<const std::byte> value) override {
    return say(std::string(key) + "=" + std::to_string(std::to_integer<int>(value[0])));
  }
  bool remove_key(std::string_view key) override { return say("no " + std::string(key)); }
  bool broadcast(std::uint32_t kind, std::span<const std::byte> bytes,
                 std::optional<std::uint32_t> slot) override {
    return say(std::to_string(kind) + " of " + std::to_string(bytes.size()) + " bytes" +
               (slot ? " about " + std::to_string(*slot) : ""));
  }
  std::vector<std::string> said;

 private:
  bool say(const std::string& line) {
    said.push_back(line);
    return true;
  }
};

TEST(Door, TellsTheNewsOfTheLastStepInTheirOrder) {
  const auto door = open_small("news 2");
  ASSERT_TRUE(door.has_value()) << door.error().message;
  EXPECT_TRUE((*door)->tells().keys && (*door)->tells().events);
  const auto said = [&door] {
    Listening listening;
    (*door)->step();
    (*door)->tell(listening);
    EXPECT_EQ((*door)->failure(), "");
    return listening.said;
  };
  EXPECT_THAT(said(), IsEmpty());
  EXPECT_THAT(said(), ElementsAre("score=2", "no old", "7 of 4 bytes about 3", "8 of 0 bytes"));
  EXPECT_EQ(said().front(), "score=3");
}

TEST(Door, NewsThatItDoesNotKnowAreSkippedAndUnaskedOnesAreNotSent) {
  for (const char* const mode : {"news-later 1", "news-unasked 1"}) {
    const auto door = open_small(mode);
    ASSERT_TRUE(door.has_value()) << door.error().message;
    Listening listening;
    (*door)->step();
    (*door)->tell(listening);
    EXPECT_EQ((*door)->failure(), "") << mode;
    EXPECT_THAT(listening.said, IsEmpty()) << mode;
  }
}

// What breaks a limit of a session is no reason to end it.
TEST(Door, NewsBeyondALimitAreRefusedByNameAndTheSessionGoesOn) {
  const auto door = open_small("news-large 1");
  ASSERT_TRUE(door.has_value()) << door.error().message;
  host::NewsDesk desk({.keys = true, .events = true}, 17);
  host::SimulationNews news;
  (*door)->step();
  news.ask(**door, desk, 1);
  EXPECT_EQ(news.refused(), 3U);
  EXPECT_THAT(
      news.take_warning(0).value_or(""),
      AllOf(HasSubstr("3 keys or events"), HasSubstr("key 'two?lines' in frame 1: a key has 1 to 64")));
  (*door)->step();
  EXPECT_EQ((*door)->failure(), "");
}

TEST(Door, SaysThatAnEngineIsStoppedAndGoesOnWithIt) {
  std::vector<std::string> lines;
  auto door = open_small("good", &lines);
  ASSERT_TRUE(door.has_value()) << door.error().message;
  (*door)->step();
  ::kill((*door)->engine_process(), SIGSTOP);
  (*door)->begin_step();
  const auto wait_until = [&](const auto& holds) {
    for (int i = 0; i < 80 && !holds(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds{10});
  };
  wait_until([&] {
    static_cast<void>((*door)->step_ready());
    return !lines.empty();
  });
  EXPECT_THAT(lines, Contains(AllOf(HasSubstr("is stopped in frame 2"))));
  ::kill((*door)->engine_process(), SIGCONT);
  bool ready = false;
  wait_until([&] { return ready = ready || (*door)->step_ready(); });
  EXPECT_TRUE(ready);
  EXPECT_EQ((*door)->failure(), "");
}

TEST(Door, WhatAnEngineSaysAtItsEndIsInTheLog) {
  std::vector<std::string> lines;
  {
    auto door = open_small("good; echo all is said", &lines);
    ASSERT_TRUE(door.has_value()) << door.error().message;
    (*door)->step();
  }
  EXPECT_THAT(lines, Contains("engine: all is said"));
}

TEST(Door, TheMemoryCannotShrinkOrGrow) {
  const auto door = open_small("good");
  ASSERT_TRUE(door.has_value());
  bool tried = false;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    std::error_code ignored;
    const std::string target = std::filesystem::read_symlink(entry.path(), ignored).string();
    if (!target.starts_with("/memfd:tandem-door")) continue;
    tried = true;
    const int fd = ::open(entry.path().c_str(), O_RDWR | O_CLOEXEC);
    EXPECT_NE(::ftruncate(fd, 0), 0);
    EXPECT_NE(::ftruncate(fd, 1 << 20), 0);
    ::close(fd);
  }
  EXPECT_TRUE(tried);
}

TEST(Door, ALongFolderForTemporaryFilesDoesNotKeepAnEngineOut) {
  const std::string folder = ::testing::TempDir() + std::string(120, 'x');
  std::filesystem::create_directories(folder);
  const char* const before = std::getenv("TMPDIR");
  const std::string kept = before == nullptr ? "" : before;
  ::setenv("TMPDIR", folder.c_str(), 1);
  const auto door = open_small("good");
  EXPECT_TRUE(door.has_value()) << door.error().message;
  before == nullptr ? ::unsetenv("TMPDIR") : ::setenv("TMPDIR", kept.c_str(), 1);
  std::filesystem::remove_all(folder);
  const auto at_socket = Door::open({.way = {.path = folder}});
  ASSERT_FALSE(at_socket.has_value());
  EXPECT_THAT(at_socket.error().message, HasSubstr("the path of a socket has 1 to 107 bytes, not"));
}

TEST(Door, ASecondEngineAtASocketIsTurnedAway) {
  const std::string path = ::testing::TempDir() + "door_" + std::to_string(::getpid());
  std::vector<std::string> lines;
  DoorOptions options{.way = {.path = path}};
  options.log = [&lines](const std::string& line, bool) { lines.push_back(line); };
  const std::string command = "(while ! test -S " + path + "; do sleep 0.01; done; TANDEM_DOOR=" + path +
                              " " + DOOR_ENGINE + " small good) &";
  ASSERT_EQ(std::system(command.c_str()), 0);
  const auto door = Door::open(std::move(options));
  ASSERT_TRUE(door.has_value()) << door.error().message;
  struct stat there {};
  ASSERT_EQ(::stat(path.c_str(), &there), 0);
  EXPECT_EQ(there.st_mode & 0777, 0600U);
  const std::string second = "TANDEM_DOOR=" + path + " " + DOOR_ENGINE + " small good 2>" + path + ".said &";
  ASSERT_EQ(std::system(second.c_str()), 0);
  for (int i = 0; i < 300 && lines.size() < 2; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds{10});
    EXPECT_EQ((*door)->failure(), "");
  }
  EXPECT_THAT(lines, Contains(HasSubstr("there is an engine already")));
  (*door)->step();
  EXPECT_EQ((*door)->failure(), "");
  std::filesystem::remove(path + ".said");
}

// A process that writes at random over all of the memory, while a mirror follows the bodies.
TEST(Door, AScribblingProcessMakesWrongBodiesAndNothingElse) {
  const auto door = open_small("scribble 1");
  ASSERT_TRUE(door.has_value()) << door.error().message;
  host::HostConfig config = host::turning_config();
  config.streams[0].layout.capacity = 17;
  config.streams[0].layout.type_count = 1;
  config.streams[0].layout.radii.assign(1, 1000);
  config.extent = 60;
  host::Mirror mirror = *host::make_mirror(config.streams, (*door)->bodies(), config.extent);
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds{2};
  int frames = 0;
  while (std::chrono::steady_clock::now() < end) {
    (*door)->step();
    ASSERT_EQ((*door)->failure(), "");
    ++frames;
    for (int reads = 0; reads < 200; ++reads) {
      mirror.update((*door)->bodies(), (*door)->events());
      for (std::uint32_t s = 0; s < 17; ++s) {
        ASSERT_EQ(mirror.target().type()[s], 0U);
        for (std::size_t i = 0; i < 3; ++i) ASSERT_LE(std::abs(mirror.target().p(i)[s]), kPositionLimit);
      }
    }
  }
  EXPECT_GT(frames, 0);
}

}  // namespace
}  // namespace tandem::engine::door
