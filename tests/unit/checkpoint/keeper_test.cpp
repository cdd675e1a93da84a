#include "services/host/checkpoint/keeper.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <thread>

#include "services/host/checkpoint/format.hpp"
#include "tests/unit/checkpoint/sample.hpp"

namespace tandem::checkpoint {
namespace {

namespace fs = std::filesystem;

std::int64_t clock_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

/// Holds a number that can be saved.
class Number final : public engine::Simulation {
 public:
  explicit Number(std::uint32_t capacity = 4, bool saves = true) : capacity_(capacity), saves_(saves) {}
  [[nodiscard]] std::uint32_t capacity() const override { return capacity_; }
  [[nodiscard]] double dt_s() const override { return 0.0625; }
  [[nodiscard]] engine::Vec3 gravity() const override { return {}; }
  [[nodiscard]] engine::Classification classify(const engine::Input& input) const override {
    using Effect = engine::Classification::Effect;
    return {.effect = input.kind == 1   ? Effect::kScheduled
                      : input.kind < 99 ? Effect::kImmediate
                                        : Effect::kRefused};
  }
  void step() override {}
  [[nodiscard]] engine::Bodies bodies() const override { return {}; }
  void save(std::vector<std::byte>& out) const override {
    if (saves_) out.push_back(value);
  }
  [[nodiscard]] bool load(std::span<const std::byte> bytes) override {
    if (bytes.size() != 1 || bytes[0] == std::byte{0xBB}) return false;
    value = bytes[0];
    return true;
  }
  std::byte value{};

 private:
  std::uint32_t capacity_;
  bool saves_;
};

class KeeperTest : public ::testing::Test {
 protected:
  KeeperTest() : folder_(fs::temp_directory_path() / ("tandem-keeper-" + std::to_string(::getpid()))) {
    fs::remove_all(folder_);
  }
  ~KeeperTest() override {
    std::error_code ignored;
    fs::permissions(folder_, fs::perms::owner_all, ignored);
    fs::remove_all(folder_, ignored);
  }
  [[nodiscard]] Settings settings(bool required = false) const { return {folder_.string(), 1, required}; }
  [[nodiscard]] static CheckpointWorld world() {
    return {"arena", "half_pipe", "particles", 0.0625, {"ball", "cube"}};
  }
  /// Has a keeper write checkpoints of these frames; the number saved is the frame.
  void run(std::initializer_list<Frame> frames, Epoch epoch = 1000) {
    auto keeper = Keeper::open(settings(), &clock_ns);
    ASSERT_TRUE(keeper) << keeper.error().message;
    Number simulation;
    ASSERT_TRUE((*keeper)->start(world(), simulation));
    for (const Frame frame : frames) {
      (*keeper)->end(clock_ns(), [&](Checkpoint& out) {
        out = sample(epoch, frame);
        out.engine_state = {static_cast<std::byte>(frame)};
      });
    }
    EXPECT_EQ((*keeper)->figures(clock_ns())->written, frames.size());
  }
  Result<Start> start(engine::Simulation& simulation, CheckpointWorld of = world(), bool required = false) {
    auto keeper = Keeper::open(settings(required), &clock_ns);
    if (!keeper) return tl::unexpected(keeper.error());
    return (*keeper)->start(of, simulation);
  }

  fs::path folder_;
};

TEST_F(KeeperTest, AServerGoesOnFromTheNewestUnderAHigherEpoch) {
  run({30, 60, 90});
  Number simulation;
  const auto begun = start(simulation);
  ASSERT_TRUE(begun && begun->goes_on_from);
  EXPECT_EQ(begun->goes_on_from->frame, 90U);
  EXPECT_EQ(simulation.value, std::byte{90});
  EXPECT_EQ(begun->epoch(5000), 5000U);
  EXPECT_GT(begun->epoch(7), 1000U) << "a clock that went back";
  EXPECT_EQ(begun->epoch(7) % kBeginners, 7U) << "it still says who began it";
  EXPECT_EQ(begun->epoch(8) % kBeginners, 0U);
  EXPECT_NE(begun->epoch(7), begun->epoch(8))
      << "the server before may have ended without a checkpoint of its own";
  EXPECT_NE(begun->told.find("frame 90 of epoch 1000"), std::string::npos);
}

TEST_F(KeeperTest, AnIntervalThatChangesHoldsFromThenOn) {
  auto keeper = Keeper::open(settings(), &clock_ns);
  ASSERT_TRUE(keeper) << keeper.error().message;
  Number simulation;
  ASSERT_TRUE((*keeper)->start(world(), simulation));
  int captured = 0;
  const auto capture = [&](Checkpoint& out) {
    out = sample(1000, 30);
    ++captured;
  };
  const std::int64_t first_ns = clock_ns();
  (*keeper)->after_frame(first_ns, false, capture);
  while ((*keeper)->figures(clock_ns())->written < 1) std::this_thread::yield();
  EXPECT_EQ(captured, 1) << "the first is due at once";
  (*keeper)->set_interval(100);
  (*keeper)->after_frame(first_ns + 20'000'000'000, false, capture);
  EXPECT_EQ(captured, 1);
  (*keeper)->set_interval(10);
  (*keeper)->after_frame(first_ns + 20'000'000'001, false, capture);
  EXPECT_EQ(captured, 2);
}

TEST_F(KeeperTest, WithoutACheckpointItStartsAfreshAndSaysSoOrRefuses) {
  Number simulation;
  const auto begun = start(simulation);
  ASSERT_TRUE(begun);
  EXPECT_EQ(begun->goes_on_from, nullptr);
  EXPECT_EQ(begun->told, folder_.string() + ": no checkpoint to go on from; starts afresh");
  const auto refused = start(simulation, world(), true);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().message, folder_.string() + ": no checkpoint to go on from");
}

TEST_F(KeeperTest, AServerThatTookOverRemovesTheOldOnesOfItsWorld) {
  run({0xBB}, 500);  // of another seed
  run({30, 60, 90});
  auto keeper = Keeper::open(settings(), &clock_ns);
  ASSERT_TRUE(keeper) << keeper.error().message;
  Number simulation;
  simulation.value = std::byte{99};
  const auto newest = (*keeper)->take_over(world(), simulation);
  ASSERT_TRUE(newest);
  EXPECT_EQ(*newest, 1000U);
  EXPECT_EQ(simulation.value, std::byte{99});
  (*keeper)->end(clock_ns(), [&](Checkpoint& out) { out = sample(2000, 100); });
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 4);
  EXPECT_TRUE(fs::exists(folder_ / file_name({500, 0xBB})));
}

TEST_F(KeeperTest, AnEngineWithoutSaveStartsWithAWarningOrIsRefused) {
  Number simulation(4, false);
  const auto begun = start(simulation);
  ASSERT_TRUE(begun);
  ASSERT_EQ(begun->warnings.size(), 1U);
  EXPECT_EQ(start(simulation, world(), true).error().code, ErrorCode::kUnsupported);
}

TEST_F(KeeperTest, ACheckpointOfAnotherWorldIsRefusedByNameAndTheOneBeforeIsUsed) {
  run({30});
  run({60}, 2000);
  Number simulation;
  const auto why = [&](const CheckpointWorld& of, Number&& other = Number()) {
    const auto begun = start(other, of);
    return begun && !begun->warnings.empty() ? begun->warnings.front() : std::string();
  };
  CheckpointWorld of = world();
  of.session = "other";
  EXPECT_NE(why(of).find(": it is of session 'arena', not 'other'"), std::string::npos);
  of = world();
  of.scene = "cube";
  EXPECT_NE(why(of).find(": it is of scene 'half_pipe', not 'cube'"), std::string::npos);
  of = world();
  of.engine = "bullet";
  EXPECT_NE(why(of).find(": it is of engine 'particles', not 'bullet'"), std::string::npos);
  EXPECT_NE(why(world(), Number(5)).find(": it has 4 slots, not 5"), std::string::npos);
  of = world();
  of.types = {"ball"};
  EXPECT_NE(why(of).find(": its types of bodies are others"), std::string::npos);
  // The engine refuses the newest.
  run({0xBB}, 3000);
  const auto begun = start(simulation);
  ASSERT_TRUE(begun && begun->goes_on_from);
  EXPECT_EQ(begun->goes_on_from->epoch, 2000U);
  EXPECT_NE(begun->warnings.at(0).find("the engine refuses its part"), std::string::npos);
  EXPECT_GT(begun->epoch(1), 3000U);
}

TEST_F(KeeperTest, ACheckpointWithAnInputThatTheEngineRefusesIsNotUsed) {
  using Change = void (*)(Checkpoint&);
  for (const Change change : {Change([](Checkpoint& c) { c.immediate[0].kind = 99; }),
                              Change([](Checkpoint& c) { c.immediate[0].kind = 1; }),
                              Change([](Checkpoint& c) { c.scheduled[0].input.kind = 2; })}) {
    run({5});
    {
      auto keeper = Keeper::open(settings(), &clock_ns);
      ASSERT_TRUE(keeper) << keeper.error().message;
      Number simulation;
      ASSERT_TRUE((*keeper)->start(world(), simulation));
      (*keeper)->end(clock_ns(), [change](Checkpoint& out) {
        out = sample(1000, 9);
        out.engine_state = {std::byte{9}};
        change(out);
      });
    }
    Number simulation;
    const auto begun = start(simulation);
    ASSERT_TRUE(begun && begun->goes_on_from);
    EXPECT_EQ(begun->goes_on_from->frame, 5U);
    EXPECT_EQ(simulation.value, std::byte{5});
    ASSERT_EQ(begun->warnings.size(), 1U);
    EXPECT_NE(begun->warnings[0].find("that waits in it"), std::string::npos) << begun->warnings[0];
    fs::remove_all(folder_);
  }
}

TEST_F(KeeperTest, ASimulationIsAsItWasWhereNoCheckpointIsUsed) {
  {
    auto keeper = Keeper::open(settings(), &clock_ns);
    ASSERT_TRUE(keeper) << keeper.error().message;
    Number simulation;
    ASSERT_TRUE((*keeper)->start(world(), simulation));
    (*keeper)->end(clock_ns(), [](Checkpoint& out) {
      out = sample(1000, 9);
      out.engine_state = {std::byte{9}};
      out.immediate[0].kind = 99;
    });
  }
  Number simulation;
  simulation.value = std::byte{1};
  const auto begun = start(simulation);
  ASSERT_TRUE(begun);
  EXPECT_EQ(begun->goes_on_from, nullptr);
  EXPECT_EQ(simulation.value, std::byte{1});
}

TEST_F(KeeperTest, ASecondServerOfAFolderIsToldWhoHoldsIt) {
  const auto first = Keeper::open(settings(), &clock_ns);
  ASSERT_TRUE(first);
  const auto second = Keeper::open(settings(), &clock_ns);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::kConflict);
  EXPECT_EQ(second.error().message.find(folder_.string() + ": "), 0U);
  EXPECT_NE(second.error().message.find("keeps its checkpoints there"), std::string::npos);
}

TEST_F(KeeperTest, AFolderThatVanishesIsMadeAgainAndOneThatCannotBeIsTold) {
  const fs::path parent = folder_;
  fs::create_directory(parent);
  folder_ = parent / "inner";
  {
    auto keeper = Keeper::open(settings(), &clock_ns);
    ASSERT_TRUE(keeper);
    Number simulation;
    ASSERT_TRUE((*keeper)->start(world(), simulation));
    const auto capture = [](Checkpoint& out) { out = sample(); };
    fs::remove_all(folder_);
    (*keeper)->end(clock_ns(), capture);
    EXPECT_EQ((*keeper)->figures(clock_ns())->written, 1U);
    fs::remove_all(parent);
    for (int i = 0; i < 3; ++i) (*keeper)->end(clock_ns(), capture);
    EXPECT_EQ((*keeper)->figures(clock_ns())->failed, 3U);
    const auto lines = (*keeper)->take_notices(clock_ns());
    ASSERT_EQ(lines.size(), 1U);
    EXPECT_NE(
        lines[0].find("No such file or directory; the world goes on, and the last checkpoint is 0 s old"),
        std::string::npos)
        << lines[0];
    EXPECT_TRUE((*keeper)->take_notices(clock_ns()).empty()) << "one line in ten seconds";
    fs::create_directory(parent);
    (*keeper)->end(clock_ns(), capture);
    EXPECT_EQ((*keeper)->take_notices(clock_ns()), std::vector<std::string>{"checkpoints are written again"});
  }
  folder_ = parent;
}

TEST_F(KeeperTest, AFrameIsNotKeptWaitingWhileACheckpointIsUnderWay) {
  auto keeper = Keeper::open(settings(), &clock_ns);
  ASSERT_TRUE(keeper);
  Number simulation;
  ASSERT_TRUE((*keeper)->start(world(), simulation));
  int copies = 0;
  for (std::int64_t now = 0; now < 10'000'000'000; now += 33'333'333)
    (*keeper)->after_frame(now, false,
                           [&](Checkpoint& out) { out = sample(1000, static_cast<Frame>(++copies)); });
  EXPECT_GE(copies, 1);
  EXPECT_LE(copies, 20) << "two a second, if the disk is slow";
}

TEST_F(KeeperTest, SettingsOutOfRangeAreRefused) {
  for (const double interval : {0.0, -1.0, 1e9, std::numeric_limits<double>::quiet_NaN()}) {
    Settings bad = settings();
    bad.interval_s = interval;
    EXPECT_EQ(Keeper::open(bad, &clock_ns).error().code, ErrorCode::kInvalidArgument);
  }
  Settings nowhere = settings();
  nowhere.folder = "/proc/nowhere/inner";
  EXPECT_EQ(Keeper::open(nowhere, &clock_ns).error().code, ErrorCode::kIo);
}

TEST_F(KeeperTest, ASpecialOrHugeFileIsRefusedUnread) {
  fs::create_directory(folder_);
  const fs::path huge = folder_ / file_name({1, 2});
  std::ofstream(huge).close();
  fs::resize_file(huge, std::uintmax_t{10} << 30U);
  ASSERT_EQ(::mkfifo((folder_ / file_name({1, 3})).c_str(), 0600), 0);
  Number simulation;
  const auto begun = start(simulation);
  ASSERT_TRUE(begun);
  ASSERT_EQ(begun->warnings.size(), 2U);
  EXPECT_NE(begun->warnings[0].find("is no regular file"), std::string::npos);
  EXPECT_NE(begun->warnings[1].find("has 10737418240 bytes, more than"), std::string::npos);
}

}  // namespace
}  // namespace tandem::checkpoint
