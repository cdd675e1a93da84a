#include "services/lab/trajectories/export_recording.hpp"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include "services/engines/scenes/scene.hpp"
#include "services/follow/recording/playback.hpp"
#include "services/follow/recording/recorder.hpp"
#include "services/lab/trajectories/trajectory.hpp"
#include "tests/support/client/fake_server.hpp"

namespace tandem::lab::of_export_recording {
namespace {

using client::FakeServer;
using ::testing::HasSubstr;

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::uint32_t kBodies = 12;
constexpr int kFrames = 8;

class ExportRecording : public ::testing::Test {
 protected:
  ExportRecording() {
    folder_ = std::filesystem::path(::testing::TempDir()) /
              ("export_" + std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  ~ExportRecording() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] std::string path(const char* name) const { return folder_ / name; }

  /// Makes the recording of a client over `frames` frames; gravity changes on the way.
  void record(FakeServer& server, int frames = kFrames) {
    auto recorder = recording::Recorder::create(path("x.mcap"), recording::Compression::kZstd);
    ASSERT_TRUE(recorder);
    recorder->add(server.session, {wall_ns_, wall_ns_});
    recorder->add(server.snapshot(), {wall_ns_, wall_ns_});
    record_frames(server, *recorder, frames);
    ASSERT_TRUE(recorder->finish());
    fixed_bytes_ = recorder->totals().fixed_bytes;
  }
  void record_frames(FakeServer& server, recording::Recorder& recorder, int frames) {
    for (int i = 0; i < frames; ++i) {
      if (i == 2) recorder.add(server.schedule(-4000), {wall_ns_, wall_ns_});
      const transport::DeltaMessage delta = server.advance(wall_ns_);
      recorder.add(server.session.epoch,
                   {.frame = delta.frame,
                    .last_input = delta.last_input,
                    .server_time_ns = delta.server_time_ns,
                    .hash = delta.hash,
                    .payload = delta.payload},
                   {wall_ns_, wall_ns_});
      wall_ns_ += kSecond / 30;
    }
  }
  /// Every value of the trajectory is that of the agreed state, in scene units.
  void expect_agreed(double dt_s) const {
    const auto exported = RecordedTrajectory::open(path("y.npy"));
    ASSERT_TRUE(exported) << exported.error().message;
    RecordedTrajectory& trajectory = **exported;
    const auto playback = recording::Playback::open(path("x.mcap"));
    ASSERT_TRUE(playback);
    for (std::uint64_t row = 0;; ++row) {
      ASSERT_TRUE((*playback)->next());
      const ClientTimeline& timeline = (*playback)->timeline();
      expect_row(trajectory.bodies(), timeline.state(timeline.applied()), dt_s);
      const double g = timeline.drive().gravity[1] / 64.0 * kUnit / (dt_s * dt_s);
      EXPECT_DOUBLE_EQ(trajectory.info().gravity[row][1], g);
      if (row == trajectory.frames()) break;
      trajectory.step();
    }
  }
  static void expect_row(const engine::Bodies& bodies, const State& state, double dt_s) {
    for (Slot slot = 0; slot < state.capacity(); ++slot) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        ASSERT_FLOAT_EQ(bodies.position[axis][slot], static_cast<float>(state.p(axis)[slot] * kUnit));
        ASSERT_FLOAT_EQ(bodies.velocity[axis][slot],
                        static_cast<float>(state.v(axis)[slot] / 64.0 * kUnit / dt_s));
        if (!state.groups().orientation) continue;
        ASSERT_FLOAT_EQ(bodies.orientation[axis][slot],
                        static_cast<float>(state.q(axis)[slot] / double{kQuaternionOne}));
        ASSERT_FLOAT_EQ(bodies.angular_velocity[axis][slot],
                        static_cast<float>(state.w(axis)[slot] / 268435456.0 / dt_s));
      }
    }
  }

  static constexpr double kUnit = 0.001;  // of FakeServer
  std::filesystem::path folder_;
  std::uint64_t fixed_bytes_ = 0;  // of the last recording
  std::int64_t wall_ns_ = 1'700'000'000 * kSecond;
};

TEST_F(ExportRecording, TheStatesAreATrajectoryInSceneUnits) {
  FakeServer server(1000, kBodies);
  record(server);
  const auto exported = export_states(path("x.mcap"), path("y.npy"));
  ASSERT_TRUE(exported) << exported.error().message;
  expect_agreed(1.0 / 30);
  const auto trajectory = RecordedTrajectory::open(path("y.npy"));
  ASSERT_TRUE(trajectory);
  EXPECT_EQ((*trajectory)->frames(), static_cast<std::uint64_t>(kFrames));
  EXPECT_EQ((*trajectory)->capacity(), kBodies);
  const TrajectoryInfo& info = (*trajectory)->info();
  EXPECT_DOUBLE_EQ(info.dt_s, 1.0 / 30);
  EXPECT_DOUBLE_EQ(info.threshold, 50 * kUnit);
  EXPECT_FLOAT_EQ(static_cast<float>(info.radius), 0.1F);
  EXPECT_DOUBLE_EQ(info.damping_per_s, 300 / 65536.0 * 30);
  EXPECT_TRUE(info.scene.empty());
  EXPECT_NE(info.gravity.front(), info.gravity.back());
}

TEST_F(ExportRecording, BodiesThatTurnHaveThirteenColumnsAndShapes) {
  FakeServer server(1000, kBodies, 1, {.orientation = true});
  record(server);
  const auto exported = export_states(path("x.mcap"), path("y.npy"));
  ASSERT_TRUE(exported) << exported.error().message;
  expect_agreed(1.0 / 30);
  const auto trajectory = RecordedTrajectory::open(path("y.npy"));
  ASSERT_TRUE(trajectory);
  ASSERT_EQ((*trajectory)->info().shapes.size(), 1U);
  EXPECT_EQ((*trajectory)->info().shapes[0], (engine::Shape{engine::Shape::Kind::kSphere, 0.1F, {}}));
}

// A server may run a scene faster than its own time.
TEST_F(ExportRecording, TheRecordedSceneTellsTheTimeStepAndIsWrittenBeside) {
  FakeServer server(1000, kBodies);
  const auto scene = scenes::load_scene("cube");
  ASSERT_TRUE(scene);
  server.session.scene_json = scene->json;
  server.session.frame_rate_hz = 120;
  record(server);
  ASSERT_TRUE(export_states(path("x.mcap"), path("y.npy")));
  expect_agreed(scene->dt_s);
  const auto trajectory = RecordedTrajectory::open(path("y.npy"));
  ASSERT_TRUE(trajectory);
  EXPECT_EQ((*trajectory)->info().scene, path("y.scene.textproto"));
  EXPECT_EQ((*trajectory)->info().dt_s, scene->dt_s);
  EXPECT_EQ((*trajectory)->info().radius, scene->smallest_radius_m);
  const auto written = scenes::load_scene(path("y.scene.textproto"));
  ASSERT_TRUE(written) << written.error().message;
  EXPECT_EQ(written->text, scene->text);
}

TEST_F(ExportRecording, ASceneOfAnotherProgramIsNotNamed) {
  FakeServer server(1000, kBodies);
  server.session.scene_json = R"({"walls":4})";
  record(server);
  ASSERT_TRUE(export_states(path("x.mcap"), path("y.npy")));
  EXPECT_FALSE(std::filesystem::exists(path("y.scene.textproto")));
  const auto trajectory = RecordedTrajectory::open(path("y.npy"));
  ASSERT_TRUE(trajectory);
  EXPECT_TRUE((*trajectory)->info().scene.empty());
}

TEST_F(ExportRecording, TheStatesEndAtTheFirstGapAndThatIsTold) {
  FakeServer server(1000, kBodies);
  auto recorder = recording::Recorder::create(path("x.mcap"), recording::Compression::kNone);
  ASSERT_TRUE(recorder);
  recorder->add(server.session, {wall_ns_, wall_ns_});
  recorder->add(server.snapshot(), {wall_ns_, wall_ns_});
  record_frames(server, *recorder, 2);
  server.advance();
  recorder->add(server.snapshot(), {wall_ns_, wall_ns_});
  record_frames(server, *recorder, 5);
  ASSERT_TRUE(recorder->finish());
  ::testing::internal::CaptureStderr();
  ASSERT_TRUE(export_states(path("x.mcap"), path("y.npy")));
  EXPECT_THAT(::testing::internal::GetCapturedStderr(), HasSubstr("x.mcap has a gap"));
  const auto trajectory = RecordedTrajectory::open(path("y.npy"));
  ASSERT_TRUE(trajectory);
  EXPECT_EQ((*trajectory)->frames(), 2U);
}

TEST_F(ExportRecording, AFileCutShortIsExportedUpToTheTear) {
  FakeServer server(1000, kBodies);
  record(server, 200);
  // The types and summary, and some of the last chunk.
  std::filesystem::resize_file(path("x.mcap"), std::filesystem::file_size(path("x.mcap")) - fixed_bytes_);
  ::testing::internal::CaptureStderr();
  ASSERT_TRUE(export_states(path("x.mcap"), path("y.npy")));
  EXPECT_THAT(::testing::internal::GetCapturedStderr(), HasSubstr("cut short at byte"));
  const auto trajectory = RecordedTrajectory::open(path("y.npy"));
  ASSERT_TRUE(trajectory);
  EXPECT_GT((*trajectory)->frames(), 10U);
  EXPECT_LT((*trajectory)->frames(), 200U);
}

TEST_F(ExportRecording, TheRecordingItselfIsNotWrittenOver) {
  FakeServer server(1000, kBodies);
  record(server);
  std::filesystem::rename(path("x.mcap"), path("x.npy"));
  for (const auto& exported :
       {export_points(path("x.npy"), path("x.npy"), 1), export_states(path("x.npy"), path("x.npy"))}) {
    ASSERT_FALSE(exported);
    EXPECT_EQ(exported.error().code, ErrorCode::kInvalidArgument);
  }
  std::filesystem::rename(path("x.npy"), path("y.mcap.part"));
  EXPECT_FALSE(export_points(path("y.mcap.part"), path("y.mcap"), 1));
  EXPECT_TRUE(recording::Playback::open(path("y.mcap.part")));
}

TEST_F(ExportRecording, WhatCannotBeExportedIsRefusedInALineThatNamesIt) {
  const auto message = [this](const char* out) {
    const auto exported = export_states(path("x.mcap"), path(out));
    return exported ? std::string() : exported.error().message;
  };
  EXPECT_THAT(message("y.npy"), HasSubstr("x.mcap: cannot read"));
  std::ofstream(path("x.mcap")) << "no recording";
  EXPECT_THAT(message("y.npy"), HasSubstr("x.mcap: not an MCAP file"));
  std::filesystem::remove(path("x.mcap"));
  FakeServer server(1000, kBodies);
  record(server, 0);
  EXPECT_THAT(message("y.npy"), HasSubstr("x.mcap: no frame follows"));
  EXPECT_THAT(message("y.txt"), HasSubstr("ends in .npy"));
  EXPECT_FALSE(std::filesystem::exists(path("y.npy")));
}

TEST_F(ExportRecording, PointCloudsAreOfEveryNthFrameAndKeepTheirTimes) {
  FakeServer server(1000, kBodies);
  record(server);
  const auto clouds = [this](std::uint32_t every) {
    EXPECT_TRUE(export_points(path("x.mcap"), path("p.mcap"), every));
    std::ifstream in(path("p.mcap"), std::ios::binary);
    const std::string text((std::istreambuf_iterator<char>(in)), {});
    auto reader = recording::McapReader::open(std::as_bytes(std::span(text)));
    EXPECT_TRUE(reader);
    std::vector<std::uint64_t> times;
    recording::McapMessage cloud;
    while (*reader->next(cloud)) {
      EXPECT_EQ(cloud.topic, "/bodies");
      EXPECT_EQ(cloud.encoding, "json");
      times.push_back((cloud.log_time_ns - 1'700'000'000ULL * kSecond) / 1'000'000);
    }
    return times;
  };
  EXPECT_EQ(clouds(1).size(), kFrames + 1U);
  EXPECT_EQ(clouds(3), (std::vector<std::uint64_t>{0, 66, 166}));  // frames 0, 3, 6
}

}  // namespace
}  // namespace tandem::lab::of_export_recording
