#include "services/engines/scenes/scene.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <utility>

#include "services/engines/bullet/bullet.hpp"
#include "services/engines/common/check.hpp"
#include "services/engines/particles/particles.hpp"
#include "services/engines/scenes/convert.hpp"
#include "services/engines/scenes/directory.hpp"
#include "services/engines/scenes/random.hpp"
#include "services/engines/scenes/scene_checks.hpp"
#include "services/engines/scenes/scene_json.hpp"
#include "services/engines/scenes/start_block.hpp"
#include "services/program/protobuf_text/protobuf_text.hpp"

namespace tandem::scenes {
namespace {

using engine::Vec3;
using engine::Vec3f;

double dot(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

engine::Material to_material(const idl::Material& m) {
  return {static_cast<float>(m.spring()), static_cast<float>(m.damping()), static_cast<float>(m.shear())};
}

engine::Plane to_plane(const idl::Plane& plane) {
  const Vec3 normal = normalised(to_vec3(plane.normal()), {0, 1, 0});
  return {to_float(normal), static_cast<float>(dot(normal, to_vec3(plane.through())))};
}

engine::Box to_box(const idl::Box& box) {
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  // a column an axis of the box
  for (const idl::Turn& turn : box.turns()) {
    // Uses rise and run instead of an angle, because the last bits of sine and cosine differ between
    // mathematics libraries.
    const Eigen::Vector2d direction = Eigen::Vector2d(turn.run(), turn.rise()).normalized();
    const int about = turn.axis() == "x" ? 0 : turn.axis() == "y" ? 1 : 2;
    const int b = (about + 1) % 3;
    const int c = (about + 2) % 3;
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    rotation(b, b) = rotation(c, c) = direction.x();
    rotation(c, b) = direction.y();
    rotation(b, c) = -direction.y();
    axes = rotation * axes;
  }
  engine::Box result;
  result.centre = to_float(box.centre());
  const Vec3 size = to_vec3(box.size());
  result.half = to_float(Vec3{size[0] / 2, size[1] / 2, size[2] / 2});
  for (int i = 0; i < 3; ++i)
    Eigen::Vector3f::Map(result.axes[static_cast<std::size_t>(i)].data()) = axes.col(i).cast<float>();
  return result;
}

std::uint16_t type_named(const Scene& scene, const std::string& name) {
  const auto found = std::find_if(scene.types.begin(), scene.types.end(),
                                  [&](const BodyType& type) { return type.name == name; });
  return static_cast<std::uint16_t>(found - scene.types.begin());
}

engine::Region to_region(const Scene& scene, const idl::Region& region) {
  engine::Region result;
  result.low = to_float(region.region().low());
  result.high = to_float(region.region().high());
  if (region.action_case() == idl::Region::kTeleportBy) {
    result.action = engine::Region::Action::kTeleport;
    result.offset = to_float(region.teleport_by());
  } else if (region.action_case() == idl::Region::kSetType) {
    result.action = engine::Region::Action::kSetType;
    result.type = type_named(scene, region.set_type());
  }
  return result;
}

void read_types(const idl::Scene& file, Scene& scene) {
  for (const idl::BodyType& type : file.types()) {
    BodyType read{.name = type.name(),
                  .radius_m = type.radius_m(),
                  .bounding_radius_m = type.radius_m(),
                  .mass_kg = type.mass_kg(),
                  .share = type.share(),
                  .shape = to_shape(type)};
    (void)read_colour(type.colour(), read.colour_rgba);  // checked before
    if (read.shape.kind != engine::Shape::Kind::kSphere) {
      read.radius_m = engine::inner_radius(read.shape);
      read.bounding_radius_m = engine::bounding_radius(read.shape);
    }
    scene.world.types.push_back({static_cast<float>(read.radius_m), static_cast<float>(type.mass_kg())});
    scene.types.push_back(std::move(read));
  }
  scene.smallest_radius_m =
      std::min_element(scene.types.begin(), scene.types.end(), [](const BodyType& a, const BodyType& b) {
        return a.radius_m < b.radius_m;
      })->radius_m;
  scene.threshold_m = file.threshold_radii() * scene.smallest_radius_m;
}

void read_world(const idl::Scene& file, Scene& scene) {
  engine::EngineWorld& world = scene.world;
  world.dt_s = static_cast<float>(file.dt_s());
  world.substeps = std::max(file.substeps(), 1U);
  world.gravity = to_float(file.gravity());
  world.sleep_speed = static_cast<float>(file.sleep_speed());
  world.damping_per_s = static_cast<float>(file.damping_per_s());
  world.low = to_float(file.bounds().low());
  world.high = to_float(file.bounds().high());
  world.pair = to_material(file.pair());
  world.wall = file.has_wall() ? to_material(file.wall()) : world.pair;
  for (const idl::Plane& plane : file.planes()) world.planes.push_back(to_plane(plane));
  for (const idl::Box& box : file.boxes()) world.boxes.push_back(to_box(box));
  for (const idl::Sphere& sphere : file.spheres()) {
    world.balls.push_back({to_float(sphere.centre()), static_cast<float>(sphere.radius_m())});
  }
  for (const idl::Emitter& emitter : file.emitters()) {
    world.emitters.push_back({to_float(emitter.region().low()), to_float(emitter.region().high()),
                              to_float(emitter.velocity()), emitter.rate_per_s(),
                              type_named(scene, emitter.type())});
  }
  for (const idl::Region& region : file.regions()) world.regions.push_back(to_region(scene, region));
  const double gravity = std::sqrt(dot(scene.gravity, scene.gravity));
  world.max_gravity = file.max_gravity() > 0 ? file.max_gravity() : 10 * std::max(gravity, 1.0);
  world.max_push = file.max_push() > 0 ? file.max_push() : 100 * scene.smallest_radius_m;
  world.push_budget =
      file.push_budget() > 0 ? file.push_budget() : engine::kDefaultPushBudget * world.max_push;
  for (const idl::Vec3& corner : {file.bounds().low(), file.bounds().high()}) {
    for (const double v : to_vec3(corner)) scene.extent_m = std::max(scene.extent_m, std::fabs(v));
  }
}

void read_script(const idl::Script& script, Scene& scene) {
  for (const idl::InputEvent& event : script.events()) {
    scene.events.push_back({to_frame(event, scene.dt_s), event.user(), to_input(event)});
  }
  for (const idl::Tilting& t : script.tilting()) {
    scene.tilting.push_back({t.start_s(), t.period_s(), t.period_jitter(), t.spread(), t.swing_s(),
                             t.send_every_s(), t.strength() > 0 ? t.strength() : 1, t.turn_over()});
  }
  for (const idl::Poking& p : script.poking()) {
    scene.poking.push_back({p.start_s(), p.period_s(), p.period_jitter(), to_vec3(p.region().low()),
                            to_vec3(p.region().high()), p.radius_m(), p.speed_m_per_s()});
  }
}

void read_start(const idl::Scene& file, Scene& scene) {
  scene.spare = file.spare();
  if (file.has_start()) {
    scene.start = StartBlock{to_vec3(file.start().base()),
                             to_vec3(file.start().proportions()),
                             to_vec3(file.start().velocity()),
                             file.start().spacing(),
                             file.start().jitter(),
                             file.start().turned(),
                             file.start().walled()};
  }
  if (file.has_towers()) {
    const idl::Towers& towers = file.towers();
    scene.towers =
        Towers{to_vec3(towers.base()), type_named(scene, towers.type()), towers.layers(), towers.pitch_m()};
  }
  if (file.has_rows()) {
    const idl::Rows& rows = file.rows();
    scene.rows = Rows{to_vec3(rows.base()), type_named(scene, rows.type()), rows.length(), rows.pitch_m(),
                      rows.row_pitch_m()};
  }
  if (file.has_cruising()) {
    const idl::Cruising& c = file.cruising();
    scene.cruising = Cruising{c.radius_m(),     c.min_speed(),           c.max_speed(),
                              c.acceleration(), c.return_acceleration(), c.max_spin()};
  }
}

Scene to_scene(const idl::Scene& file, const std::string& path) {
  Scene scene;
  scene.name = scene_name_of(path);
  scene.path = path;
  scene.number = file.number();
  scene.description = file.description();
  idl::Scene drawn = file;
  drawn.clear_script();
  drawn.clear_recording();
  google::protobuf::TextFormat::PrintToString(drawn, &scene.text);
  scene.json = to_json(std::move(drawn));
  scene.dt_s = file.dt_s();
  scene.damping_per_s = file.damping_per_s();
  scene.gravity = to_vec3(file.gravity());
  scene.users = std::max(file.users(), 1U);
  scene.engine = file.engine() == "bullet" ? EngineKind::kBullet : EngineKind::kParticles;
  scene.turns = scene.engine == EngineKind::kBullet;
  scene.friction = static_cast<float>(file.rigid().friction());
  scene.restitution = static_cast<float>(file.rigid().restitution());
  read_types(file, scene);
  read_world(file, scene);
  read_start(file, scene);
  read_script(file.script(), scene);
  return scene;
}

std::uint32_t filled(const Scene& scene, std::uint32_t bodies) {
  return bodies - static_cast<std::uint32_t>(scene.spare * bodies);
}

// `lines`: where the file's fields are; null if that is not known.
Result<Scene> checked_scene(const idl::Scene& file, google::protobuf::TextFormat::ParseInfoTree* lines,
                            const std::string& path) {
  Findings findings{path, {}};
  check_scene(Node(file, lines, "", 1, findings), file);
  if (findings.first) return tl::unexpected(*findings.first);
  return to_scene(file, path);
}

Result<Scene> read_scene(const std::string& path) {
  idl::Scene file;
  google::protobuf::TextFormat::ParseInfoTree lines;
  if (auto done = protobuf_text::read_file(path, file, lines); !done) return tl::unexpected(done.error());
  auto scene = checked_scene(file, &lines, path);
  if (!scene) return scene;
  return load_trained(path).transform([&](std::vector<TrainedTable> tables) {
    scene->trained = std::move(tables);
    return std::move(*scene);
  });
}

}  // namespace

Result<Scene> load_scene(std::string_view name_or_path) {
  return find_scene_file(name_or_path).and_then(read_scene);
}

Result<Scene> parse_scene(const std::string& json, const std::string& source) {
  return read_json(json, source).and_then([&](const idl::Scene& scene) {
    return checked_scene(scene, nullptr, source);
  });
}

Result<engine::EngineWorld> make_world(const Scene& scene, std::uint32_t bodies, std::uint64_t seed) {
  if (bodies == 0 || bodies > engine::kMaxBodies) {
    return fail(ErrorCode::kInvalidArgument, "number of bodies must be 1 to " +
                                                 std::to_string(engine::kMaxBodies) + ", not " +
                                                 std::to_string(bodies));
  }
  engine::EngineWorld world = scene.world;
  world.capacity = bodies;
  world.seed = seed;
  if (scene.start) world.start = fill_block(scene, filled(scene, bodies), seed);
  for (const engine::Plane& wall : walls_of(scene, bodies)) world.planes.push_back(wall);
  return world;
}

std::vector<engine::Plane> walls_of(const Scene& scene, std::uint32_t bodies) {
  if (!scene.start || !scene.start->walled) return {};
  return walls_around(scene, filled(scene, bodies));
}

Result<engine::RigidWorld> make_rigid_world(const Scene& scene, std::uint32_t bodies, std::uint64_t seed) {
  return make_world(scene, bodies, seed)
      .and_then([&](engine::EngineWorld&& world) -> Result<engine::RigidWorld> {
        engine::RigidWorld rigid;
        rigid.world = std::move(world);
        rigid.friction = scene.friction;
        rigid.restitution = scene.restitution;
        for (const BodyType& type : scene.types) rigid.shapes.push_back(type.shape);
        const auto place = [&rigid](RigidStart start) {
          rigid.world.start = std::move(start.bodies);
          rigid.orientation = std::move(start.orientation);
          rigid.spin = std::move(start.spin);
        };
        if (scene.towers) place(fill_towers(scene, filled(scene, bodies), seed));
        if (scene.rows) place(fill_rows(scene, filled(scene, bodies), seed));
        if (scene.cruising) {
          rigid.cruise = cruise_of(scene, bodies, seed);
          if (static_cast<double>(rigid.cruise->radius) > scene.extent_m)
            return fail(ErrorCode::kInvalidArgument, "the ball of its bodies reaches outside the bounds");
          place(fill_ball(scene, *rigid.cruise, filled(scene, bodies), seed));
        }
        if (scene.start && scene.start->turned)
          rigid.orientation = turn_at_random(filled(scene, bodies), seed);
        return rigid;
      });
}

Result<std::unique_ptr<engine::Simulation>> make_simulation(const Scene& scene, std::uint32_t bodies,
                                                            std::uint64_t seed, std::uint32_t threads) {
  auto made = scene.engine == EngineKind::kBullet
                  ? make_rigid_world(scene, bodies, seed).and_then(engine::make_bullet)
                  : make_world(scene, bodies, seed).and_then([&](const engine::EngineWorld& world) {
                      return engine::make_particles(world, threads);
                    });
  if (made) return made;
  return fail(made.error().code,
              "scene " + scene.name + " with " + std::to_string(bodies) + " bodies: " + made.error().message);
}

}  // namespace tandem::scenes
