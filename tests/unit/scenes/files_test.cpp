#include <gmock/gmock.h>

#include "services/engines/scenes/replayed.hpp"
#include "services/engines/scenes/scene.hpp"
#include "tests/unit/scenes/temporary.hpp"

namespace tandem::scenes {
namespace {

using ::testing::HasSubstr;

// Loads the small scene with a line in front; returns the error.
std::string refusal(const std::string& line) {
  const TemporaryFolder folder;
  const auto scene = load_scene(folder.write("bad.textproto", small_scene(line)));
  return scene ? "accepted" : scene.error().message;
}

TEST(SceneFiles, NamesOfStreamsThatAnOlderFileHasAreLeftOut) {
  const TemporaryFolder folder;
  const auto scene = load_scene(folder.write("scene.textproto", small_scene("stream_names: 'thin'")));
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_THAT(scene->text, ::testing::Not(HasSubstr("stream_names")));
}

TEST(SceneFiles, TheSmallSceneIsFine) { EXPECT_EQ(refusal(""), "accepted"); }

TEST(SceneFiles, AnUnknownFieldIsNamedWithFileAndLine) {
  const std::string message = refusal("# a comment\n\ngravitas { x: 1 }");
  EXPECT_THAT(message, HasSubstr("bad.textproto:3: "));
  EXPECT_THAT(message, HasSubstr("gravitas"));
}

TEST(SceneFiles, AValueOfTheWrongTypeIsNamedWithItsField) {
  const std::string message = refusal("users: 1\nmax_push: fast");
  EXPECT_THAT(message, HasSubstr("bad.textproto:2: "));
  EXPECT_THAT(message, HasSubstr("field \"max_push\""));
}

TEST(SceneFiles, ABrokenRuleIsNamedWithTheFieldsPathAndLine) {
  const std::string message = refusal("users: 2\ntypes {\n  name: \"flat\"\n  radius_m: 0\n  mass_kg: 1\n}");
  EXPECT_THAT(message, HasSubstr("bad.textproto:4: "));
  EXPECT_THAT(message, HasSubstr("field \"types[0].radius_m\" must be above 0"));
}

TEST(SceneFiles, EveryRuleRefusesWhatBreaksIt) {
  const std::vector<std::pair<std::string, std::string>> cases{
      {"planes { normal { } }", "planes[0].normal"},
      {"planes { normal { y: nan } }", "planes[0].normal.y"},
      {"planes { through { x: inf } normal { y: 1 } }", "planes[0].through.x"},
      {"boxes { size { x: 1 y: 1 } }", "boxes[0].size"},
      {"boxes { size { x: 1 y: 1 z: 1 } turns { axis: \"w\" run: 1 } }", "boxes[0].turns[0].axis"},
      {"boxes { size { x: 1 y: 1 z: 1 } turns { axis: \"x\" } }", "boxes[0].turns[0].run"},
      {"spheres { radius_m: -1 }", "spheres[0].radius_m"},
      {"substeps: 65", "substeps"},
      {"users: 65", "users"},
      {"damping_per_s: 25", "damping_per_s"},
      {"wall { spring: -1 }", "wall.spring"},
      {"max_gravity: 1e7", "max_gravity"},
      {"types { radius_m: 1 mass_kg: 1 }", "types[0].name"},
      {"types { name: \"b\" radius_m: 1 mass_kg: 1 colour: \"red\" }", "types[0].colour"},
      {"emitters { rate_per_s: 5 type: \"cube\" }", "emitters[0].type"},
      {"emitters { rate_per_s: -5 type: \"ball\" }", "emitters[0].rate_per_s"},
      {"emitters { region { high { y: 41 } } rate_per_s: 5 type: \"ball\" }", "emitters[0].region"},
      {"regions { }", "regions[0]"},
      {"regions { remove: false }", "regions[0].remove"},
      {"regions { set_type: \"cube\" }", "regions[0].set_type"},
      {"regions { region { low { x: 1 } } remove: true }", "regions[0].region"},
      {"script { events { gravity { } } }", "script.events[0]"},
      {"script { events { time_s: 1 } }", "script.events[0]"},
      {"script { events { frame: 0 gravity { } } }", "script.events[0].frame"},
      {"script { events { time_s: -1 gravity { } } }", "script.events[0].time_s"},
      {"script { events { frame: 1 push { } } }", "script.events[0].push.radius_m"},
      {"script { events { frame: 1 gravity { } user: 64 } }", "script.events[0].user"},
      {"script { tilting { } }", "script.tilting[0].period_s"},
      {"script { tilting { period_s: 1 swing_s: 2 } }", "script.tilting[0].swing_s"},
      {"script { tilting { period_s: 1 period_jitter: 1 } }", "script.tilting[0].period_jitter"},
      {"script { poking { period_s: 1 } }", "script.poking[0].radius_m"},
  };
  for (const auto& [line, field] : cases) {
    const std::string message = refusal(line);
    EXPECT_THAT(message, HasSubstr("bad.textproto:1: ")) << line;
    EXPECT_THAT(message, HasSubstr(field + "\"")) << line;
  }
}

// The small scene with rigid bodies: a type in front, which is a box unless `type` says otherwise.
std::string rigid_refusal(const std::string& line, const std::string& type = "box { x: 1 y: 2 z: 3 }") {
  return refusal("engine: \"bullet\" types { name: \"body\" mass_kg: 1 " + type + " } " + line);
}

TEST(SceneFiles, EveryShapeIsAccepted) {
  for (const char* shape :
       {"box { x: 1 y: 2 z: 3 }", "capsule { radius_m: 1 length_m: 2 }",
        "cylinder { radius_m: 1 length_m: 2 }",
        "hull { points { x: 1 } points { y: 1 } points { z: 1 } points { x: -1 y: -1 z: -1 } }",
        "radius_m: 1"}) {
    EXPECT_EQ(rigid_refusal("", shape), "accepted");
  }
}

TEST(SceneFiles, AShapeWithoutASizeIsRefused) {
  const std::vector<std::pair<std::string, std::string>> cases{
      {"", "types[0].radius_m\" must be above 0"},
      {"box { x: 1 y: 1 }", "types[0].box\" breaks a rule: a box needs 3 half sizes above 0"},
      {"capsule { length_m: 1 }", "types[0].capsule\" breaks a rule: a capsule needs a radius above 0"},
      {"cylinder { radius_m: 1 }", "types[0].cylinder\" breaks a rule"},
      {"hull { points { x: 1 } }", "types[0].hull\" breaks a rule: a hull needs 4 to 256 points"},
      {"hull { points { x: 1 } points { y: 1 } points { } points { x: -1 } }", "an extent along x, y and z"},
      {"box { x: 1 y: 1 z: 1 } radius_m: 1", "types[0].radius_m\" must be left out"},
  };
  for (const auto& [type, expected] : cases) {
    const std::string message = rigid_refusal("", type);
    EXPECT_THAT(message, HasSubstr("bad.textproto:1: ")) << type;
    EXPECT_THAT(message, HasSubstr(expected)) << type;
  }
}

TEST(SceneFiles, EveryRuleOfRigidBodiesRefusesWhatBreaksIt) {
  const std::vector<std::pair<std::string, std::string>> cases{
      {"rigid { friction: 11 }", "rigid"},
      {"rigid { restitution: 1.5 }", "rigid"},
      {"spare: 1", "spare"},
      {"towers { type: \"body\" layers: 3 pitch_m: 10 }", "start"},
      {"emitters { type: \"body\" }", "emitters[0]"},
      {"regions { remove: true }", "regions[0]"},
      {"script { events { frame: 1 spawn { type: 2 } } }", "script.events[0].spawn"},
      {"script { events { frame: 1 remove { } } }", "script.events[0].remove.radius_m"},
  };
  for (const auto& [line, field] : cases) EXPECT_THAT(rigid_refusal(line), HasSubstr(field + "\"")) << line;
  for (const char* line : {"engine: \"havok\"", "rigid { }", "script { events { frame: 1 spawn { } } }",
                           "script { events { frame: 1 remove { radius_m: 1 } } }",
                           "types { name: \"b\" mass_kg: 1 box { x: 1 y: 1 z: 1 } }"}) {
    EXPECT_THAT(refusal(line), HasSubstr("bullet\"")) << line;
  }
}

TEST(SceneFiles, ParticlesStandInNoTowersOrRowsAndNeitherCruiseNorTurn) {
  const TemporaryFolder folder;
  for (const std::string start : {"towers { }", "rows { }", "cruising { }",
                                  "start { proportions { x: 1 y: 1 z: 1 } spacing: 1 turned: true }"}) {
    std::string scene = small_scene();
    scene.replace(scene.find("start"), std::string::npos, start);
    EXPECT_THAT(load_scene(folder.write("bad.textproto", scene)).error().message,
                HasSubstr("needs engine: \"bullet\""));
  }
}

TEST(SceneFiles, TowersAndRowsThatDoNotFitTheirBodiesAreRefused) {
  const auto arranged = [](const std::string& arrangement) {
    const TemporaryFolder folder;
    const auto scene = load_scene(folder.write("bad.textproto", R"(
engine: "bullet" dt_s: 0.04 threshold_radii: 0.2
bounds { low { x: -20 y: -20 z: -20 } high { x: 20 y: 40 z: 20 } }
pair { spring: 100 damping: 1 shear: 1 }
types { name: "box" mass_kg: 1 box { x: 3 y: 1 z: 1 } } types { name: "ball" mass_kg: 1 radius_m: 1 }
)" + arrangement));
    return scene ? "accepted" : scene.error().message;
  };
  EXPECT_EQ(arranged("towers { type: \"box\" layers: 3 pitch_m: 4 }"), "accepted");
  EXPECT_EQ(arranged("rows { type: \"box\" length: 3 pitch_m: 4 row_pitch_m: 2 }"), "accepted");
  EXPECT_THAT(arranged("towers { type: \"ball\" layers: 3 pitch_m: 4 }"), HasSubstr("towers.type\""));
  EXPECT_THAT(arranged("towers { type: \"none\" layers: 3 pitch_m: 4 }"), HasSubstr("towers.type\""));
  EXPECT_THAT(arranged("towers { type: \"box\" pitch_m: 4 }"), HasSubstr("towers.layers\""));
  EXPECT_THAT(arranged("towers { type: \"box\" layers: 3 pitch_m: 3 }"), HasSubstr("towers.pitch_m\""));
  EXPECT_THAT(arranged("rows { type: \"ball\" length: 3 pitch_m: 4 }"), HasSubstr("rows.type\""));
  EXPECT_THAT(arranged("rows { type: \"box\" pitch_m: 4 row_pitch_m: 2 }"), HasSubstr("rows.length\""));
  EXPECT_THAT(arranged("rows { type: \"box\" length: 3 pitch_m: 3 row_pitch_m: 2 }"),
              HasSubstr("rows.pitch_m\""));
  EXPECT_THAT(arranged("rows { type: \"box\" length: 3 pitch_m: 4 }"), HasSubstr("rows.row_pitch_m\""));
  EXPECT_EQ(arranged("cruising { radius_m: 9 max_speed: 1 }"), "accepted");
  EXPECT_THAT(arranged("cruising { }"), HasSubstr("cruising.radius_m\""));
  EXPECT_THAT(arranged("cruising { radius_m: 9 min_speed: 2 max_speed: 1 }"),
              HasSubstr("cruising.min_speed\""));
  EXPECT_THAT(arranged(""), HasSubstr("start\""));
}

TEST(SceneFiles, WhatIsMissingIsNamed) {
  const TemporaryFolder folder;
  const auto scene = load_scene(folder.write("empty.textproto", ""));
  ASSERT_FALSE(scene);
  EXPECT_THAT(scene.error().message, HasSubstr("empty.textproto:1: field \"dt_s\""));
}

TEST(SceneFiles, AFileThatIsNotThereOrNoFileIsRefused) {
  const TemporaryFolder folder;
  EXPECT_EQ(load_scene(folder.path() + "/none.textproto").error().code, ErrorCode::kIo);
  EXPECT_EQ(load_scene(folder.path() + "/").error().code, ErrorCode::kIo);
}

TEST(SceneFiles, BinaryRubbishIsRefused) {
  const TemporaryFolder folder;
  std::string rubbish;
  for (int i = 0; i < 4096; ++i) rubbish.push_back(static_cast<char>(i * 37 % 251));
  const auto scene = load_scene(folder.write("rubbish.textproto", rubbish));
  ASSERT_FALSE(scene);
  EXPECT_EQ(scene.error().code, ErrorCode::kMalformed);
}

TEST(TrainedTables, AreReadFromTheFileBesideTheScene) {
  const TemporaryFolder folder;
  const std::string path = folder.write("s.textproto", small_scene());
  (void)folder.write(
      "s.trained.textproto",
      "tables { bodies: 1000 threshold_m: 0.1 position_range_m: 0.25 velocity_range_m_per_s: 3.5"
      " position_code_lengths: [1, 2, 3, 3] velocity_code_lengths: [2, 2, 2, 2] turn_range_rad: 0.5"
      " spin_range_rad_per_s: 6.25 turn_code_lengths: [1, 2, 2] spin_code_lengths: [2, 2, 1] }"
      "tables { bodies: 1000 threshold_m: 0.05 position_range_m: 0.2 velocity_range_m_per_s: 3.25 }");
  TrainedTable a{1000, 0.1, 0.25, 3.5, {1, 2, 3, 3}, {2, 2, 2, 2}};
  a.turn_range_rad = 0.5;
  a.spin_range_rad_per_s = 6.25;
  a.turn_code_lengths = {1, 2, 2};
  a.spin_code_lengths = {2, 2, 1};
  const TrainedTable b{1000, 0.05, 0.2, 3.25, {}, {}};
  const auto scene = load_scene(path);
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_THAT(scene->trained, ::testing::ElementsAre(a, b));
}

TEST(TrainedTables, AreFoundExactlyOrNearest) {
  const std::vector<TrainedTable> tables{
      {1000, 0.1, 1, 1, {}, {}}, {10000, 0.1, 2, 1, {}, {}}, {10000, 0.2, 3, 1, {}, {}}};
  EXPECT_EQ(find_table(tables, 10000, 0.1)->position_range_m, 2);
  EXPECT_EQ(find_table(tables, 10000, 0.3), nullptr);
  EXPECT_EQ(find_table(tables, 5000, 0.1), nullptr);
  EXPECT_EQ(planning::nearest_table(tables, 5000, 0.11)->position_range_m, 2);
  EXPECT_EQ(planning::nearest_table(tables, 1, 0.5)->position_range_m, 3);
  EXPECT_EQ(planning::nearest_table({}, 1, 0.5), nullptr);
}

TEST(TrainedTables, ThatAreMalformedNameFileLineAndField) {
  const TemporaryFolder folder;
  const std::string path = folder.write("s.textproto", small_scene());
  (void)folder.write("s.trained.textproto",
                     "tables {\n  bodies: 5\n  threshold_m: 1\n  position_code_lengths: [1, 65]\n}");
  const auto scene = load_scene(path);
  ASSERT_FALSE(scene);
  EXPECT_THAT(scene.error().message,
              HasSubstr("s.trained.textproto:4: field \"tables[0].position_code_lengths[1]\""));
}

TEST(TrainedTables, OfOlderVersionsAreRead) {
  const TemporaryFolder folder;
  const std::string path = folder.write("s.textproto", small_scene());
  (void)folder.write("s.trained.textproto", "tables { bodies: 5 threshold_m: 1 tracker_decay: 800 }");
  const auto scene = load_scene(path);
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->trained.size(), 1U);
}

}  // namespace
}  // namespace tandem::scenes
