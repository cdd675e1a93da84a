#include "services/engines/sessions/session_plan.hpp"

namespace tandem::sessions {
namespace {

engine::Vec3 wide(const engine::Vec3f& v) { return {v[0], v[1], v[2]}; }

Scenery::Law law_of(const engine::Material& material) {
  return {material.spring, material.damping, material.shear};
}

Scenery scenery_of(const engine::EngineWorld& world, const std::vector<engine::Plane>& walls) {
  Scenery scenery{
      .between_bodies = law_of(world.pair), .with_scenery = law_of(world.wall), .substeps = world.substeps};
  for (const engine::Plane& plane : world.planes)
    scenery.planes.push_back({wide(plane.normal), plane.offset});
  for (const engine::Plane& wall : walls) scenery.planes.push_back({wide(wall.normal), wall.offset});
  for (const engine::Box& box : world.boxes) {
    scenery.boxes.push_back(
        {wide(box.centre), wide(box.half), {wide(box.axes[0]), wide(box.axes[1]), wide(box.axes[2])}});
  }
  for (const engine::Ball& ball : world.balls) scenery.balls.push_back({wide(ball.centre), ball.radius});
  return scenery;
}

}  // namespace

planning::PlannedWorld world_of(const scenes::Scene& scene, std::uint32_t bodies) {
  planning::PlannedWorld world{.name = scene.name,
                               .scene_json = scene.json,
                               .capacity = bodies,
                               .dt_s = scene.dt_s,
                               .extent = scene.extent_m,
                               .threshold = scene.threshold_m,
                               .turns = scene.turns,
                               .up_axis = transport::UpAxis::kY,
                               .types = {},
                               .scenery = {},
                               .trained = scene.trained};
  for (const scenes::BodyType& type : scene.types) {
    world.types.push_back({.name = type.name,
                           .bounding_radius = type.bounding_radius_m,
                           .colour_rgba = type.colour_rgba,
                           .shape = static_cast<BodyShape>(type.shape.kind),
                           .shape_values = type.shape.values});
  }
  if (scene.world.types.size() != scene.types.size()) return world;  // a recorded trajectory
  for (std::size_t i = 0; i < world.types.size(); ++i) {
    world.types[i].contact_radius = scene.world.types[i].radius;
    world.types[i].mass = scene.world.types[i].mass;
  }
  world.scenery = scenery_of(scene.world, scenes::walls_of(scene, bodies));
  return world;
}

Result<host::StreamConfig> plan_stream(const scenes::Scene& scene, const SessionChoice& choice) {
  return planning::plan_stream(world_of(scene, choice.bodies), choice);
}

Result<host::HostConfig> plan_session(const scenes::Scene& scene, const SessionChoice& choice) {
  return planning::plan_session(world_of(scene, choice.bodies), choice);
}

}  // namespace tandem::sessions
