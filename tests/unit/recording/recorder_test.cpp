#include "services/follow/recording/recorder.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>

#include "services/follow/recording/playback.hpp"
#include "tests/support/client/fake_server.hpp"

namespace tandem::recording::of_recorder {
namespace {

using client::FakeServer;

constexpr std::int64_t kSecond = 1'000'000'000;

// A disk that is full when a file has so many bytes.
class FullDisk {
 public:
  explicit FullDisk(std::uint64_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{.rlim_cur = bytes, .rlim_max = before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FullDisk() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;
  FullDisk(FullDisk&&) = delete;
  FullDisk& operator=(FullDisk&&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int);
};

class RecorderTest : public ::testing::Test {
 protected:
  ~RecorderTest() override {
    std::filesystem::remove(path);
    std::filesystem::remove(second);
  }

  Recorder create(Existing existing = Existing::kStays) const {
    return std::move(*Recorder::create(path, Compression::kNone, existing));
  }
  void join(Recorder& recorder) {
    recorder.add(server.session, now());
    recorder.add(server.snapshot(), now());
  }
  void frames(Recorder& recorder, int count) {
    for (int i = 0; i < count; ++i) {
      const transport::DeltaMessage delta = server.advance(wall_ns);
      recorder.add(server.session.epoch,
                   {.frame = delta.frame,
                    .last_input = delta.last_input,
                    .server_time_ns = delta.server_time_ns,
                    .hash = delta.hash,
                    .payload = delta.payload},
                   now());
      wall_ns += kSecond;
      steady_ns += kSecond;
    }
  }

  [[nodiscard]] client::Now now() const { return {steady_ns, wall_ns}; }

  const std::string base =
      std::filesystem::temp_directory_path() / ("recorder-" + std::to_string(::getpid()));
  const std::string path = base + ".mcap", second = base + "-2.mcap";
  FakeServer server;
  std::int64_t steady_ns = 7 * kSecond;
  std::int64_t wall_ns = 1'700'000'000 * kSecond;
};

TEST_F(RecorderTest, WithoutASnapshotAnOlderRecordingStays) {
  std::ofstream(path) << "older";
  {
    Recorder recorder = create();
    recorder.add(server.session, now());
    ASSERT_TRUE(recorder.finish());
    EXPECT_EQ(recorder.totals().file_bytes, 0U);
    EXPECT_TRUE(recorder.totals().topics.empty());
  }
  EXPECT_EQ(std::filesystem::file_size(path), 5U);
  EXPECT_FALSE(std::filesystem::exists(path + ".part"));
}

TEST_F(RecorderTest, ARecorderThatIsStartedAgainLeavesTheEarlierRecording) {
  for (const int count : {20, 30}) {
    Recorder recorder = create();
    join(recorder);
    frames(recorder, count);
    ASSERT_TRUE(recorder.finish());
    EXPECT_EQ(recorder.file().path(), count == 20 ? path : second);
  }
  for (const auto& [file, count] : {std::pair{path, 20}, {second, 30}}) {
    const auto playback = Playback::open(file);
    ASSERT_TRUE(playback && (*playback)->next());
    int played = 0;
    while ((*playback)->next() == Playback::Step::kFrame) ++played;
    EXPECT_EQ(played, count);
  }
}

TEST_F(RecorderTest, TimesInTheFileAreThoseOfTheSteadyClockAndAllDiffer) {
  Recorder recorder = create();
  join(recorder);
  const std::int64_t began_ns = wall_ns;
  frames(recorder, 5);
  wall_ns = 0;  // a board without a battery
  frames(recorder, 5);
  wall_ns = std::int64_t{3} << 60;
  frames(recorder, 5);
  ASSERT_TRUE(recorder.finish());
  auto reader = McapReader::open(*InputFile::open(path));
  ASSERT_TRUE(reader);
  McapMessage message;
  std::uint64_t last_ns = static_cast<std::uint64_t>(began_ns) - 1;
  while (*reader->next(message)) {
    EXPECT_GT(message.log_time_ns, last_ns);
    last_ns = message.log_time_ns;
  }
  EXPECT_EQ(last_ns, static_cast<std::uint64_t>(began_ns + 14 * kSecond));
}

TEST_F(RecorderTest, ARecordingThatIsPlayedMayBeRecordedOver) {
  {
    Recorder recorder = create();
    join(recorder);
    frames(recorder, 50);
    ASSERT_TRUE(recorder.finish());
  }
  const auto playback = Playback::open(path);
  ASSERT_TRUE(playback && (*playback)->next());
  Recorder recorder = create(Existing::kReplaced);
  join(recorder);
  EXPECT_FALSE(std::filesystem::exists(path + ".part")) << "it has its name";
  for (int frame = 1; frame <= 50; ++frame) EXPECT_EQ((*playback)->next(), Playback::Step::kFrame);
  EXPECT_EQ((*playback)->timeline().hash(), server.hashes.at(50));
}

TEST_F(RecorderTest, AfterAFailedWriteItCountsWhatIsInTheFile) {
  Recorder recorder = create();
  join(recorder);
  frames(recorder, 20);
  const std::uint64_t whole = std::filesystem::file_size(path);
  {
    const FullDisk full(whole + 100);
    frames(recorder, 20);
    EXPECT_FALSE(recorder.good());
    EXPECT_FALSE(recorder.finish());
  }
  const Recorder::Totals& totals = recorder.totals();
  EXPECT_EQ(totals.file_bytes, std::filesystem::file_size(path));
  EXPECT_EQ(totals.file_bytes, whole + 100);
  const auto playback = Playback::open(path);
  ASSERT_TRUE(playback);
  std::uint64_t played = 0;
  ASSERT_EQ((*playback)->next(), Playback::Step::kStarted);
  while ((*playback)->next() == Playback::Step::kFrame) ++played;
  EXPECT_EQ(totals.frames, played);
  EXPECT_EQ(totals.topics.at(transport::DeltaMessage::kTopic).messages, played);
}

}  // namespace
}  // namespace tandem::recording::of_recorder
