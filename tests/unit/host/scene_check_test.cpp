#include "services/host/frames/scene_check.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

namespace tandem::host {
namespace {

using ::testing::HasSubstr;

std::string wrong(std::string_view text) {
  const auto read = transport::read_text_message(text);
  return read ? wrong_with_scene(*read) : read.error().message;
}

TEST(SceneCheck, TakesWhatClientsDraw) {
  EXPECT_EQ(wrong("gravity { y: -9.81 } bounds { low { x: -1 } high { x: +1.5e0f } } max_push: 3\n"
                  "planes { through { y: -1 } normal { y: 1 } }\n"
                  "boxes { size { x: 1 } turns { axis: \"y\" rise: 1 run: 2 } } spheres { radius_m: 1 }"),
            "");
}

TEST(SceneCheck, NamesATypoInsteadOfDrawingLess) {
  EXPECT_EQ(wrong("planes { nromal { y: 1 } }"),
            "planes: there is no field 'nromal'; through, normal are drawn");
  EXPECT_THAT(wrong("plane { normal { y: 1 } }"), HasSubstr("there is no field 'plane'; planes, boxes"));
  EXPECT_EQ(wrong("planes { normal { y: l } }"), "planes: normal: y: 'l' is not a finite number");
  EXPECT_EQ(wrong("planes { normal { y: nan } }"), "planes: normal: y: 'nan' is not a finite number");
  EXPECT_EQ(wrong("planes { through { y: 1 } }"), "planes: a plane needs a normal");
  EXPECT_EQ(wrong("planes { normal { y: 0.0 } }"), "planes: a plane needs a normal");
  EXPECT_EQ(wrong("planes: 3"), "planes: must be { ... }, not '3'");
  EXPECT_EQ(wrong("boxes { turns { axis: \"w\" } }"), "boxes: turns: axis: must be \"x\", \"y\" or \"z\"");
  EXPECT_EQ(wrong("max_push { x: 1 }"), "max_push: '{ ... }' is not a finite number");
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
    EXPECT_EQ(wrong(name + " {}").find("there is no field"), std::string::npos) << name;
  }
  EXPECT_GT(fields, 20);
}

}  // namespace
}  // namespace tandem::host
