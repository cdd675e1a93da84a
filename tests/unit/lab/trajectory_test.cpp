#include "services/lab/trajectories/trajectory.hpp"

#include <gmock/gmock.h>
#include <sys/resource.h>

#include <csignal>
#include <filesystem>
#include <limits>

namespace tandem::lab::of_trajectory {
namespace {

using ::testing::HasSubstr;

constexpr std::uint32_t kBodies = 3;
constexpr std::uint64_t kFrames = 4;

class Trajectory : public ::testing::Test {
 protected:
  Trajectory() {
    directory_ =
        std::filesystem::path(::testing::TempDir()) /
        ("trajectory_" + std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
    std::filesystem::remove_all(directory_);
    std::filesystem::create_directories(directory_);
    npy_ = directory_ / "x.npy";
    json_ = directory_ / "x.json";
  }
  ~Trajectory() override { std::filesystem::remove_all(directory_); }

  static float value(std::uint64_t frame, std::size_t body, std::size_t channel) {
    return static_cast<float>(frame) + 0.25F * static_cast<float>(body) - 2.0F * static_cast<float>(channel);
  }
  static Result<void> append(TrajectoryWriter& writer, std::uint64_t frame, std::uint32_t bodies = kBodies) {
    std::array<std::vector<float>, 6> columns;
    for (std::size_t channel = 0; channel < 6; ++channel) {
      for (std::size_t body = 0; body < bodies; ++body)
        columns[channel].push_back(value(frame, body, channel));
    }
    const std::vector<std::uint8_t> alive(bodies, 1);
    const std::vector<std::uint16_t> type(bodies, 0);
    return writer.append(
        {{columns[0], columns[1], columns[2]}, {columns[3], columns[4], columns[5]}, alive, type});
  }
  static TrajectoryInfo info() {
    TrajectoryInfo info;
    info.dt_s = 1.0 / 30;
    info.damping_per_s = 0.1;
    info.radius = 0.5;
    info.threshold = 0.1;
    for (std::uint64_t f = 0; f <= kFrames; ++f) info.gravity.push_back({0, -9.81, static_cast<double>(f)});
    return info;
  }
  void write_pair() {
    auto writer = TrajectoryWriter::create(npy_, kBodies);
    ASSERT_TRUE(writer) << writer.error().message;
    for (std::uint64_t f = 0; f <= kFrames; ++f) ASSERT_TRUE(append(*writer, f));
    const auto finished = writer->finish(info());
    ASSERT_TRUE(finished) << finished.error().message;
  }
  void replace(const std::string& path, const std::string& from, const std::string& to) {
    std::ifstream in(path, std::ios::binary);
    std::string text((std::istreambuf_iterator<char>(in)), {});
    const auto at = text.find(from);
    ASSERT_NE(at, std::string::npos) << path;
    text.replace(at, from.size(), to);
    std::ofstream(path, std::ios::binary) << text;
  }
  /// The pair is refused with a message that names `path` and holds `expected`.
  void expect_refused(const std::string& path, const std::string& expected) {
    const auto opened = RecordedTrajectory::open(npy_);
    ASSERT_FALSE(opened);
    EXPECT_THAT(opened.error().message, HasSubstr(path));
    EXPECT_THAT(opened.error().message, HasSubstr(expected));
    EXPECT_THAT(opened.error().message, HasSubstr("expected"));
  }

  std::filesystem::path directory_;
  std::string npy_, json_;
};

TEST_F(Trajectory, reads_back_what_was_written) {
  write_pair();
  const auto opened = RecordedTrajectory::open(npy_);
  ASSERT_TRUE(opened) << opened.error().message;
  RecordedTrajectory& trajectory = **opened;
  EXPECT_EQ(trajectory.capacity(), kBodies);
  EXPECT_EQ(trajectory.frames(), kFrames);
  EXPECT_EQ(trajectory.dt_s(), 1.0 / 30);
  EXPECT_EQ(trajectory.damping_per_s(), 0.1);
  EXPECT_EQ(trajectory.info().threshold, 0.1);
  EXPECT_EQ(trajectory.info().radius, 0.5);
  EXPECT_EQ(trajectory.position_bound(), 4.5);
  for (std::uint64_t f = 0; f <= kFrames; ++f) {
    if (f > 0) {
      EXPECT_EQ(trajectory.gravity()[2], static_cast<double>(f)) << "the drive of the next step";
      trajectory.step();
    }
    const engine::Bodies bodies = trajectory.bodies();
    for (std::size_t body = 0; body < kBodies; ++body) {
      for (std::size_t channel = 0; channel < 3; ++channel) {
        EXPECT_EQ(bodies.position[channel][body], value(f, body, channel));
        EXPECT_EQ(bodies.velocity[channel][body], value(f, body, channel + 3));
      }
    }
  }
  EXPECT_THROW(trajectory.step(), std::runtime_error);
}

/// Two bodies that turn; `change` edits the second one's orientation (x, y, z, w) and angular velocity.
struct Turning {
  std::array<float, 4> orientation{0, 0.6F, 0, 0.8F};
  std::array<float, 3> angular_velocity{1, 2, 3};
};

Result<void> write_turning(const std::string& npy, TrajectoryInfo info, const Turning& turning) {
  auto writer = TrajectoryWriter::create(npy, 2, kRigidChannels);
  if (!writer) return tl::unexpected(writer.error());
  const std::vector<float> zero(2, 0);
  std::array<std::vector<float>, 4> q;
  std::array<std::vector<float>, 3> w;
  for (std::size_t i = 0; i < 4; ++i) q[i] = {i == 3 ? 1.0F : 0.0F, turning.orientation[i]};
  for (std::size_t i = 0; i < 3; ++i) w[i] = {0, turning.angular_velocity[i]};
  const std::vector<std::uint8_t> alive(2, 1);
  const std::vector<std::uint16_t> type(2, 0);
  for (int row = 0; row < 2; ++row) {
    auto appended = writer->append({.position = {zero, zero, zero},
                                    .velocity = {zero, zero, zero},
                                    .alive = alive,
                                    .type = type,
                                    .orientation = {q[0], q[1], q[2], q[3]},
                                    .angular_velocity = {w[0], w[1], w[2]}});
    if (!appended) return appended;
  }
  info.gravity.resize(2);
  return writer->finish(info);
}

TEST_F(Trajectory, reads_back_orientation_and_shapes) {
  TrajectoryInfo written = info();
  written.shapes = {{engine::Shape::Kind::kSphere, 0.5F, {}}, {engine::Shape::Kind::kBox, 0, {1, 2, 3}}};
  written.shape_of = {1, 0};
  ASSERT_TRUE(write_turning(npy_, written, {}));
  EXPECT_EQ(std::filesystem::file_size(npy_), 128U + 2 * 2 * 13 * 4);
  const auto opened = RecordedTrajectory::open(npy_);
  ASSERT_TRUE(opened) << opened.error().message;
  const engine::Bodies bodies = (*opened)->bodies();
  EXPECT_EQ(bodies.orientation[1][1], 0.6F);
  EXPECT_EQ(bodies.orientation[3][1], 0.8F);
  EXPECT_EQ(bodies.orientation[3][0], 1);
  EXPECT_EQ(bodies.angular_velocity[2][1], 3);
  EXPECT_EQ(bodies.type[0], 1);
  EXPECT_EQ((*opened)->info().shapes, written.shapes);
  EXPECT_EQ((*opened)->info().shape_of, written.shape_of);
}

TEST_F(Trajectory, six_columns_have_no_orientation) {
  write_pair();
  const auto opened = RecordedTrajectory::open(npy_);
  ASSERT_TRUE(opened);
  EXPECT_TRUE((*opened)->bodies().orientation[0].empty());
  EXPECT_TRUE((*opened)->bodies().angular_velocity[0].empty());
}

TEST_F(Trajectory, a_dead_body_is_written_as_not_turned) {
  auto writer = TrajectoryWriter::create(npy_, 1, kRigidChannels);
  ASSERT_TRUE(writer);
  const std::vector<float> nan{std::numeric_limits<float>::quiet_NaN()};
  const std::vector<std::uint8_t> alive{0};
  const std::vector<std::uint16_t> type{0};
  for (int row = 0; row < 2; ++row) {
    ASSERT_TRUE(writer->append({.position = {nan, nan, nan},
                                .velocity = {nan, nan, nan},
                                .alive = alive,
                                .type = type,
                                .orientation = {nan, nan, nan, nan},
                                .angular_velocity = {nan, nan, nan}}));
  }
  TrajectoryInfo two_rows = info();
  two_rows.gravity.resize(2);
  ASSERT_TRUE(writer->finish(two_rows));
  const auto opened = RecordedTrajectory::open(npy_);
  ASSERT_TRUE(opened) << opened.error().message;
  EXPECT_EQ((*opened)->bodies().orientation[3][0], 1);
}

TEST_F(Trajectory, refuses_what_is_no_turn) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const auto expect = [&](const Turning& turning, const std::string& expected) {
    ASSERT_TRUE(write_turning(npy_, info(), turning));
    expect_refused("x.npy", expected);
  };
  expect({.orientation = {0, 0, 0, 0}}, "frame 0, body 1: the quaternion's norm is 0");
  expect({.orientation = {0, 0, 0, 1.002F}}, "the quaternion's norm is 1.002");
  expect({.orientation = {0, nan, 0, 1}}, "body 1, channel 8 is not finite");
  expect({.angular_velocity = {0, nan, 0}}, "body 1, channel 11 is not finite");
  expect({.angular_velocity = {0, 61, 0}}, "body 1 turns by 2.033 rad a row");
  ASSERT_TRUE(
      write_turning(npy_, info(), {.orientation = {0, 0, 0, 1.0009F}, .angular_velocity = {0, 59.9F, 0}}));
  EXPECT_TRUE(RecordedTrajectory::open(npy_));
}

TEST_F(Trajectory, radii_may_be_a_list) {
  write_pair();
  replace(json_, "\"radius\":0.5", "\"radius\":[0.5,0.25,0.5]");
  const auto opened = RecordedTrajectory::open(npy_);
  ASSERT_TRUE(opened) << opened.error().message;
  EXPECT_EQ((*opened)->info().radius, 0.25);
  ASSERT_EQ((*opened)->info().shapes.size(), 2U);
  EXPECT_EQ((*opened)->info().shapes[1].radius, 0.25F);
  EXPECT_EQ((*opened)->bodies().type[1], 1);
  EXPECT_EQ((*opened)->bodies().type[2], 0);
}

TEST_F(Trajectory, refuses_radii_and_shapes_that_are_none) {
  for (const char* radius : {"[0.5,0.5]", "[0.5,0.5,0]", "[0.5,0.5,\"a\"]", "\"a\"", "0"}) {
    write_pair();
    replace(json_, "\"radius\":0.5", std::string("\"radius\":") + radius);
    expect_refused("x.json", "radius");
  }
  const std::string good = R"("shape_of":[0,0,0],)";
  for (const std::string& shapes :
       {std::string(R"("shapes":[],)") + good, R"("shapes":7,)" + good, R"("shapes":[7],)" + good,
        R"("shapes":[{"shape":"cone","values":[1]}],)" + good,
        R"("shapes":[{"shape":"box","values":[1,1]}],)" + good,
        R"("shapes":[{"shape":"box","values":["a",1,1]}],)" + good,
        R"("shapes":[{"shape":"hull","values":[1,1,1]}],)" + good,
        R"("shapes":[{"shape":"sphere","values":[]}],)" + good,
        R"("shapes":[{"shape":"sphere","values":[0]}],)" + good,
        std::string(R"("shapes":[{"shape":"sphere","values":[1]}],)"),
        std::string(R"("shapes":[{"shape":"sphere","values":[1]}],"shape_of":[0,0],)"),
        std::string(R"("shapes":[{"shape":"sphere","values":[1]}],"shape_of":[0,0,1],)"),
        std::string(R"("shapes":[{"shape":"sphere","values":[1]}],"shape_of":[0,0,-1],)")}) {
    write_pair();
    replace(json_, "\"gravity\"", shapes + "\"gravity\"");
    expect_refused("x.json", "shape");
  }
}

TEST_F(Trajectory, refuses_every_input) {
  write_pair();
  const auto opened = RecordedTrajectory::open(npy_);
  ASSERT_TRUE(opened);
  EXPECT_EQ((*opened)->classify({}).effect, engine::Classification::Effect::kRefused);
}

TEST_F(Trajectory, refuses_a_name_without_npy) {
  const auto writer = TrajectoryWriter::create(directory_ / "x.bin", kBodies);
  ASSERT_FALSE(writer);
  EXPECT_THAT(writer.error().message, HasSubstr(".npy"));
}

TEST_F(Trajectory, refuses_a_missing_file) {
  const auto opened = RecordedTrajectory::open(npy_);
  ASSERT_FALSE(opened);
  EXPECT_THAT(opened.error().message, HasSubstr("x.npy: cannot read"));
}

TEST_F(Trajectory, refuses_another_type) {
  write_pair();
  replace(npy_, "<f4", "<f8");
  expect_refused("x.npy", "the type is '<f8'");
}

TEST_F(Trajectory, refuses_another_shape) {
  write_pair();
  replace(npy_, "(5, 3, 6)", "(5, 9, 2)");
  expect_refused("x.npy", "the shape is (5, 9, 2)");
}

TEST_F(Trajectory, refuses_fortran_order) {
  write_pair();
  replace(npy_, "False", "True ");
  expect_refused("x.npy", "Fortran");
}

TEST_F(Trajectory, refuses_a_file_that_is_cut_off) {
  write_pair();
  std::filesystem::resize_file(npy_, std::filesystem::file_size(npy_) - 1);
  expect_refused("x.npy", "bytes of data");
}

TEST_F(Trajectory, refuses_what_is_no_npy_file) {
  write_pair();
  std::ofstream(npy_, std::ios::binary) << "hello";
  expect_refused("x.npy", "not a .npy file");
}

TEST_F(Trajectory, refuses_a_header_that_never_ends) {
  write_pair();
  std::string header = "{'descr': '" + std::string(64'000, '<');
  const std::string length{static_cast<char>(header.size() & 0xffU), static_cast<char>(header.size() >> 8U)};
  std::ofstream(npy_, std::ios::binary) << std::string("\x93NUMPY\x01\x00", 8) << length << header;
  expect_refused(npy_, "too long");
}

TEST_F(Trajectory, refuses_nan_and_names_its_place) {
  auto writer = TrajectoryWriter::create(npy_, 1);
  ASSERT_TRUE(writer);
  const std::vector<float> zero{0}, nan{std::numeric_limits<float>::quiet_NaN()};
  const std::vector<std::uint8_t> alive{1};
  const std::vector<std::uint16_t> type{0};
  ASSERT_TRUE(writer->append({{zero, zero, zero}, {zero, zero, zero}, alive, type}));
  ASSERT_TRUE(writer->append({{zero, nan, zero}, {zero, zero, zero}, alive, type}));
  TrajectoryInfo two_rows = info();
  two_rows.gravity.resize(2);
  ASSERT_TRUE(writer->finish(two_rows));
  expect_refused("x.npy", "frame 1, body 0, channel 1 is not finite");
}

TEST_F(Trajectory, refuses_a_missing_or_broken_sidecar) {
  write_pair();
  replace(json_, "\"dt_s\"", "\"dt_x\"");
  expect_refused("x.json", "\"dt_s\"");
  std::ofstream(json_) << "[";
  expect_refused("x.json", "one JSON object");
  std::filesystem::remove(json_);
  expect_refused("x.json", "cannot read");
}

TEST_F(Trajectory, refuses_values_out_of_range_and_missing_gravity_rows) {
  write_pair();
  replace(json_, "\"threshold\":0.1", "\"threshold\":0.0");
  expect_refused("x.json", "\"threshold\" is 0");
  write_pair();
  replace(json_, "[0.0,-9.81,4.0]", "[0.0,-9.81]");
  expect_refused("x.json", "\"gravity\" entry 4");
  write_pair();
  replace(json_, ",[0.0,-9.81,4.0]", "");
  expect_refused("x.json", "each of the 5 rows");
}

TEST_F(Trajectory, finds_its_scene_by_name_and_by_path_from_its_own_folder) {
  const auto scene_of = [&](const std::string& written) {
    write_pair();
    replace(json_, "\"gravity\"", "\"scene\":\"" + written + "\",\"gravity\"");
    const auto opened = RecordedTrajectory::open(npy_);
    return opened ? (*opened)->info().scene : opened.error().message;
  };
  EXPECT_EQ(scene_of("half_pipe"), "half_pipe");
  EXPECT_EQ(scene_of("pile.textproto"), (directory_ / "pile.textproto").string());
  EXPECT_EQ(scene_of("../pile.textproto"), (directory_ / "../pile.textproto").string());
  EXPECT_EQ(scene_of("/pile.textproto"), "/pile.textproto");
}

TEST_F(Trajectory, refuses_a_scene_that_is_no_text) {
  write_pair();
  replace(json_, "\"gravity\"", "\"scene\":[1],\"gravity\"");
  expect_refused("x.json", "\"scene\" is [1]");
  write_pair();
  replace(json_, "\"gravity\"", "\"scene\":\"\",\"gravity\"");
  expect_refused("x.json", "\"scene\" is \"\"");
}

TEST_F(Trajectory, leaves_nothing_behind_without_finish) {
  {
    auto writer = TrajectoryWriter::create(npy_, kBodies);
    ASSERT_TRUE(writer);
    ASSERT_TRUE(append(*writer, 0));
  }
  EXPECT_TRUE(std::filesystem::is_empty(directory_));
}

TEST_F(Trajectory, a_full_disk_is_an_error_and_leaves_nothing_behind) {
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{4096, before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  bool failed = false;
  std::string message;
  {
    constexpr std::uint32_t many = 100;
    auto writer = TrajectoryWriter::create(npy_, many);
    for (std::uint64_t f = 0; writer && !failed && f <= kFrames; ++f) {
      const auto appended = append(*writer, f, many);
      failed = !appended;
      if (failed) message = appended.error().message;
    }
    if (writer && !failed) {
      const auto finished = writer->finish(info());
      failed = !finished;
      if (failed) message = finished.error().message;
    }
  }
  ::setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, old_handler);
  EXPECT_TRUE(failed);
  EXPECT_THAT(message, HasSubstr("x.npy: cannot write"));
  EXPECT_TRUE(std::filesystem::is_empty(directory_));
}

}  // namespace
}  // namespace tandem::lab::of_trajectory
