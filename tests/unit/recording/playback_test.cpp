#include "services/follow/recording/playback.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <tuple>

#include "services/follow/recording/recorder.hpp"
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
      recorder->add(server.session.epoch, delta, now());
      wall_ns += kSecond;
      steady_ns += kSecond;
      if (recorder->snapshot_due(steady_ns))
        recorder->cut_snapshot(server.frame(), server.snapshot().bytes, now());
    }
  }
  void schedule(std::int32_t gravity_y) {
    issued.push_back(server.schedule(gravity_y));
    recorder->add(issued.back(), now());
  }
  void join() {
    const auto snapshot = server.snapshot();
    ASSERT_TRUE(client->load(snapshot.bytes, server.session.epoch));
    recorder->add(snapshot, now());
  }
  void begin() {
    recorder.emplace(std::move(*Recorder::create(path, Compression::kZstd)));
    client.emplace(std::move(*ClientTimeline::create(server.session.streams[0].layout)));
    recorder->add(server.session, now());
    join();
  }
  [[nodiscard]] client::Now now() const { return {steady_ns, wall_ns}; }
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

TEST_F(PlaybackTest, KeysAndEventsAreThereAlsoAfterASeek) {
  server = FakeServer(1000, 40, 1, {}, {.keys = true, .events = true});
  begin();
  std::vector<std::byte> news(64);
  ByteWriter out(news);
  put_section(SectionType::kKeys, out, [](ByteWriter& body) {
    write_key_change({"phase", std::span<const std::byte>()}, body);
  });
  put_section(SectionType::kEvents, out, [](ByteWriter& body) { write_event({7, {}, {}}, body); });
  news.resize(out.size());
  frames(10);
  server.news = news;
  frames(100);
  server.news = news;
  frames(40);
  ASSERT_TRUE(recorder->finish());
  for (const double from_s : {0.0, 70.0}) {
    const auto playback = Playback::open(path);
    ASSERT_TRUE(playback) << playback.error().message;
    (*playback)->seek(from_s);
    std::vector<Frame> told;
    for (auto step = (*playback)->next(); step && *step != Step::kEnd; step = (*playback)->next()) {
      if (*step == Step::kFrame && !(*playback)->timeline().news().events.empty())
        told.push_back((*playback)->timeline().applied());
    }
    EXPECT_EQ(told, from_s == 0 ? (std::vector<Frame>{11, 111}) : std::vector<Frame>{111});
    EXPECT_EQ((*playback)->timeline().world()->event_count(), 2U);
    EXPECT_EQ((*playback)->timeline().world()->keys().size(), 1U);
  }
}

TEST_F(PlaybackTest, OtherNamesOfTheSameSessionBeginNoRun) {
  begin();
  frames(3);
  server.session.names = {{1, 0, "crane"}};
  recorder->add(server.session, now());
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

TEST_F(PlaybackTest, AWallClockThatJumpsAnHourChangesNoTimeAndNoSnapshot) {
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
  EXPECT_EQ((*playback)->length_s(), 199);
  for (const double from_s : {65.0, 130.0, 185.0}) {
    (*playback)->seek(from_s);
    do {
      ASSERT_TRUE((*playback)->next());
    } while ((*playback)->time_s() < from_s);
    EXPECT_EQ((*playback)->timeline().applied(), static_cast<Frame>(from_s) + 1) << "one frame a second";
  }
  for (const Frame frame : {59U, 119U, 179U, 199U}) {
    ASSERT_TRUE((*playback)->seek(server.session.epoch, frame));
    ASSERT_EQ((*playback)->next(), Step::kStarted);
    EXPECT_EQ((*playback)->timeline().applied(), frame / 60 * 60);
  }
}

TEST_F(PlaybackTest, SecondsCountOnThroughPausesAndOtherEpochs) {
  begin();
  frames(10);
  steady_ns += 20 * kSecond;       // the session is paused
  wall_ns -= 1'000'000 * kSecond;  // and a clock is set meanwhile
  frames(5);
  server = FakeServer(server.session.epoch - 500, 30);  // that of the server as well, which is started again
  client.emplace(std::move(*ClientTimeline::create(server.session.streams[0].layout)));
  recorder->add(server.session, now());
  join();
  frames(5);
  ASSERT_TRUE(recorder->finish());
  auto playback = Playback::open(path);
  ASSERT_TRUE(playback);
  EXPECT_EQ((*playback)->length_s(), 39);
  for (const auto& [from_s, frame, of_first] : {std::tuple{5.0, 6U, true},
                                                {20.0, 11U, true},
                                                {34.0, 15U, true},
                                                {36.0, 2U, false},
                                                {39.0, 5U, false}}) {
    (*playback)->seek(from_s);
    do {
      ASSERT_EQ((*playback)->next().value_or(Step::kEnd) == Step::kEnd, false);
    } while ((*playback)->time_s() < from_s);
    EXPECT_EQ((*playback)->timeline().applied(), frame) << from_s;
    EXPECT_EQ((*playback)->session().epoch != server.session.epoch, of_first) << from_s;
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

TEST_F(PlaybackTest, SeeksToTheLastSnapshotNotBehindAFrameThoughAClockWasSetBackBetweenEpochs) {
  begin();
  frames(200);
  server = FakeServer(server.session.epoch - 500, 30);
  client.emplace(std::move(*ClientTimeline::create(server.session.streams[0].layout)));
  recorder->add(server.session, now());
  join();
  frames(3);
  ASSERT_TRUE(recorder->finish());
  auto playback = Playback::open(path);
  ASSERT_TRUE(playback);
  const Epoch last = server.session.epoch, first = last + 500;
  for (const auto& [epoch, frame, epoch_found, found] : {std::tuple{first, 130U, first, 120U},
                                                         {first, 59U, first, 0U},
                                                         {first, 60U, first, 60U},
                                                         {first, 1000000U, first, 180U},
                                                         {last, 2U, last, 0U},
                                                         {last + 1, 0U, first, 0U},
                                                         {first + 1, 70U, first, 0U}}) {
    EXPECT_EQ((*playback)->seek(epoch, frame), epoch == epoch_found) << epoch;
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
  recorder->add(server.session.epoch, delta, now());
  schedule(-60);
  wall_ns += kSecond;
  steady_ns += kSecond;
  ASSERT_TRUE(recorder->snapshot_due(steady_ns));
  recorder->cut_snapshot(server.frame(), server.snapshot().bytes, now());
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
  recorder->add(server.session.epoch, complete(server.advance(wall_ns)), now());  // does not follow
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
  recorder->add(server.session, now());
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

// Reads all messages of the recording, and hands them to `write` in another order.
std::vector<std::pair<McapMessage, std::vector<std::byte>>> messages_of(const std::string& file) {
  std::vector<std::pair<McapMessage, std::vector<std::byte>>> all;
  auto reader = McapReader::open(*InputFile::open(file));
  EXPECT_TRUE(reader);
  McapMessage message;
  while (*reader->next(message)) {
    message.topic = message.topic == transport::SessionMessage::kTopic    ? transport::SessionMessage::kTopic
                    : message.topic == transport::SnapshotMessage::kTopic ? transport::SnapshotMessage::kTopic
                    : message.topic == transport::ScheduledInputMessage::kTopic
                        ? transport::ScheduledInputMessage::kTopic
                        : transport::DeltaMessage::kTopic;
    all.emplace_back(message, std::vector<std::byte>(message.content.begin(), message.content.end()));
  }
  return all;
}

TEST_F(PlaybackTest, AFileThatWasWrittenAnewTopicByTopicHasTheSameStates) {
  begin();
  frames(5);
  schedule(-40);
  frames(100);
  for (int i = 0; i < 3; ++i) server.advance();
  join();
  frames(30);
  const Epoch first = server.session.epoch;
  server = FakeServer(first - 300, 30);  // its server's clock was set back
  client.emplace(std::move(*ClientTimeline::create(server.session.streams[0].layout)));
  recorder->add(server.session, now());
  join();
  ASSERT_TRUE(recorder->finish());
  const auto states = [](const std::string& file) {
    std::vector<std::tuple<Epoch, Frame, std::uint64_t, bool>> all;
    auto playback = Playback::open(file);
    EXPECT_TRUE(playback) << playback.error().message;
    for (auto step = (*playback)->next();; step = (*playback)->next()) {
      EXPECT_TRUE(step) << step.error().message;
      if (!step || *step == Step::kEnd) break;
      all.emplace_back((*playback)->session().epoch, (*playback)->timeline().applied(),
                       (*playback)->timeline().hash(), *step == Step::kStarted);
    }
    EXPECT_EQ((*playback)->left_out(), "");
    return all;
  };
  const auto expected = states(path);
  ASSERT_EQ(expected.size(), 138U);
  auto messages = messages_of(path);
  const std::string other = path + ".anew";
  // Each time in another order; and with the times that recorders of before gave, where a snapshot that was
  // cut stood in front of the frames of the same turn.
  for (const char* order : {"as it was", "by topic", "backwards", "older times"}) {
    if (order == std::string("by topic"))
      std::ranges::stable_sort(messages, {}, [](const auto& message) { return message.first.topic; });
    if (order == std::string("backwards")) std::ranges::reverse(messages);
    if (order == std::string("older times")) {
      std::ranges::stable_sort(messages, {}, [](const auto& m) { return m.first.log_time_ns; });
      const std::uint64_t first_ns = messages.front().first.log_time_ns;
      for (auto& [message, content] : messages) {
        const std::uint64_t since_ns = message.log_time_ns - first_ns;
        const bool cut = since_ns > 50 * kSecond && since_ns < 80 * kSecond;
        if (cut && message.topic == transport::SnapshotMessage::kTopic) message.log_time_ns -= 3 * kSecond;
      }
    }
    auto file = OutputFile::create(other, Existing::kReplaced);
    ASSERT_TRUE(file);
    McapWriter writer(
        [&](std::span<const std::byte> bytes) {
          std::vector<std::byte> written(bytes.begin(), bytes.end());
          const std::string ours = "tandem ";  // the library: another program wrote it
          const auto at = std::search(written.begin(), written.end(), ours.begin(), ours.end(),
                                      [](std::byte a, char b) { return a == static_cast<std::byte>(b); });
          if (file->written_bytes() < 20 && at != written.end()) *at = std::byte{'T'};
          return file->write(written);
        },
        Compression::kZstd);
    for (const auto& [message, content] : messages) {
      writer.declare({.topic = std::string(message.topic),
                      .message_encoding = "cdr",
                      .schema_name = {},
                      .schema_encoding = {},
                      .schema = {}});
      writer.add(message.topic, content, static_cast<std::int64_t>(message.log_time_ns),
                 static_cast<std::int64_t>(message.publish_time_ns));
    }
    ASSERT_TRUE(writer.finish() && file->commit());
    EXPECT_EQ(states(other), expected) << order;
    auto playback = Playback::open(other);
    ASSERT_TRUE(playback && (*playback)->seek(first, 90));
    auto step = (*playback)->next();
    while (step && *step != Step::kEnd && (*playback)->timeline().applied() < 90) step = (*playback)->next();
    EXPECT_EQ((*playback)->timeline().applied(), 90U) << order;
    std::filesystem::remove(other);
  }
}

TEST_F(PlaybackTest, ADamagedPartIsLeftOutUpToTheNextSnapshotAndSaid) {
  begin();
  frames(150);
  ASSERT_TRUE(recorder->finish());
  {
    auto reader = McapReader::open(*InputFile::open(path));
    ASSERT_TRUE(reader);
    const auto chunks = reader->chunks_with(transport::DeltaMessage::kTopic);
    std::fstream bytes(path, std::ios::in | std::ios::out | std::ios::binary);
    bytes.seekp(static_cast<std::streamoff>(chunks[chunks.size() / 5].at + 100));
    bytes.write("rotten rotten rotten", 20);
  }
  auto playback = Playback::open(path);
  ASSERT_TRUE(playback);
  EXPECT_EQ((*playback)->left_out(), "");
  const std::string steps = play(**playback);
  const std::size_t second = steps.find('S', 1);
  ASSERT_NE(second, std::string::npos) << steps;
  EXPECT_GT(second, 5U);
  EXPECT_EQ(steps.substr(second), "S" + std::string(90, '.')) << "from the snapshot of frame 60 on";
  EXPECT_EQ((*playback)->left_out().find("is damaged (at byte "), 0U) << (*playback)->left_out();
}

TEST_F(PlaybackTest, TwoSessionsAtTheSameTimeAreRefused) {
  begin();
  frames(2);
  const Epoch first = server.session.epoch;
  server = FakeServer(first + 1000, 30);
  recorder->add(server.session, now());
  recorder->add(server.snapshot(), now());
  recorder->add(first, complete(server.advance()), now());
  ASSERT_TRUE(recorder->finish());
  auto playback = Playback::open(path);
  ASSERT_TRUE(playback);
  for (int i = 0; i < 4; ++i) ASSERT_TRUE((*playback)->next());
  const auto step = (*playback)->next();
  ASSERT_FALSE(step);
  EXPECT_EQ(step.error().code, ErrorCode::kUnsupported);
  EXPECT_NE(step.error().message.find("two sessions at the same time"), std::string::npos);
}

TEST_F(PlaybackTest, AFrameOfAnotherHashIsAnError) {
  begin();
  frames(3);
  auto delta = complete(server.advance());
  delta.hash ^= 1U;
  recorder->add(server.session.epoch, delta, now());
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
  recorder->add_event("door", "it said \"no\\yes\"\nand closed", now());
  recorder->add_event("", "nobody", now());
  recorder->add_event("silent", "", now());
  frames(100);
  recorder->add_event("late", std::string(1000, 'x'), now());
  ASSERT_TRUE(recorder->finish());
  const auto playback = Playback::open(path);
  ASSERT_TRUE(playback) << playback.error().message;
  const auto& events = (*playback)->events();
  ASSERT_EQ(events.size(), 3U);
  EXPECT_EQ(events[0].text, "door: it said \"no\\yes\" and closed");
  EXPECT_EQ(events[1].text, "nobody");
  EXPECT_EQ(events[2].text.size(), kMaxEventBytes);
  EXPECT_EQ((*playback)->time_s(events[0]), 3);
  int played = 0;
  ASSERT_EQ((*playback)->next(), Step::kStarted);
  while ((*playback)->next() == Step::kFrame) ++played;
  EXPECT_EQ(played, 103);
}

}  // namespace
}  // namespace tandem::recording
