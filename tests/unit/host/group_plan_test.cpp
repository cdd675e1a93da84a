// Tests which sessions have orientations.
#include "sdk/core/tables/codec_table.hpp"
#include "services/host/streams/groups.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "services/engines/sessions/session_plan.hpp"

namespace tandem::sessions {
namespace {

constexpr CodecTraits kCodesTurns{.turns = true};
constexpr host::Lattice kLattice{.unit = 0.001, .dt_s = 1.0 / 60};
const std::vector<std::string> kBoth{kPositionGroup, kOrientationGroup};

const std::vector<host::BodySize> kSizes{{"rock", 0.5}, {"pebble", 0.0101}};

TEST(GroupPlan, BodiesThatTurnHaveOrientationsAndRadiiRoundedUp) {
  Layout layout;
  ASSERT_TRUE(host::choose_groups(true, kSizes, kLattice, kCodesTurns, layout));
  EXPECT_EQ(layout.groups, kBoth);
  EXPECT_EQ(layout.radii, (std::vector<std::int32_t>{500, 11}));
}

TEST(GroupPlan, WithACodecThatCodesNoneTheyArePoints) {
  Layout layout;
  ASSERT_TRUE(host::choose_groups(true, kSizes, kLattice, CodecTraits{}, layout));
  EXPECT_EQ(layout.groups, Layout{}.groups);
  EXPECT_TRUE(layout.radii.empty());
}

TEST(GroupPlan, BodiesThatDoNotTurnArePointsWithAnyCodec) {
  Layout layout;
  ASSERT_TRUE(host::choose_groups(false, std::vector<host::BodySize>(2), kLattice, kCodesTurns, layout));
  EXPECT_EQ(layout.groups, Layout{}.groups);
  EXPECT_TRUE(layout.radii.empty());
}

TEST(GroupPlan, ATypeWithoutARadiusOrOneBeyondTheLatticeIsNamed) {
  for (const double radius : {0.0, -1.0, 1.1e6, std::numeric_limits<double>::quiet_NaN()}) {
    std::vector<host::BodySize> sizes = kSizes;
    sizes[1].radius = radius;
    Layout layout;
    const auto chosen = host::choose_groups(true, sizes, kLattice, kCodesTurns, layout);
    ASSERT_FALSE(chosen) << radius;
    EXPECT_EQ(chosen.error().code, ErrorCode::kInvalidArgument);
    EXPECT_NE(chosen.error().message.find("pebble"), std::string::npos);
  }
}

TEST(GroupPlan, ScenesOfRigidBodiesTurnAndThoseOfParticlesDoNot) {
  EXPECT_TRUE(scenes::load_scene("towers").value().turns);
  EXPECT_FALSE(scenes::load_scene("half_pipe").value().turns);
}

TEST(GroupPlan, AStreamHasWhatItsCodecCodes) {
  const auto scene = scenes::load_scene("mixed").value();
  for (const std::string_view codec : codec_names()) {
    SCOPED_TRACE(codec);
    SessionChoice choice;
    choice.bodies = 100;
    choice.codec = codec;
    const auto stream = plan_stream(scene, choice);
    ASSERT_TRUE(stream) << stream.error().message;
    EXPECT_EQ(stream->layout.groups.size() == 2, codec_traits(codec)->turns);
    EXPECT_TRUE(check_layout(stream->layout));
  }
}

TEST(GroupPlan, StepsAndTablesOfTurnsAreThoseThatWereTrained) {
  auto scene = scenes::load_scene("mixed").value();
  SessionChoice choice;
  choice.bodies = 100;
  choice.codec = "entropy";
  const auto usual = plan_stream(scene, choice).value();
  EXPECT_TRUE(has_turn_steps(usual.layout.parameters.codec));
  EXPECT_TRUE(host::largest_delta_bytes({&usual, 1}));

  const std::vector<std::uint8_t> flat(256, 8);
  scenes::TrainedTable table;
  table.bodies = 100;
  table.threshold_m = scene.threshold_m;
  table.position_code_lengths = table.velocity_code_lengths = flat;
  scene.trained = {table};
  const auto partly = plan_stream(scene, choice).value();
  EXPECT_TRUE(host::largest_delta_bytes({&partly, 1})) << "trained before bodies turned";
  EXPECT_EQ(partly.layout.codec_tables.size(), 1024U);

  table.turn_range_rad = 0.25;
  table.spin_range_rad_per_s = 2;
  table.turn_code_lengths = table.spin_code_lengths = flat;
  scene.trained = {table};
  const auto wholly = plan_stream(scene, choice).value();
  EXPECT_EQ(wholly.layout.codec_tables, std::vector<std::byte>(1024, std::byte{8}));
  EXPECT_NEAR(std::ldexp(wholly.layout.parameters.codec.turn_step, -28) * 127, 0.25, 1e-5);
  EXPECT_NEAR(std::ldexp(wholly.layout.parameters.codec.spin_step, -28) * 127 / scene.dt_s, 2, 1e-4);
}

}  // namespace
}  // namespace tandem::sessions
