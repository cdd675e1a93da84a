// How a conversation ends, as the engine hears it.
#include "tandem/engine.h"  // first: it asks the system for more

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <memory>

#include "services/engines/door/door.hpp"

namespace tandem::engine::door {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

/// An engine in C, and the server's end of its socket.
class Parting : public ::testing::Test {
 protected:
  void SetUp() override {
    std::array<int, 2> ends{};
    ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM, 0, ends.data()), 0);
    server_ = ends[0];
    const std::string lines = "capacity 1\ndt 0.1\nmemory inline\n";
    const Hello hello = *parse_hello(std::string("engine 1.1\n").append(lines));
    say(Type::kLayout, print_layout(layout_of(hello), ""));
    ASSERT_EQ(tandem_engine_open_fd(engine_.get(), ends[1], lines.c_str()), 0) << engine_->error;
    std::vector<std::byte> step;
    append_step(step, 1, 0);
    ASSERT_EQ(::write(server_, step.data(), step.size()), static_cast<ssize_t>(step.size()));
    ASSERT_EQ(tandem_engine_next(engine_.get()), TANDEM_ENGINE_STEP);
  }
  void TearDown() override { tandem_engine_close(engine_.get()); }

  void say(Type type, const std::string& text) const {
    std::vector<std::byte> bytes;
    append(bytes, type, text);
    ASSERT_EQ(::write(server_, bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
  }
  /// The server ends while the engine computes a step, whose answer nobody takes.
  int answer_too_late() {
    ::close(server_);
    tandem_engine_done(engine_.get(), 0);
    return tandem_engine_next(engine_.get());
  }

  int server_ = -1;
  std::unique_ptr<tandem_engine> engine_ = std::make_unique<tandem_engine>();
};

TEST_F(Parting, ByeDuringAStepIsAPlannedEnd) {
  say(Type::kBye, "");
  EXPECT_EQ(answer_too_late(), TANDEM_ENGINE_BYE);
  EXPECT_STREQ(engine_->error, "");
}

TEST_F(Parting, AnErrorDuringAStepIsHeard) {
  say(Type::kError, "the disk is full");
  EXPECT_EQ(answer_too_late(), -1);
  EXPECT_STREQ(engine_->error, "the disk is full");
}

TEST_F(Parting, AServerThatOnlyHangsUpHasFailed) {
  EXPECT_EQ(answer_too_late(), -1);
  EXPECT_THAT(engine_->error, HasSubstr("did not say why"));
}

TEST(Door, AnEngineHearsWhyItsServerFails) {
  std::vector<std::string> lines;
  DoorOptions options{.way = {.command = "exec " DOOR_ENGINE " small good"}};
  options.log = [&lines](const std::string& line, bool) { lines.push_back(line); };
  auto door = Door::open(std::move(options));
  ASSERT_TRUE(door.has_value()) << door.error().message;
  (*door)->dismiss("the session is taken");
  door->reset();
  EXPECT_THAT(lines, Contains("engine: the session is taken"));
}

TEST(Door, AnEngineHearsWhyItsServerCannotStart) {
  std::array<int, 2> ends{};
  ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM, 0, ends.data()), 0);
  turn_away(ends[0], "--bogus: no such flag");
  const auto engine = std::make_unique<tandem_engine>();
  EXPECT_EQ(tandem_engine_open_fd(engine.get(), ends[1], "capacity 1\ndt 0.1\n"), -1);
  EXPECT_STREQ(engine->error, "--bogus: no such flag");
  tandem_engine_close(engine.get());
}

}  // namespace
}  // namespace tandem::engine::door
