#include "services/engines/scenes/script.hpp"

#include <gmock/gmock.h>

#include <cmath>

#include "services/engines/scenes/scene.hpp"
#include "tests/unit/scenes/temporary.hpp"

namespace tandem::scenes {
namespace {

using ::testing::HasSubstr;

Scene scene_with(const std::string& script) {
  const TemporaryFolder folder;
  auto scene = load_scene(folder.write("s.textproto", small_scene(script)));
  if (!scene) throw std::runtime_error(scene.error().message);
  return *scene;
}

bool same(const ScriptedInput& a, const ScriptedInput& b) {
  return a.frame == b.frame && a.user == b.user && a.input.kind == b.input.kind &&
         a.input.values == b.input.values;
}

TEST(Scripts, RepeatForASeedAndOnlyGrowWithTheFrames) {
  const Scene scene = scene_with(
      "script { tilting { period_s: 0.5 period_jitter: 0.5 spread: 1 swing_s: 0.2 send_every_s: 0.08 } "
      "poking { start_s: 1 period_s: 0.7 radius_m: 2 speed_m_per_s: 3 } }");
  const auto all = scripted_inputs(scene, 9, 3, 500);
  const auto again = scripted_inputs(scene, 9, 3, 500);
  const auto first = scripted_inputs(scene, 9, 3, 200);
  const auto other = scripted_inputs(scene, 10, 3, 500);
  ASSERT_EQ(all.size(), again.size());
  ASSERT_LT(first.size(), all.size());
  for (std::size_t i = 0; i < all.size(); ++i) EXPECT_TRUE(same(all[i], again[i]));
  for (std::size_t i = 0; i < first.size(); ++i) EXPECT_TRUE(same(first[i], all[i]));
  for (std::size_t i = 1; i < all.size(); ++i) {
    EXPECT_LE(std::pair(all[i - 1].frame, all[i - 1].user), std::pair(all[i].frame, all[i].user));
  }
  EXPECT_GE(all.front().frame, 1U);
  EXPECT_LE(all.back().frame, 500U);
  EXPECT_FALSE(other.size() == all.size() && same(other[0], all[0]));
  std::vector<std::size_t> by_user(3);
  for (const ScriptedInput& input : all) ++by_user.at(input.user);
  for (const std::size_t count : by_user) EXPECT_GT(count, 50U);
}

TEST(Scripts, FrameByFrameForHoursGiveTheSameAndKeepNothing) {
  const Scene scene = scene_with(
      "script { tilting { period_s: 0.5 period_jitter: 0.5 spread: 1 swing_s: 0.2 send_every_s: 0.08 } "
      "tilting { period_s: 2 swing_s: 1.5 } poking { start_s: 1 period_s: 0.7 radius_m: 2 } "
      "events { frame: 5 gravity { x: 2 } user: 1 } }");
  constexpr std::uint64_t kFrames = 50'000;
  const auto at_once = scripted_inputs(scene, 9, 3, kFrames);
  Script script(scene, 9, 3);
  std::size_t sent = 0, most = 0;
  for (std::uint64_t frame = 1; frame <= kFrames; ++frame) {
    for (const ScriptedInput& input : script.until(frame)) {
      ASSERT_LT(sent, at_once.size());
      ASSERT_TRUE(same(input, at_once[sent++]));
      ASSERT_EQ(input.frame, frame);
    }
    most = std::max(most, script.pending());
  }
  EXPECT_EQ(sent, at_once.size());
  EXPECT_GT(sent, kFrames / 4);
  EXPECT_LE(most, 100U);
}

TEST(Scripts, TiltingKeepsGravitysStrengthAndStaysInItsCone) {
  const Scene scene =
      scene_with("script { tilting { period_s: 0.2 spread: 0.5 swing_s: 0.12 send_every_s: 0.04 } }");
  const auto inputs = scripted_inputs(scene, 4, 0, 400);
  ASSERT_GT(inputs.size(), 100U);
  for (const ScriptedInput& input : inputs) {
    const std::vector<double>& g = input.input.values;
    ASSERT_EQ(g.size(), 3U);
    EXPECT_NEAR(g[0] * g[0] + g[1] * g[1] + g[2] * g[2], 25, 1e-9);
    EXPECT_LE(g[1], -5 * std::sqrt(0.75) + 1e-9);  // sine of the widest angle is the spread, 0.5
  }
}

TEST(Scripts, TurningOverPointsEveryOtherGravityUp) {
  const Scene scene = scene_with("script { tilting { period_s: 1 spread: 0.3 turn_over: true } }");
  const auto inputs = scripted_inputs(scene, 4, 0, 300);
  ASSERT_GE(inputs.size(), 10U);
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    EXPECT_GT(inputs[i].input.values[1] * (i % 2 == 0 ? 1 : -1), 4) << i;
  }
}

TEST(Scripts, EventsActOnTheirFramesForUsersThatAreThere) {
  const Scene scene = scene_with(
      "script { events { time_s: 0.4 gravity { x: 1 } } events { frame: 3 push { radius_m: 2 velocity_change "
      "{ y: 4 } } } "
      "events { frame: 5 gravity { x: 2 } user: 1 } }");
  const auto one = scripted_inputs(scene, 1, 1, 100);
  ASSERT_EQ(one.size(), 2U);
  EXPECT_EQ(one[0].frame, 3U);
  EXPECT_EQ(one[0].input.values, (std::vector<double>{0, 0, 0, 2, 0, 4, 0}));
  EXPECT_EQ(one[1].frame, 10U);
  EXPECT_EQ(scripted_inputs(scene, 1, 2, 100).size(), 3U);
  EXPECT_TRUE(scripted_inputs(scene, 1, 2, 2).empty());
}

TEST(InputScripts, AreReadInOrderOfTheirFrames) {
  const TemporaryFolder folder;
  const auto inputs = load_input_script(
      folder.write("i.textproto",
                   "inputs { time_s: 2 gravity { y: -1 } }\ninputs { frame: 1 push { radius_m: 1 } }\n"
                   "inputs { time_s: 0 gravity { y: -2 } }\ninputs { frame: 90 seek_s: 12.5 }\n"),
      1.0 / 30);
  ASSERT_TRUE(inputs) << inputs.error().message;
  ASSERT_EQ(inputs->size(), 4U);
  EXPECT_EQ((*inputs)[0].frame, 1U);
  EXPECT_EQ((*inputs)[0].input.values.size(), 7U);
  EXPECT_EQ((*inputs)[1].frame, 1U);
  EXPECT_EQ((*inputs)[2].frame, 60U);
  EXPECT_EQ((*inputs)[2].input.values, (std::vector<double>{0, -1, 0}));
  EXPECT_EQ((*inputs)[3].input.kind, static_cast<std::uint32_t>(engine::InputKind::kSeek));
  EXPECT_EQ((*inputs)[3].input.values, (std::vector<double>{12.5}));
}

TEST(InputScripts, ThatAreMalformedNameFileLineAndField) {
  const TemporaryFolder folder;
  const auto refusal = [&folder](const std::string& text) {
    const auto inputs = load_input_script(folder.write("i.textproto", text), 0.04);
    return inputs ? "accepted" : inputs.error().message;
  };
  EXPECT_THAT(refusal("inputs {\n  frame: 1\n  gravity { x: nan }\n}"),
              HasSubstr(":3: field \"inputs[0].gravity.x\""));
  EXPECT_THAT(refusal("inputs { frame: 1 seek_s: -1 }"), HasSubstr("field \"inputs[0].seek_s\""));
  EXPECT_THAT(refusal("\ninputs { frame: -1 }"), HasSubstr(":2: field \"frame\""));
  EXPECT_THAT(refusal("inputs { gravity { } }"), HasSubstr(":1: field \"inputs[0]\" needs time_s or frame"));
  EXPECT_EQ(refusal(""), "accepted");
  EXPECT_EQ(load_input_script(folder.path() + "/none", 0.04).error().code, ErrorCode::kIo);
}

}  // namespace
}  // namespace tandem::scenes
