// Mistakes of a simulation's author that a host points out.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "services/host/frames/gravity_hint.hpp"
#include "services/host/frames/scene_check.hpp"

namespace tandem::host {
namespace {

using ::testing::HasSubstr;

std::string wrong(std::string_view json) { return wrong_with_scene(json); }

TEST(SceneCheck, TakesWhatClientsDraw) {
  EXPECT_EQ(wrong(""), "");
  EXPECT_EQ(
      wrong(R"({"gravity": {"y": -9.81}, "bounds": {"low": {"x": -1}, "high": {"x": 1.5e0}}, "maxPush": 3,
                      "planes": [{"through": {"y": -1}, "normal": {"y": 1}}],
                      "boxes": [{"size": {"x": 1}, "turns": [{"axis": "y", "rise": 1, "run": 2}]}],
                      "spheres": [{"radiusM": 1}], "description": 5})"),
      "");
}

TEST(SceneCheck, ANormalNeedsOneNumberThatIsNotZeroWhateverTheOthers) {
  EXPECT_EQ(wrong(R"({"planes": [{"normal": {"x": 0, "y": 1, "z": 0}, "through": {"x": 0}}]})"), "");
  EXPECT_EQ(wrong(R"({"planes": [{"through": {"x": 1}, "normal": {"x": 0, "y": 0, "z": 0}}]})"),
            "planes: a plane needs a normal");
}

TEST(SceneCheck, NamesATypoInsteadOfDrawingLess) {
  EXPECT_EQ(wrong(R"({"planes": [{"nromal": {"y": 1}}]})"),
            "planes: there is no member 'nromal'; through, normal are drawn");
  EXPECT_THAT(wrong(R"({"plane": [{"normal": {"y": 1}}]})"),
              HasSubstr("there is no member 'plane'; planes, boxes"));
  EXPECT_THAT(wrong(R"({"max_push": 1})"), HasSubstr("there is no member 'max_push'"));
  EXPECT_EQ(wrong(R"({"planes": [{"normal": {"y": "1"}}]})"), "planes: normal: y: must be a finite number");
  EXPECT_EQ(wrong(R"({"planes": [{"normal": {"y": "NaN"}}]})"), "planes: normal: y: must be a finite number");
  EXPECT_EQ(wrong(R"({"planes": [{"normal": {"y": 1e999}}]})"), "planes: normal: y: must be a finite number");
  EXPECT_EQ(wrong(R"({"planes": [{"through": {"y": 1}}]})"), "planes: a plane needs a normal");
  EXPECT_EQ(wrong(R"({"planes": [{"normal": {"y": 0.0}, "through": {"y": 1}}]})"),
            "planes: a plane needs a normal");
  EXPECT_EQ(wrong(R"({"planes": 3})"), "planes: must be a list, [ ... ]");
  EXPECT_EQ(wrong(R"({"planes": [3]})"), "planes: must be an object, { ... }");
  EXPECT_EQ(wrong(R"({"boxes": [{"turns": [{"axis": "w"}]}]})"),
            "boxes: turns: axis: must be \"x\", \"y\" or \"z\"");
  EXPECT_EQ(wrong(R"({"maxPush": {"x": 1}})"), "maxPush: must be a finite number");
  EXPECT_EQ(wrong("3"), "must be an object, { ... }");
  EXPECT_EQ(wrong("{\"planes\":\n[{}"), "line 2: ',' or ']' is missing");
}

TEST(SceneCheck, KnowsEveryFieldOfAScene) {
  std::ifstream file(TANDEM_SCENE_PROTO);
  std::string line;
  int fields = 0;
  while (std::getline(file, line) && line != "message Scene {") {
  }
  while (std::getline(file, line) && line != "}") {
    std::istringstream words(line);
    std::string type, name;
    words >> type;
    if (type == "repeated") words >> type;
    words >> name;
    if (type.starts_with("reserved") || name.empty() || type.starts_with("//")) continue;
    ++fields;
    std::string member;  // as protobuf's JSON mapping calls it
    for (std::size_t i = 0; i < name.size(); ++i) {
      const bool capital = i > 0 && name[i - 1] == '_';
      if (name[i] != '_') member += capital ? static_cast<char>(name[i] - 'a' + 'A') : name[i];
    }
    EXPECT_EQ(wrong("{\"" + member + "\": {}}").find("there is no member"), std::string::npos) << name;
  }
  EXPECT_GT(fields, 20);
}

/// Bodies whose velocities change by 1 / dt of `pull` in a frame, but for the first `others` of them.
class GravityHintTest : public ::testing::Test {
 protected:
  GravityHintTest() {
    for (std::uint8_t& alive : state.alive()) alive = 1;
  }
  std::string fall(int frames, double pull, Slot others = 0) {
    std::string said;
    for (int frame = 0; frame < frames; ++frame) {
      for (Slot s = others; s < state.capacity(); ++s)
        state.v(1)[s] += static_cast<std::int32_t>(pull * lattice.dt_s * lattice.velocity_scale());
      said += hint.look(state);
    }
    return said;
  }
  Lattice lattice = *choose_lattice(0.01, 50, 1.0 / 30);
  State state{100};
  GravityHint hint{lattice, static_cast<std::int32_t>(0.01 * lattice.position_scale())};
};

TEST_F(GravityHintTest, ASimulationThatFallsAndSaysNoGravityIsToldOnce) {
  EXPECT_EQ(fall(10, -9.81), "");
  EXPECT_THAT(fall(20, -9.81), HasSubstr("by (0, -9.81, 0), but the simulation says that its gravity is 0"));
  EXPECT_EQ(fall(100, -9.81), "");
}

TEST_F(GravityHintTest, WhatIsNoGravityIsNotTold) {
  EXPECT_EQ(fall(100, 0), "") << "free flight";
  EXPECT_EQ(fall(100, -0.01), "") << "less than a threshold in a second";
  EXPECT_EQ(fall(100, -9.81, 50), "") << "half of the bodies";
  for (int i = 0; i < 50; ++i) EXPECT_EQ(fall(1, i % 2 == 0 ? 9 : -9), "") << "to and fro";
}

TEST_F(GravityHintTest, AFewBodiesThatRestDoNotHideIt) { EXPECT_NE(fall(30, -9.81, 9), ""); }

}  // namespace
}  // namespace tandem::host
