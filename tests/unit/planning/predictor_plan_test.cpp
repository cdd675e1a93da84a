// Tests which predictor a session gets that names none.
#include <gtest/gtest.h>

#include "services/engines/sessions/session_plan.hpp"

namespace tandem::sessions {
namespace {

/// A scene of Bullet whose bodies are shapes of a kind, each type half as large again as the one before.
scenes::Scene scene_of(std::vector<engine::Shape::Kind> kinds) {
  auto scene = scenes::load_scene("towers").value();
  scene.types.resize(1);
  scene.types.resize(kinds.size(), scene.types.front());
  scene.world.types.assign(kinds.size(), scene.world.types.front());
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    scene.types[i].shape.kind = kinds[i];
    if (i > 0) scene.world.types[i].radius = 1.5F * scene.world.types[i - 1].radius;
  }
  return scene;
}

std::string predictor_of(const scenes::Scene& scene, std::uint32_t bodies = 100,
                         std::string codec = "tracker") {
  SessionChoice choice;
  choice.bodies = bodies;
  choice.codec = std::move(codec);
  return plan_stream(scene, choice).value().layout.predictor;
}

using enum engine::Shape::Kind;

TEST(PredictorPlan, SpheresOfAboutOneSizeComputeTheirContacts) {
  EXPECT_EQ(predictor_of(scene_of({kSphere, kSphere})), "field");
  EXPECT_EQ(predictor_of(scene_of({kSphere, kSphere, kSphere})), "ballistic") << "2.25 times as large";
  EXPECT_EQ(predictor_of(scenes::load_scene("half_pipe").value()), "field");
}

TEST(PredictorPlan, WhereABodyIsNoSphereNobodyDoes) {
  for (const auto kind : {kBox, kCapsule, kCylinder, kHull})
    EXPECT_EQ(predictor_of(scene_of({kSphere, kind})), "ballistic");
  for (const char* const scene : {"towers", "rubble", "dominoes", "mixed"})
    EXPECT_EQ(predictor_of(scenes::load_scene(scene).value()), "ballistic") << scene;
}

TEST(PredictorPlan, NorInTooLargeASessionOrWithAPapersCodec) {
  const auto spheres = scene_of({kSphere});
  EXPECT_EQ(predictor_of(spheres, predictors().front().most_bodies), "field");
  EXPECT_EQ(predictor_of(spheres, predictors().front().most_bodies + 1), "ballistic");
  EXPECT_EQ(predictor_of(spheres, 100, "entropy"), "ballistic");
}

TEST(PredictorPlan, WhoIsAskedForIsTaken) {
  SessionChoice choice;
  choice.bodies = 100;
  for (const char* const predictor : {"ballistic", "field", "contact", "hard", "rigid"}) {
    choice.predictor = predictor;
    EXPECT_EQ(plan_stream(scenes::load_scene("rubble").value(), choice).value().layout.predictor, predictor);
  }
}

}  // namespace
}  // namespace tandem::sessions
