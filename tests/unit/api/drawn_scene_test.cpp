// What is drawn of a scene's JSON.
#include "sdk/client/api/drawn_scene.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace tandem::api {
namespace {

DrawnScene read(const std::string& json) {
  auto scene = read_scene_json(json);
  EXPECT_TRUE(scene.has_value()) << scene.error().message;
  return scene ? *scene : DrawnScene{};
}

std::string refusal(const std::string& json) {
  const auto scene = read_scene_json(json);
  return scene ? "" : scene.error().message;
}

TEST(DrawnScenes, NothingIsAnEmptyScene) {
  EXPECT_TRUE(read("").solids.empty());
  EXPECT_TRUE(read(" {} ").solids.empty());
}

TEST(DrawnScenes, SolidsAreReadPlanesFirst) {
  const DrawnScene scene = read(R"({
    "description": "half { pipe\" \ud83d\ude00",
    "gravity": {"y": -9.81}, "maxPush": 4,
    "bounds": {"low": {"x": -1, "y": -2, "z": -3}, "high": {"x": 1, "y": 2, "z": 3}},
    "spheres": [{"centre": {"z": 2.5e-1}, "radiusM": 0.5}],
    "planes": [{"through": {"y": 1}, "normal": {"x": 3, "z": -4}}],
    "boxes": [{"\u0063entre": {"x": 1}, "size": {"x": 2, "y": 4, "z": 6}}],
    "share": [1, 2], "unknown": {"deep": {"deeper": [null]}}, "flag": true})");
  EXPECT_EQ(scene.gravity[1], -9.81);
  EXPECT_DOUBLE_EQ(scene.max_gravity, 98.1);
  EXPECT_EQ(scene.max_push, 4);
  EXPECT_EQ(scene.low, (Vector{-1, -2, -3}));
  EXPECT_EQ(scene.high, (Vector{1, 2, 3}));
  ASSERT_EQ(scene.solids.size(), 3U);
  EXPECT_EQ(scene.solids[0].shape, Solid::Shape::kPlane);
  EXPECT_EQ(scene.solids[0].normal, (Vector{0.6, 0, -0.8}));
  EXPECT_EQ(scene.solids[1].shape, Solid::Shape::kBox);
  EXPECT_EQ(scene.solids[1].centre, (Vector{1, 0, 0}));
  EXPECT_EQ(scene.solids[1].size, (Vector{2, 4, 6}));
  EXPECT_EQ(scene.solids[2].shape, Solid::Shape::kSphere);
  EXPECT_EQ(scene.solids[2].centre[2], 0.25);
  EXPECT_EQ(scene.solids[2].radius, 0.5);
}

// A quarter about z takes x to y, a quarter about x then takes y to z.
TEST(DrawnScenes, TurnsAreAboutTheScenesAxesInTheirOrder) {
  const DrawnScene scene =
      read(R"({"boxes": [{"turns": [{"axis": "z", "rise": 1}, {"axis": "x", "rise": 1}]}]})");
  ASSERT_EQ(scene.solids.size(), 1U);
  const auto [x, y, z, w] = scene.solids[0].orientation;
  // The image of the x axis.
  EXPECT_NEAR(1 - 2 * (y * y + z * z), 0, 1e-12);
  EXPECT_NEAR(2 * (x * y + w * z), 0, 1e-12);
  EXPECT_NEAR(2 * (x * z - w * y), 1, 1e-12);
}

TEST(DrawnScenes, AValueOfAWrongTypeCountsAsLeftOut) {
  const DrawnScene scene = read(
      R"({"gravity": 5, "maxPush": {"x": 1}, "planes": 3, "boxes": {"size": {"x": 1}}, "maxGravity": "7",
          "spheres": [{"radiusM": "1"}], "bounds": {"low": [], "high": null}})");
  EXPECT_EQ(scene.gravity, Vector{});
  EXPECT_EQ(scene.max_push, 0);
  EXPECT_EQ(scene.max_gravity, 0);
  ASSERT_EQ(scene.solids.size(), 1U);
  EXPECT_EQ(scene.solids[0].radius, 0);
  EXPECT_TRUE(read("[]").solids.empty());
  EXPECT_TRUE(read("3").solids.empty());
}

TEST(DrawnScenes, WhatIsNotFiniteCountsAsLeftOut) {
  const DrawnScene scene = read(
      R"({"maxPush": "NaN", "maxGravity": 1e999, "spheres": [{"radiusM": "Infinity", "centre": {"x": -1e300}}]})");
  EXPECT_EQ(scene.max_push, 0);
  EXPECT_EQ(scene.max_gravity, 0);
  EXPECT_EQ(scene.solids.at(0).radius, 0);
  EXPECT_EQ(scene.solids.at(0).centre[0], 0);
  EXPECT_NE(refusal(R"({"maxPush": NaN})"), "");
}

TEST(DrawnScenes, OfMembersOfOneNameTheLastCounts) {
  const DrawnScene scene = read(
      R"({"maxPush": 1, "gravity": {"x": 1}, "spheres": [{}, {}], "boxes": [{"turns": [{"rise": 1}], "turns": []}],
          "bounds": {"low": {"x": 1}}, "maxPush": 2, "gravity": {"y": 2, "y": 3}, "spheres": [{}], "bounds": {}})");
  EXPECT_EQ(scene.max_push, 2);
  EXPECT_EQ(scene.gravity, (Vector{0, 3, 0}));
  EXPECT_EQ(scene.low, Vector{});
  ASSERT_EQ(scene.solids.size(), 2U);
  EXPECT_EQ(scene.solids[0].orientation, (std::array<double, 4>{0, 0, 0, 1}));
}

TEST(DrawnScenes, APlaneWithoutANormalIsLeftOut) {
  EXPECT_TRUE(read(R"({"planes": [{}, {"normal": {"x": 0}}, null]})").solids.empty());
}

TEST(DrawnScenes, WhatIsNoJsonIsRefusedWithItsLine) {
  EXPECT_EQ(refusal("{\"gravity\":\n\n {\"y\": 1"), "scene_json, line 3: ',' or '}' is missing");
  for (const char* text : {"}", "gravity", "{gravity: 5}", "{\"x\":}", "{\"x\": \"open", "{\"x\": \"open\\",
                           "{\"x\": [1", "{} {}", "gravity { y: 1 }", "\xFF", "{\"x\": \"a\n\"}"}) {
    EXPECT_NE(refusal(text), "") << text;
  }
}

TEST(DrawnScenes, SizesAndDepthsAreBounded) {
  EXPECT_NE(refusal(std::string((1U << 20U) + 1, ' ')), "");
  std::string deep, many = R"({"spheres":[{})";
  for (int i = 0; i < 100'000; ++i) deep += "{\"a\":";
  EXPECT_NE(refusal(deep), "");
  for (int i = 1; i < 4096; ++i) many += ",{}";
  EXPECT_EQ(read(many + "]}").solids.size(), 4096U);
  EXPECT_EQ(refusal(many + ",{}]}"), "scene_json has more than 4,096 solids of a kind");
  std::string wide = R"({"unknown":[0)";
  for (int i = 0; i < 500'000; ++i) wide += ",0";
  EXPECT_EQ(refusal(wide + "]}"), "") << "what is unknown takes no memory";
}

}  // namespace
}  // namespace tandem::api
