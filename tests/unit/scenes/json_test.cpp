// Scenes as the JSON that sessions announce.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/engines/scenes/replayed.hpp"
#include "services/engines/scenes/scene.hpp"
#include "services/host/frames/scene_check.hpp"

namespace tandem::scenes {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(SceneJson, OfEverySceneIsWhatHostsTakeAndReadsAsTheScene) {
  for (const std::string& name : scene_names()) {
    const auto scene = load_scene(name);
    ASSERT_TRUE(scene) << scene.error().message;
    EXPECT_EQ(host::wrong_with_scene(scene->json), "") << name;
    const auto read = parse_scene(scene->json, "announced");
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->text, scene->text) << name;
    EXPECT_EQ(read->json, scene->json) << name;
    EXPECT_THAT(scene->json, Not(HasSubstr("\"script\""))) << name;
  }
}

TEST(SceneJson, MembersThatNoSceneHasAreIgnoredAndBrokenRulesAreNamed) {
  std::string json = load_scene("cube")->json;
  json.insert(1, R"("later":{"x":[1]},)");
  EXPECT_TRUE(parse_scene(json, "announced"));
  EXPECT_THAT(parse_scene("{}", "announced").error().message, HasSubstr("announced:1: field"));
  EXPECT_THAT(parse_scene("{", "announced").error().message, HasSubstr("announced: "));
  EXPECT_FALSE(parse_scene(std::string(100'000, '['), "announced"));
}

TEST(SceneJson, ARecordingIsPutIntoIt) {
  const Recording recording{.started_unix_ms = 1'700'000'000'000,
                            .length_s = 10,
                            .from_s = 0.5,
                            .from_frame = 9'007'199'254'740'993,
                            .frame_rate_hz = 50,
                            .events = {{1, "a \"b\""}}};
  const std::string told =
      R"("recording":{"startedUnixMs":"1700000000000","lengthS":10,"fromS":0.5,"fromFrame":"9007199254740993","frameRateHz":50,"events":[{"atS":1,"text":"a \"b\""}]})";
  EXPECT_EQ(replayed("", recording), R"({"dtS":0.02,)" + told + "}");
  EXPECT_EQ(replayed(R"({"dtS":0.5,"recording":{"lengthS":3},"later":1})", recording),
            R"({"dtS":0.5,)" + told + "}");
  EXPECT_EQ(replayed("gravity { y: 1 }", recording), "gravity { y: 1 }");
}

TEST(SceneJson, WhatIsNotFiniteIsLeftOut) {
  const std::string json = replayed(
      R"({"maxPush":"NaN","gravity":{"x":"-Infinity","y":2},"spheres":[{"radiusM":"Infinity","centre":{"x":1}}]})",
      {.length_s = 1, .frame_rate_hz = 1});
  EXPECT_THAT(json, HasSubstr(R"("gravity":{"y":2})"));
  EXPECT_THAT(json, HasSubstr(R"("spheres":[{"centre":{"x":1}}])"));
  EXPECT_THAT(json, Not(HasSubstr("NaN")));
  EXPECT_THAT(json, Not(HasSubstr("Infinity")));
}

}  // namespace
}  // namespace tandem::scenes
