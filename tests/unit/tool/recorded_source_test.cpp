#include "services/tool/recorded_source.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "services/engines/scenes/scene.hpp"
#include "services/follow/recording/recorder.hpp"
#include "tests/support/client/fake_server.hpp"

namespace tandem::tool {
namespace {

using client::FakeServer;
using recording::Playback;
using transport::Reason;
using Step = Playback::Step;

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr Frame kFrames = 200;

// A recording of 200 frames, one a second, with a snapshot a minute and gravity that changes after frame 5.
class RecordedSourceTest : public ::testing::Test {
 protected:
  RecordedSourceTest() {
    server.session.frame_rate_hz = 1;
    auto recorder = recording::Recorder::create(path, recording::Compression::kZstd);
    auto client = ClientTimeline::create(server.session.streams[0].layout);
    const auto snapshot = server.snapshot();
    EXPECT_TRUE(client->load(snapshot.bytes, server.session.epoch));
    recorder->add(server.session, {wall_ns, wall_ns});
    recorder->add(snapshot, {wall_ns, wall_ns});
    for (Frame frame = 1; frame <= kFrames; ++frame) {
      if (frame == 5) {
        const auto input = server.schedule(-4000);
        recorder->add(input, {wall_ns, wall_ns});
        EXPECT_TRUE(client->schedule(*client::read_scheduled(input)));
      }
      const transport::DeltaMessage delta = server.advance(wall_ns);
      EXPECT_TRUE(client->apply(delta.frame, delta.last_input, delta.hash, delta.payload));
      recorder->add(server.session.epoch,
                    {.frame = delta.frame,
                     .last_input = delta.last_input,
                     .server_time_ns = delta.server_time_ns,
                     .hash = delta.hash,
                     .payload = delta.payload},
                    {wall_ns, wall_ns});
      if (frame == 51) recorder->add_event("door", "closes", {wall_ns, wall_ns});
      wall_ns += kSecond;
      if (recorder->snapshot_due(wall_ns))
        recorder->cut_snapshot(frame, server.snapshot().bytes, {wall_ns, wall_ns});
    }
    recorder->add_event("clock", "it is \"late\"", {wall_ns - kSecond, wall_ns - kSecond});
    EXPECT_TRUE(recorder->finish());
    fixed_bytes = recorder->totals().fixed_bytes;
  }
  ~RecordedSourceTest() override { std::filesystem::remove(path); }

  // A source at the first frame of `from_s` or later.
  RecordedSource& open(double from_s, Epoch epoch = 5000) {
    if (!playback) playback = std::move(*Playback::open(path));
    playback->seek(from_s);
    auto step = playback->next();
    while (step && *step != Step::kEnd && playback->time_s() < from_s) step = playback->next();
    EXPECT_TRUE(step && *step != Step::kEnd);
    config.epoch = epoch;
    config.frame_rate_hz = 1;
    config.clock_ns = [] { return now_ns; };
    return source.emplace(*playback, config, seeks);
  }
  // Frames to the end; each has the server's hash, and so has the state.
  Frame play() {
    Frame played = 0;
    while (const auto made = source->next({}, outbox)) {
      EXPECT_EQ(made->deltas.size(), 1U);
      EXPECT_EQ(made->deltas[0].hash, server.hashes.at(made->frame));
      EXPECT_EQ(source->hash(0), made->deltas[0].hash);
      ++played;
    }
    return played;
  }
  Reason accept(transport::InputKind kind, std::vector<double> values) {
    return source
        ->accept({.client = 1,
                  .number = 1,
                  .kind = static_cast<std::uint32_t>(kind),
                  .values = std::move(values),
                  .bytes = {}},
                 {}, outbox)
        .reason;
  }

  const std::string path =
      std::filesystem::temp_directory_path() / ("source-" + std::to_string(::getpid()) + ".mcap");
  FakeServer server;
  std::int64_t wall_ns = 1'700'000'000 * kSecond;
  std::uint64_t fixed_bytes = 0;
  std::unique_ptr<Playback> playback;
  host::ServiceConfig config;
  host::Outbox outbox{host::Outbox::Limits{}};
  accounts::TokenBucket seeks{1, 1};
  static inline std::int64_t now_ns = 0;
  std::optional<RecordedSource> source;
};

TEST_F(RecordedSourceTest, TellsTheGravityInForceWhereItBegins) {
  open(60);
  const transport::SessionMessage& session = source->session();
  const double quantum = session.lattice_unit / 64 / (session.dt_s * session.dt_s);
  for (std::size_t axis = 0; axis < 3; ++axis)
    EXPECT_NEAR(session.gravity[axis], playback->timeline().drive().gravity[axis] * quantum, quantum);
  EXPECT_NE(session.gravity[1], 0) << "the recording has a drive by then";
  EXPECT_EQ(session.dt_s, playback->session().dt_s);
  EXPECT_EQ(session.continues_epoch, 0U);
}

TEST_F(RecordedSourceTest, TellsTheEventsOfTheRecordingByTime) {
  open(60);
  const std::string& told = source->session().scene_json;
  const auto first = told.find(R"("atS":50)"), second = told.find(R"("atS":199)");
  ASSERT_NE(first, std::string::npos) << told;
  ASSERT_NE(second, std::string::npos) << told;
  EXPECT_LT(first, second);
  EXPECT_NE(told.find(R"("text":"door: closes")"), std::string::npos) << told;
  EXPECT_NE(told.find(R"("text":"clock: it is \"late\"")"), std::string::npos) << told;
}

TEST_F(RecordedSourceTest, PublishesEveryFrameUnderItsOwnEpoch) {
  open(0);
  EXPECT_EQ(source->session().epoch, 5000U);
  EXPECT_EQ(source->frame(), 0U);
  EXPECT_EQ(play(), kFrames);
  ASSERT_TRUE(source->ending());
  EXPECT_EQ(*source->ending(), Step::kEnd);
  const auto input = outbox.pop(std::chrono::nanoseconds(0));
  ASSERT_TRUE(input && std::holds_alternative<transport::ScheduledInputMessage>(*input));
  EXPECT_EQ(std::get<transport::ScheduledInputMessage>(*input).epoch, 5000U);
}

TEST_F(RecordedSourceTest, ItsSnapshotsLetClientsJoinAtAnyFrame) {
  open(0);
  for (int i = 0; i < 77; ++i) ASSERT_TRUE(source->next({}, outbox));
  std::vector<std::byte> snapshot;
  source->snapshot(0, snapshot);
  auto late = ClientTimeline::create(server.session.streams[0].layout);
  ASSERT_TRUE(late);
  ASSERT_TRUE(late->load(snapshot, 5000));
  EXPECT_EQ(late->applied(), 77U);
  EXPECT_EQ(late->hash(), server.hashes.at(77));
  while (const auto made = source->next({}, outbox))
    ASSERT_TRUE(late->apply(made->frame, made->last_input, made->deltas[0].hash, made->deltas[0].payload));
  EXPECT_EQ(late->applied(), kFrames);
}

TEST_F(RecordedSourceTest, ASeekEndsItAndAnotherGoesOnThere) {
  open(0);
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(source->next({}, outbox));
  EXPECT_EQ(accept(transport::InputKind::kSeek, {130.5}), Reason::kNone);
  EXPECT_EQ(source->sought_s(), 130.5);
  EXPECT_FALSE(source->next({}, outbox));
  EXPECT_EQ(accept(transport::InputKind::kSeek, {3}), Reason::kRateLimited);
  open(*source->sought_s(), 5001);
  EXPECT_EQ(source->frame(), 132U);  // recorded at 131 s
  EXPECT_EQ(source->hash(0), server.hashes.at(132));
  EXPECT_EQ(play(), kFrames - 132);
}

TEST_F(RecordedSourceTest, SeeksAreLimitedOverAllEpochs) {
  open(0);
  EXPECT_EQ(accept(transport::InputKind::kSeek, {1e9}), Reason::kInvalid) << "and takes nothing";
  EXPECT_EQ(accept(transport::InputKind::kSeek, {50}), Reason::kNone);
  open(50, 5001);
  now_ns += kSecond * 9 / 10;
  EXPECT_EQ(accept(transport::InputKind::kSeek, {60}), Reason::kRateLimited);
  EXPECT_TRUE(source->next({}, outbox)) << "the run goes on";
  now_ns += kSecond / 5;
  EXPECT_EQ(accept(transport::InputKind::kSeek, {60}), Reason::kNone);
}

TEST_F(RecordedSourceTest, SeeksBackAsOftenAsOneLikes) {
  for (Epoch round = 0; round < 3; ++round) {
    open(0, 5000 + round);
    EXPECT_EQ(play(), kFrames);
  }
}

TEST_F(RecordedSourceTest, RefusesWhatIsNoSeekAndSeeksOutside) {
  open(0);
  EXPECT_EQ(accept(transport::InputKind::kGravity, {0, -1, 0}), Reason::kRecording);
  EXPECT_EQ(accept(transport::InputKind::kPush, {0, 0, 0, 1, 0, 0, 0}), Reason::kRecording);
  for (const std::vector<double>& values :
       {std::vector<double>{}, {-0.1}, {playback->length_s() + 0.1}, {1, 2}})
    EXPECT_EQ(accept(transport::InputKind::kSeek, values), Reason::kInvalid);
  EXPECT_FALSE(source->sought_s());
}

TEST_F(RecordedSourceTest, AFileCutShortEndsAtTheTear) {
  std::filesystem::resize_file(path, std::filesystem::file_size(path) - fixed_bytes);
  open(0);
  const Frame played = play();
  EXPECT_GT(played, 10U);
  EXPECT_LT(played, kFrames);
  ASSERT_TRUE(source->ending());
  EXPECT_EQ(*source->ending(), Step::kEnd);
}

TEST_F(RecordedSourceTest, AnnouncesWhereInTheRecordingItIs) {
  open(62);
  const std::string& text = source->session().scene_json;
  for (const char* told : {R"("dtS":1,)", R"("startedUnixMs":"1700000000000")", R"("lengthS":199)",
                           R"("fromS":62)", R"("fromFrame":"63")", R"("frameRateHz":1)"})
    EXPECT_NE(text.find(told), std::string::npos) << told << " is not in " << text;
}

}  // namespace
}  // namespace tandem::tool
