// The parser of scenes.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "sdk/client/api/scene_text.hpp"

namespace tandem::api {
namespace {

SceneText read(const std::string& text) {
  auto scene = read_scene_text(text);
  EXPECT_TRUE(scene.has_value()) << scene.error().message;
  return scene ? *scene : SceneText{};
}

std::string refusal(const std::string& text) {
  const auto scene = read_scene_text(text);
  return scene ? "" : scene.error().message;
}

TEST(SceneTexts, NothingIsAnEmptyScene) {
  EXPECT_TRUE(read("").solids.empty());
  EXPECT_TRUE(read(" \n# only a comment").solids.empty());
}

TEST(SceneTexts, SolidsAreReadInTheirOrder) {
  const SceneText scene = read(
      "description: \"half { pipe\" 'and' \"more\"\n"
      "gravity { y: -9.81 } max_push: 4 # comment }\n"
      "bounds { low { x: -1 y: -2 z: -3 } high: < x: 1, y: 2; z: 3 > }\n"
      "spheres { centre { z: 2.5e-1 } radius_m: .5f }\n"
      "planes { through { y: 1 } normal { x: 3 z: -4 } }\n"
      "boxes { centre { x: 1 } size { x: 2 y: 4 z: 6 } }\n"
      "share: [1, 2] unknown { deep { deeper: -inf } } flag: true\n");
  EXPECT_EQ(scene.gravity[1], -9.81);
  EXPECT_DOUBLE_EQ(scene.max_gravity, 98.1);
  EXPECT_EQ(scene.max_push, 4);
  EXPECT_EQ(scene.low, (Vector{-1, -2, -3}));
  EXPECT_EQ(scene.high, (Vector{1, 2, 3}));
  ASSERT_EQ(scene.solids.size(), 3U);
  EXPECT_EQ(scene.solids[0].shape, Solid::Shape::kPlane);
  EXPECT_EQ(scene.solids[0].normal, (Vector{0.6, 0, -0.8}));
  EXPECT_EQ(scene.solids[1].shape, Solid::Shape::kBox);
  EXPECT_EQ(scene.solids[1].size, (Vector{2, 4, 6}));
  EXPECT_EQ(scene.solids[2].shape, Solid::Shape::kSphere);
  EXPECT_EQ(scene.solids[2].centre[2], 0.25);
  EXPECT_EQ(scene.solids[2].radius, 0.5);
}

// A quarter about z takes x to y, a quarter about x then takes y to z.
TEST(SceneTexts, TurnsAreAboutTheScenesAxesInTheirOrder) {
  const SceneText scene = read("boxes { turns { axis: \"z\" rise: 1 } turns { axis: \"x\" rise: 1 } }");
  ASSERT_EQ(scene.solids.size(), 1U);
  const auto [x, y, z, w] = scene.solids[0].orientation;
  // The image of the x axis.
  EXPECT_NEAR(1 - 2 * (y * y + z * z), 0, 1e-12);
  EXPECT_NEAR(2 * (x * y + w * z), 0, 1e-12);
  EXPECT_NEAR(2 * (x * z - w * y), 1, 1e-12);
}

TEST(SceneTexts, AFieldOfAWrongTypeCountsAsLeftOut) {
  const SceneText scene =
      read("gravity: 5 max_push { x: 1 } planes: 3 spheres { radius_m: \"big\" } bounds { low: [] }");
  EXPECT_EQ(scene.gravity, Vector{});
  EXPECT_EQ(scene.max_push, 0);
  ASSERT_EQ(scene.solids.size(), 1U);
  EXPECT_EQ(scene.solids[0].radius, 0);
}

TEST(SceneTexts, WhatIsNotFiniteCountsAsLeftOut) {
  const SceneText scene =
      read("max_push: nan max_gravity: 1e999 spheres { radius_m: inf centre { x: -1e300 } }");
  EXPECT_EQ(scene.max_push, 0);
  EXPECT_EQ(scene.max_gravity, 0);
  EXPECT_EQ(scene.solids.at(0).radius, 0);
  EXPECT_EQ(scene.solids.at(0).centre[0], 0);
}

TEST(SceneTexts, APlaneWithoutANormalIsLeftOut) { EXPECT_TRUE(read("planes { }").solids.empty()); }

TEST(SceneTexts, WhatIsNotSuchATextIsRefusedWithItsLine) {
  EXPECT_NE(refusal("gravity {\n\n y: 1").find("line 3"), std::string::npos) << refusal("gravity {\n\n y: 1");
  for (const char* text : {"}", "gravity", "gravity 5", "x: ", "x: \"open", "x: \"open\\", "x: [1", "5: 5",
                           ": 5", "x { > ", "x: 'a\n'", "\xFF", "x: {{"}) {
    EXPECT_NE(refusal(text), "") << text;
  }
  EXPECT_NE(refusal(std::string(4, '\0')), "");
}

TEST(SceneTexts, SizesAndDepthsAreBounded) {
  EXPECT_NE(refusal(std::string((1U << 20U) + 1, ' ')), "");
  std::string deep, wide, many;
  for (int i = 0; i < 200'000; ++i) deep += "a{";
  for (int i = 0; i < 200'000; ++i) wide += "a:1 ";
  for (int i = 0; i < 5'000; ++i) many += "spheres{}";
  EXPECT_NE(refusal(deep), "");
  EXPECT_NE(refusal(wide), "");
  EXPECT_NE(refusal(many), "");
}

}  // namespace
}  // namespace tandem::api
