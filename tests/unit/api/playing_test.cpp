// A session that plays, as C sees it.
#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "tests/support/playground/playground.hpp"

namespace tandem::api {
namespace {

constexpr std::uint32_t kBodies = Playground::kBodies;

class Playing : public ::testing::Test {
 protected:
  Playing() : client(playground.join()) {
    EXPECT_EQ(tandem_wait_until_playing(client, 10), TANDEM_OK) << tandem_error_text();
  }
  ~Playing() override { EXPECT_EQ(tandem_leave(client), TANDEM_OK); }
  Playing(const Playing&) = delete;
  Playing& operator=(const Playing&) = delete;
  Playing(Playing&&) = delete;
  Playing& operator=(Playing&&) = delete;

  void run(double seconds) {
    for (const std::int64_t end_ns = Playground::now().steady_ns + static_cast<std::int64_t>(seconds * 1e9);
         Playground::now().steady_ns < end_ns;) {
      ASSERT_EQ(tandem_update(client, 0.01), TANDEM_OK) << tandem_error_text();
    }
  }
  [[nodiscard]] tandem_status status() const {
    tandem_status status = TANDEM_STATUS_INIT;
    EXPECT_EQ(tandem_get_status(client, &status), TANDEM_OK);
    return status;
  }

  Playground playground;
  tandem_client client;
};

TEST_F(Playing, StatusTellsWhatGoesOn) {
  run(2);
  const tandem_status now = status();
  EXPECT_EQ(now.phase, TANDEM_PLAYING);
  EXPECT_EQ(now.role, TANDEM_PARTICIPANT);
  EXPECT_EQ(now.server_alive, 1U);
  EXPECT_STREQ(now.scene, "playground");
  EXPECT_EQ(now.frame_rate_hz, 30);
  EXPECT_GT(now.frames_applied, 40U);
  EXPECT_EQ(now.hash_mismatches, 0U);
  EXPECT_NE(now.client_id, 0U);
}

struct Body {
  std::array<float, 3> position;
  std::uint8_t alive;
  std::array<float, 3> velocity;
  std::uint16_t type;
  std::uint8_t change;
};

TEST_F(Playing, ASampleGoesIntoArraysOfStructs) {
  run(1);
  std::vector<float> packed(3 * kBodies);
  std::vector<Body> bodies(kBodies);
  tandem_columns columns = TANDEM_COLUMNS_INIT;
  columns.capacity = kBodies;
  columns.positions = packed.data();
  tandem_sample_options options = TANDEM_SAMPLE_OPTIONS_INIT;
  options.mode = TANDEM_INTERPOLATE;
  ASSERT_EQ(tandem_sample(client, &options, &columns, nullptr), TANDEM_OK);
  columns.positions = bodies[0].position.data();
  columns.position_stride = sizeof(Body);
  columns.alive = &bodies[0].alive;
  columns.alive_stride = sizeof(Body);
  columns.types = &bodies[0].type;
  columns.type_stride = sizeof(Body);
  tandem_frame frame = TANDEM_FRAME_INIT;
  ASSERT_EQ(tandem_sample(client, &options, &columns, &frame), TANDEM_OK);
  EXPECT_EQ(frame.capacity, kBodies);
  EXPECT_EQ(frame.alive, kBodies);
  EXPECT_EQ(frame.has_orientations, 0U);
  EXPECT_EQ(frame.phase, TANDEM_PLAYING);
  EXPECT_GT(frame.frame, 1);
  for (std::uint32_t i = 0; i < kBodies; ++i) {
    EXPECT_EQ(std::memcmp(bodies[i].position.data(), &packed[std::size_t{3} * i], 12), 0) << i;
    EXPECT_EQ(bodies[i].alive, 1);
  }
}

TEST_F(Playing, BodiesAreNewInTheFirstSampleAlone) {
  std::array<std::uint8_t, kBodies> changes{};
  tandem_columns columns = TANDEM_COLUMNS_INIT;
  columns.changes = changes.data();
  tandem_frame frame = TANDEM_FRAME_INIT;
  ASSERT_EQ(tandem_sample(client, nullptr, &columns, &frame),
            TANDEM_CAPACITY);  // asks how much room it needs
  ASSERT_EQ(frame.capacity, kBodies);
  columns.capacity = frame.capacity;
  ASSERT_EQ(tandem_sample(client, nullptr, &columns, nullptr), TANDEM_OK);
  EXPECT_EQ(changes.front(), TANDEM_CHANGE_NEW);
  ASSERT_EQ(tandem_sample(client, nullptr, &columns, nullptr), TANDEM_OK);
  EXPECT_EQ(changes.front(), TANDEM_CHANGE_NONE);
}

TEST_F(Playing, VelocitiesAreThoseOfTheBodies) {
  run(1);
  std::vector<float> velocities(3 * kBodies), before(3 * kBodies), after(3 * kBodies);
  tandem_columns columns = TANDEM_COLUMNS_INIT;
  columns.capacity = kBodies;
  tandem_sample_options options = TANDEM_SAMPLE_OPTIONS_INIT;
  options.mode = TANDEM_INTERPOLATE;
  constexpr std::int64_t kStepNs = 1'000'000;
  options.at_ns = Playground::now().steady_ns;
  columns.positions = before.data();
  columns.velocities = velocities.data();
  tandem_frame first = TANDEM_FRAME_INIT, second = TANDEM_FRAME_INIT;
  ASSERT_EQ(tandem_sample(client, &options, &columns, &first), TANDEM_OK);
  options.at_ns += kStepNs;
  columns.positions = after.data();
  ASSERT_EQ(tandem_sample(client, &options, &columns, &second), TANDEM_OK);
  const double seconds = (second.frame - first.frame) / 30;
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_NEAR(after[i] - before[i], velocities[i] * seconds, 1e-4) << i;
  }
}

TEST_F(Playing, CorrectionsMayBeShownAsTheyAre) {
  run(1);
  std::vector<float> first(3 * kBodies), second(3 * kBodies);
  tandem_columns columns = TANDEM_COLUMNS_INIT;
  columns.capacity = kBodies;
  tandem_sample_options options = TANDEM_SAMPLE_OPTIONS_INIT;
  options.smoothing_s = 0;
  for (auto* positions : {&first, &second}) {
    columns.positions = positions->data();
    ASSERT_EQ(tandem_sample(client, &options, &columns, nullptr), TANDEM_OK);
  }
  EXPECT_EQ(first, second) << "at one moment without an offset";
}

TEST_F(Playing, ColumnsThatAreTooShortStayAsTheyAre) {
  std::vector<float> positions(3 * kBodies, 42.0F);
  tandem_columns columns = TANDEM_COLUMNS_INIT;
  columns.capacity = kBodies - 1;
  columns.positions = positions.data();
  tandem_frame frame = TANDEM_FRAME_INIT;
  EXPECT_EQ(tandem_sample(client, nullptr, &columns, &frame), TANDEM_CAPACITY);
  EXPECT_EQ(frame.capacity, kBodies);
  EXPECT_EQ(positions, std::vector<float>(3 * kBodies, 42.0F));
}

TEST_F(Playing, StridesThatAreTooShortAreRefused) {
  std::array<float, 4 * kBodies> values{};
  const auto refused = [&](auto&& set) {
    tandem_columns columns = TANDEM_COLUMNS_INIT;
    columns.capacity = kBodies;
    columns.positions = columns.velocities = columns.orientations = values.data();
    set(columns);
    return tandem_sample(client, nullptr, &columns, nullptr) == TANDEM_INVALID_ARGUMENT;
  };
  EXPECT_TRUE(refused([](auto& c) { c.position_stride = 11; }));
  EXPECT_TRUE(refused([](auto& c) { c.velocity_stride = 1; }));
  EXPECT_TRUE(refused([](auto& c) { c.orientation_stride = 15; }));
  EXPECT_TRUE(refused([](auto& c) { c.angular_velocity_stride = 8; }));
  EXPECT_TRUE(refused([](auto& c) { c.type_stride = 1; }));
}

TEST_F(Playing, AMomentFarAwayGivesTheNearestOne) {
  run(1);
  const auto held = static_cast<double>(status().frame);
  for (const std::int64_t at_ns :
       {std::numeric_limits<std::int64_t>::min(), std::int64_t{1}, std::numeric_limits<std::int64_t>::max(),
        Playground::now().steady_ns + 3'600'000'000'000}) {
    for (const tandem_sample_mode mode : {TANDEM_INTERPOLATE, TANDEM_EXTRAPOLATE}) {
      tandem_sample_options options = TANDEM_SAMPLE_OPTIONS_INIT;
      options.at_ns = at_ns;
      options.mode = mode;
      std::vector<float> positions(3 * kBodies);
      tandem_columns columns = TANDEM_COLUMNS_INIT;
      columns.capacity = kBodies;
      columns.positions = positions.data();
      tandem_frame frame = TANDEM_FRAME_INIT;
      ASSERT_EQ(tandem_sample(client, &options, &columns, &frame), TANDEM_OK) << at_ns;
      EXPECT_GE(frame.frame, held - 2);
      EXPECT_LE(frame.frame, held + 30);
      for (const float p : positions) EXPECT_LT(std::abs(p), 10) << at_ns;
    }
  }
}

TEST_F(Playing, TheSceneIsToldInStructs) {
  tandem_scene scene = TANDEM_SCENE_INIT;
  ASSERT_EQ(tandem_get_scene(client, &scene), TANDEM_OK) << tandem_error_text();
  EXPECT_STREQ(scene.name, "playground");
  EXPECT_EQ(scene.capacity, kBodies);
  EXPECT_EQ(scene.type_count, 1U);
  EXPECT_EQ(scene.solid_count, 2U);
  EXPECT_EQ(scene.gravity[1], -5);
  EXPECT_EQ(scene.max_gravity, 50);
  EXPECT_EQ(scene.low[0], -2);
  EXPECT_EQ(scene.high[2], 2);
  EXPECT_EQ(scene.dt_s, 1.0 / 30);
  EXPECT_EQ(scene.up_axis, 2U);
  EXPECT_EQ(scene.continues_epoch, 900U);
  EXPECT_EQ(scene.continues_frame, 77U);
  std::array<tandem_solid, 3> solids{{TANDEM_SOLID_INIT}};
  std::size_t count = 0;
  ASSERT_EQ(tandem_get_geometry(client, solids.data(), solids.size(), &count), TANDEM_OK);
  ASSERT_EQ(count, 2U);
  EXPECT_EQ(solids[0].shape, TANDEM_SHAPE_PLANE);
  EXPECT_EQ(solids[0].normal[1], 1);
  EXPECT_EQ(solids[1].shape, TANDEM_SHAPE_SPHERE);
  EXPECT_EQ(solids[1].centre[0], 1);
  EXPECT_EQ(solids[1].radius, 0.5F);
  EXPECT_EQ(solids[1].orientation[3], 1);
  EXPECT_EQ(tandem_get_geometry(client, solids.data(), 1, &count), TANDEM_CAPACITY);
  EXPECT_EQ(count, 2U);
  EXPECT_EQ(tandem_get_geometry(client, nullptr, 0, &count), TANDEM_OK);
}

TEST_F(Playing, ABodyIsCalledAsTheSimulationSays) {
  const auto name = [&](std::uint32_t slot, std::size_t size = TANDEM_BODY_NAME_SIZE) {
    std::array<char, TANDEM_BODY_NAME_SIZE> text{};
    text.fill('x');
    EXPECT_EQ(tandem_get_body_name(client, slot, text.data(), size), TANDEM_OK) << tandem_error_text();
    return std::string(text.data());
  };
  EXPECT_EQ(name(3), "") << "it has none yet";
  playground.name({{5, "J\xC3\xBCrgen"}, {3, "crane"}});
  run(1);
  EXPECT_EQ(name(3), "crane");
  EXPECT_EQ(name(5), "J\xC3\xBCrgen");
  EXPECT_EQ(name(5, 3), "J") << "cut at the end of a character";
  EXPECT_EQ(name(4), "");
  playground.name({{3, "hook"}});
  run(2);
  EXPECT_EQ(name(3), "hook");
  EXPECT_EQ(name(5), "");
  EXPECT_EQ(status().resyncs, 0U) << "other names are no reason to join again";
  std::array<char, 8> text{};
  EXPECT_EQ(tandem_get_body_name(client, kBodies, text.data(), text.size()), TANDEM_INVALID_ARGUMENT);
  EXPECT_EQ(tandem_get_body_name(client, 0, nullptr, 8), TANDEM_INVALID_ARGUMENT);
  EXPECT_EQ(tandem_get_body_name(client, 0, text.data(), 0), TANDEM_INVALID_ARGUMENT);
}

TEST_F(Playing, ABodyWithoutASessionHasNoName) {
  playground.stop_server();
  const tandem_client searching = playground.join();
  std::array<char, 8> text{};
  EXPECT_EQ(tandem_get_body_name(searching, 0, text.data(), text.size()), TANDEM_NOT_READY);
  EXPECT_EQ(tandem_leave(searching), TANDEM_OK);
}

TEST_F(Playing, TypesTellWhatBodiesLookLike) {
  tandem_body_type type = TANDEM_BODY_TYPE_INIT;
  ASSERT_EQ(tandem_get_type(client, 0, &type), TANDEM_OK);
  EXPECT_STREQ(type.name, "plank");
  EXPECT_EQ(type.shape, TANDEM_SHAPE_BOX);
  EXPECT_EQ(type.radius, 0.1F);
  EXPECT_EQ(type.value_count, 3U);
  EXPECT_EQ(type.values[1], 2);
  std::array<float, 3> values{};
  std::size_t count = 0;
  EXPECT_EQ(tandem_get_type_values(client, 0, values.data(), 2, &count), TANDEM_CAPACITY);
  EXPECT_EQ(count, 3U);
  EXPECT_EQ(values[2], 0);
  EXPECT_EQ(tandem_get_type_values(client, 0, values.data(), 3, &count), TANDEM_OK);
  EXPECT_EQ(values[2], 0.5F);
  EXPECT_EQ(tandem_get_type(client, 1, &type), TANDEM_INVALID_ARGUMENT);
  EXPECT_EQ(tandem_get_type(client, UINT32_MAX, &type), TANDEM_INVALID_ARGUMENT);
}

}  // namespace
}  // namespace tandem::api
