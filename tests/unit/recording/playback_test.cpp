#include "services/recording/playback.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "services/recording/recorder.hpp"
#include "tests/support/client/fake_server.hpp"

namespace tandem::recording {
namespace {

using client::FakeServer;
using Step = Playback::Step;

constexpr std::int64_t kSecond = 1'000'000'000;

class PlaybackTest : public ::testing::Test {
 protected:
  ~PlaybackTest() override { std::filesystem::remove(path); }
  static client::CompleteDelta complete(const transport::DeltaMessage& delta) {
    return {.frame = delta.frame,
            .last_input = delta.last_input,
            .server_time_ns = delta.server_time_ns,
            .hash = delta.hash,
            .payload = delta.payload};
  }
  // One frame a second, as a client takes it in and records it.
  void frames(int count) {
    for (int i = 0; i < count; ++i) {
      const auto delta = complete(server.advance(wall_ns));
      while (!issued.empty() && issued.front().number <= delta.last_input) {
        ASSERT_TRUE(client->schedule(*client::read_scheduled(issued.front())));
        issued.erase(issued.begin());
      }
      ASSERT_TRUE(client->apply(delta.frame, delta.last_input, delta.hash, delta.payload));
      recorder->add(server.session.epoch, delta, wall_ns);
      wall_ns += kSecond;
      steady_ns += kSecond;
      if (recorder->snapshot_due(steady_ns)) recorder->cut_snapshot(*client, {steady_ns, wall_ns});
    }
  }
  void schedule(std::int32_t gravity_y) {
    issued.push_back(server.schedule(gravity_y));
    recorder->add(issued.back(), wall_ns);
  }
  void join() {
    const auto snapshot = server.snapshot();
    ASSERT_TRUE(client->load(snapshot.bytes, server.session.epoch));
    recorder->add(snapshot, {steady_ns, wall_ns});
  }
  void begin() {
    recorder.emplace(std::move(*Recorder::create(path, Compression::kZstd)));
    client.emplace(std::move(*ClientTimeline::create(server.session.streams[0].layout)));
    recorder->add(server.session, wall_ns);
    join();
  }
  // Steps until the end; 'S' a start, '.' a frame. Every frame has the server's hash.
  std::string play(Playback& playback) const {
    std::string steps;
    for (;;) {
      const auto step = playback.next();
      EXPECT_TRUE(step) << step.error().message;
      if (!step || *step == Step::kEnd) return steps;
      EXPECT_EQ(playback.timeline().hash(), server.hashes.at(playback.timeline().applied()));
      steps += *step == Step::kStarted ? 'S' : '.';
    }
  }
  const std::string path =
      std::filesystem::temp_directory_path() / ("playback-" + std::to_string(::getpid()) + ".mcap");
  FakeServer server;
  std::vector<transport::ScheduledInputMessage> issued;
  std::optional<ClientTimeline> client;
  std::optional<Recorder> recorder;
  std::int64_t wall_ns = 1'700'000'000 * kSecond;
  std::int64_t steady_ns = 5 * kSecond;
};

TEST_F(PlaybackTest, PlaysEveryFrameWithTheServersHash) {
  begin();
  frames(5);
  schedule(-40);
  schedule(-50);
  frames(150);
  ASSERT_TRUE(recorder->finish());
  EXPECT_EQ(recorder->totals().frames, 155U);
  EXPECT_EQ(recorder->totals().snapshots_cut, 2U);
  EXPECT_EQ(recorder->totals().file_bytes, std::filesystem::file_size(path));
  const auto playback = Playback::open(path);
  ASSERT_TRUE(playback) << playback.error().message;
  EXPECT_EQ(play(**playback), "S" + std::string(155, '.'));
  EXPECT_EQ((*playback)->length_s(), 154);
  EXPECT_FALSE((*playback)->torn_at());
}

TEST_F(PlaybackTest, OtherNamesOfTheSameSessionBeginNoRun) {
  begin();
  frames(3);
  server.session.names = {{1, 0, "crane"}};
  recorder->add(server.session, wall_ns);
  frames(3);
  ASSERT_TRUE(recorder->finish());
  const auto playback = Playback::open(path);
  ASSERT_TRUE(playback);
  EXPECT_EQ(play(**playback), "S......");
  EXPECT_EQ((*playback)->session().names, server.session.names);
}

TEST_F(PlaybackTest, ARecordingOfAnotherVersionIsRefusedByThatVersion) {
  const auto playback = Playback::open(std::string(TANDEM_TEST_VERSION_1));
  ASSERT_TRUE(playback) << playback.error().message;
  const auto step = (*playback)->next();
  ASSERT_FALSE(step);
  EXPECT_EQ(step.error().code, ErrorCode::kUnsupported);
  EXPECT_NE(step.error().message.find("protocol version 1"), std::string::npos) << step.error().message;
}

TEST_F(PlaybackTest, AWallClockThatJumpsAnHourChangesNoSnapshot) {
  begin();
  frames(70);
  wall_ns -= 3600 * kSecond;
  frames(80);
  wall_ns += 2 * 3600 * kSecond;
  frames(50);
  ASSERT_TRUE(recorder->finish());
  EXPECT_EQ(recorder->totals().snapshots_cut, 3U) << "of frames 60, 120 and 180";
  const auto playback = Playback::open(path);
  ASSERT_TRUE(playback) << playback.error().message;
  EXPECT_EQ(play(**playback), "S" + std::string(200, '.'));
  for (const Frame frame : {59U, 119U, 179U, 199U}) {
    ASSERT_TRUE((*playback)->seek(server.session.epoch, frame));
    ASSERT_EQ((*playback)->next(), Step::kStarted);
    EXPECT_EQ((*playback)->timeline().applied(), frame / 60 * 60);
  }
}

TEST_F(PlaybackTest, AFrameBringsTheInputsThatItIsTheFirstToPromise) {
  begin();
  frames(3);
  schedule(-40);
  frames(1);
  ASSERT_TRUE(recorder->finish());
  auto playback = Playback::open(path);
  ASSERT_TRUE(playback);
  for (int i = 0; i < 4; ++i) ASSERT_TRUE((*playback)->next());
  EXPECT_TRUE((*playback)->inputs().empty());
  ASSERT_EQ((*playback)->next(), Step::kFrame);
  ASSERT_EQ((*playback)->inputs().size(), 1U);
  EXPECT_EQ((*playback)->inputs()[0].frame, (*playback)->delta().frame + 1);
}

TEST_F(PlaybackTest, SeeksToTheLastSnapshotBefore) {
  begin();
  frames(200);
  ASSERT_TRUE(recorder->finish());
  auto playback = Playback::open(path);
  ASSERT_TRUE(playback);
  for (const auto& [from_s, frame] :
       {std::pair{130.0, 120U}, {59.0, 0U}, {60.0, 60U}, {1e9, 180U}, {0.0, 0U}}) {
    (*playback)->seek(from_s);
    ASSERT_EQ((*playback)->next(), Step::kStarted);
    EXPECT_EQ((*playback)->timeline().applied(), frame) << from_s;
    EXPECT_EQ(play(**playback), std::string(200 - frame, '.'));
  }
}

TEST_F(PlaybackTest, SeeksToTheLastSnapshotNotBehindAFrame) {
  begin();
  frames(200);
  server = FakeServer(server.session.epoch + 1000, 30);
  client.emplace(std::move(*ClientTimeline::create(server.session.streams[0].layout)));
  recorder->add(server.session, wall_ns);
  join();
  frames(3);
  ASSERT_TRUE(recorder->finish());
  auto playback = Playback::open(path);
  ASSERT_TRUE(playback);
  const Epoch last = server.session.epoch, first = last - 1000;
  for (const auto& [epoch, frame, epoch_found, found] : {std::tuple{first, 130U, first, 120U},
                                                         {first, 59U, first, 0U},
                                                         {first, 60U, first, 60U},
                                                         {first, 1000000U, first, 180U},
                                                         {last, 2U, last, 0U},
                                                         {last + 1, 0U, last, 0U},
                                                         {first - 1, 70U, first, 0U}}) {
    ASSERT_TRUE((*playback)->seek(epoch, frame));
    ASSERT_EQ((*playback)->next(), Step::kStarted);
    EXPECT_EQ((*playback)->session().epoch, epoch_found) << epoch << ' ' << frame;
    EXPECT_EQ((*playback)->timeline().applied(), found) << epoch << ' ' << frame;
  }
}

TEST_F(PlaybackTest, AnInputOnItsWayWhenASnapshotIsCutIsThereBehindIt) {
  begin();
  frames(59);
  // Taken in before the snapshot of frame 60, and first promised by frame 61.
  const auto delta = complete(server.advance(wall_ns));
  ASSERT_TRUE(client->apply(delta.frame, delta.last_input, delta.hash, delta.payload));
  recorder->add(server.session.epoch, delta, wall_ns);
  schedule(-60);
  wall_ns += kSecond;
  steady_ns += kSecond;
  ASSERT_TRUE(recorder->snapshot_due(steady_ns));
  recorder->cut_snapshot(*client, {steady_ns, wall_ns});
  frames(10);
  ASSERT_TRUE(recorder->finish());
  auto playback = Playback::open(path);
  ASSERT_TRUE(playback);
  (*playback)->seek(62);
  EXPECT_EQ(play(**playback), "S" + std::string(10, '.'));
}

TEST_F(PlaybackTest, AGapBeginsARunWithTheNextSnapshot) {
  begin();
  frames(5);
  for (int i = 0; i < 3; ++i) server.advance();
  recorder->add(server.session.epoch, complete(server.advance(wall_ns)), wall_ns);  // does not follow
  join();
  frames(4);
  ASSERT_TRUE(recorder->finish());
  auto playback = Playback::open(path);
  ASSERT_TRUE(playback);
  EXPECT_EQ(play(**playback), "S.....S....");
}

TEST_F(PlaybackTest, AnotherEpochIsAnotherRun) {
  begin();
  frames(5);
  server = FakeServer(2000, 30);
  client.emplace(std::move(*ClientTimeline::create(server.session.streams[0].layout)));
  recorder->add(server.session, wall_ns);
  join();
  frames(3);
  ASSERT_TRUE(recorder->finish());
  auto playback = Playback::open(path);
  ASSERT_TRUE(playback);
  std::vector<Epoch> epochs;
  for (auto step = (*playback)->next(); *step != Step::kEnd; step = (*playback)->next()) {
    if (*step == Step::kStarted) epochs.push_back((*playback)->session().epoch);
  }
  EXPECT_EQ(epochs, (std::vector<Epoch>{1000, 2000}));
}

TEST_F(PlaybackTest, AFileCutShortIsPlayedUpToTheTear) {
  begin();
  frames(100);
  ASSERT_TRUE(recorder->finish());
  std::filesystem::resize_file(path, recorder->totals().file_bytes - recorder->totals().fixed_bytes);
  auto playback = Playback::open(path);
  ASSERT_TRUE(playback);
  EXPECT_TRUE((*playback)->torn_at());
  const std::string steps = play(**playback);
  EXPECT_GT(steps.size(), 10U);
  EXPECT_LT(steps.size(), 100U);
}

TEST_F(PlaybackTest, AnOpenRecordingCanBePlayedSoFar) {
  begin();
  frames(50);
  auto playback = Playback::open(path);
  ASSERT_TRUE(playback);
  EXPECT_GT(play(**playback).size(), 40U);
}

TEST_F(PlaybackTest, WhatCannotBeReadIsToldWithTheFilesName) {
  EXPECT_EQ(Playback::open("/nowhere/x.mcap").error().message,
            "/nowhere/x.mcap: cannot read: No such file or directory");
  std::ofstream(path) << "not a recording";
  EXPECT_EQ(Playback::open(path).error().message,
            path + ": not an MCAP file: its first eight bytes are others");
}

TEST_F(PlaybackTest, AFileThatBecomesShorterWhileItIsReadIsAnError) {
  begin();
  frames(150);
  const std::uint64_t middle = std::filesystem::file_size(path);
  frames(150);
  ASSERT_TRUE(recorder->finish());
  auto playback = Playback::open(path);
  ASSERT_TRUE(playback);
  ASSERT_EQ((*playback)->next(), Step::kStarted);
  std::filesystem::resize_file(path, middle);
  auto step = (*playback)->next();
  std::size_t played = 0;
  for (; step == Step::kFrame; step = (*playback)->next()) ++played;
  ASSERT_FALSE(step);
  EXPECT_EQ(step.error().code, ErrorCode::kIo);
  EXPECT_EQ(step.error().message, "it became shorter while it was read");
  EXPECT_GT(played, 140U) << "what is still there is read";
  const auto sought = (*playback)->seek(server.session.epoch, 290);
  ASSERT_FALSE(sought);
  EXPECT_EQ(sought.error().message, "it became shorter while it was read");
}

TEST_F(PlaybackTest, WhatIsNoRegularFileIsRefused) {
  ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
  for (const auto& [what, named] : {std::pair{path.c_str(), "a FIFO"},
                                    {"/tmp", "a directory"},
                                    {"/dev/zero", "a device"},
                                    {"/dev/tty", "a device"}}) {
    const auto playback = Playback::open(what);
    ASSERT_FALSE(playback) << what;
    EXPECT_EQ(playback.error().message,
              std::string(what) + ": cannot read: it is " + named + ", and no regular file");
  }
}

TEST_F(PlaybackTest, AFrameOfAnotherHashIsAnError) {
  begin();
  frames(3);
  auto delta = complete(server.advance());
  delta.hash ^= 1U;
  recorder->add(server.session.epoch, delta, wall_ns);
  ASSERT_TRUE(recorder->finish());
  auto playback = Playback::open(path);
  ASSERT_TRUE(playback);
  for (int i = 0; i < 4; ++i) ASSERT_TRUE((*playback)->next());
  const auto step = (*playback)->next();
  ASSERT_FALSE(step);
  EXPECT_EQ(step.error().code, ErrorCode::kMismatch);
  EXPECT_EQ(step.error().message.substr(0, 9), "frame 4: ");
}

TEST_F(PlaybackTest, HoldsTheEventsOfTheFileByTimeAndPlaysAsWithoutThem) {
  begin();
  frames(3);
  recorder->add_event("door", "it said \"no\\yes\"\nand closed", wall_ns);
  recorder->add_event("", "nobody", wall_ns - 2 * kSecond);
  recorder->add_event("silent", "", wall_ns);
  frames(100);
  recorder->add_event("late", std::string(1000, 'x'), wall_ns);
  ASSERT_TRUE(recorder->finish());
  const auto playback = Playback::open(path);
  ASSERT_TRUE(playback) << playback.error().message;
  const auto& events = (*playback)->events();
  ASSERT_EQ(events.size(), 3U);
  EXPECT_EQ(events[0].text, "nobody");
  EXPECT_EQ(events[1].text, "door: it said \"no\\yes\" and closed");
  EXPECT_EQ(events[2].text.size(), kMostEventBytes);
  EXPECT_EQ((*playback)->time_s(events[1]), 3);
  int played = 0;
  ASSERT_EQ((*playback)->next(), Step::kStarted);
  while ((*playback)->next() == Step::kFrame) ++played;
  EXPECT_EQ(played, 103);
}

}  // namespace
}  // namespace tandem::recording
