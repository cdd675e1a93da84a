#include "services/lab/trajectory.hpp"

#include <gmock/gmock.h>
#include <sys/resource.h>

#include <csignal>
#include <filesystem>
#include <limits>

namespace tandem::lab {
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
    TrajectoryInfo info{1.0 / 30, 0.1, 0.5, 0.1, {}, {}};
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

TEST_F(Trajectory, refuses_every_input) {
  write_pair();
  const auto opened = RecordedTrajectory::open(npy_);
  ASSERT_TRUE(opened);
  EXPECT_EQ((*opened)->classify({}).effect, engine::Classification::Effect::kRefused);
}

TEST_F(Trajectory, goes_back_to_a_saved_row) {
  write_pair();
  const auto opened = RecordedTrajectory::open(npy_);
  ASSERT_TRUE(opened);
  (*opened)->step();
  std::vector<std::byte> saved;
  (*opened)->save(saved);
  (*opened)->step();
  EXPECT_TRUE((*opened)->load(saved));
  EXPECT_EQ((*opened)->bodies().position[0][0], 1.0F);
  saved.pop_back();
  EXPECT_FALSE((*opened)->load(saved));
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
}  // namespace tandem::lab
