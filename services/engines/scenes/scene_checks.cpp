#include "services/engines/scenes/scene_checks.hpp"

#include <algorithm>
#include <charconv>
#include <set>

#include "services/engines/scenes/convert.hpp"
#include "services/engines/scenes/scene.hpp"

namespace tandem::scenes {
namespace {

constexpr int kMaxShapes = 1000;  // every body is tested against every shape
constexpr std::uint32_t kMaxTypes = 4096;
constexpr int kMaxEvents = 100000;

using Names = std::set<std::string>;

double squared(const idl::Vec3& v) { return v.x() * v.x() + v.y() * v.y() + v.z() * v.z(); }
bool all_positive(const idl::Vec3& v) { return v.x() > 0 && v.y() > 0 && v.z() > 0; }
bool ordered(const idl::Vec3& a, const idl::Vec3& b) {
  return a.x() <= b.x() && a.y() <= b.y() && a.z() <= b.z();
}

bool is_bullet(const idl::Scene& scene) { return scene.engine() == "bullet"; }
constexpr const char* kNeedsBullet = "needs engine: \"bullet\"";

void check_shape(const Node& node, const idl::Scene& scene, const idl::BodyType& type) {
  if (type.shape_case() == idl::BodyType::SHAPE_NOT_SET) {
    node.require(type.radius_m() > 0, "radius_m", "must be above 0");
    return;
  }
  const std::string field =
      type.GetReflection()
          ->GetOneofFieldDescriptor(type, type.GetDescriptor()->FindOneofByName("shape"))
          ->name();
  node.require(is_bullet(scene), field, kNeedsBullet);
  node.require(type.radius_m() == 0, "radius_m", "must be left out, as there is a " + field);
  const auto good = engine::check(to_shape(type));
  node.require(good.has_value(), field, good ? "" : "breaks a rule: " + good.error().message);
}

void check_material(const Node& node, const idl::Material& material) {
  node.require(material.spring() >= 0, "spring", "must not be negative");
  node.require(material.damping() >= 0, "damping", "must not be negative");
  node.require(material.shear() >= 0, "shear", "must not be negative");
}

Names check_types(const Node& root, const idl::Scene& scene) {
  Names names;
  root.require(scene.types_size() >= 1 && static_cast<std::uint32_t>(scene.types_size()) <= kMaxTypes,
               "types", "needs 1 to " + std::to_string(kMaxTypes) + " entries");
  for (int i = 0; i < scene.types_size(); ++i) {
    const idl::BodyType& type = scene.types(i);
    const Node node = root.child("types", i);
    std::uint32_t ignored = 0;
    node.require(!type.name().empty() && names.insert(type.name()).second, "name",
                 "must be given and unique");
    check_shape(node, scene, type);
    node.require(type.mass_kg() > 0, "mass_kg", "must be above 0");
    node.require(read_colour(type.colour(), ignored), "colour", "must look like \"#RRGGBB\"");
    node.require(type.share() <= 1000000, "share", "must be at most 1000000");
  }
  return names;
}

void check_geometry(const Node& root, const idl::Scene& scene) {
  root.require(scene.planes_size() + scene.boxes_size() + scene.spheres_size() <= kMaxShapes, "planes",
               "and boxes and spheres together must be at most 1000");
  for (int i = 0; i < scene.planes_size(); ++i) {
    root.child("planes", i)
        .require(squared(scene.planes(i).normal()) > 1e-12, "normal", "must have a direction");
  }
  for (int i = 0; i < scene.boxes_size(); ++i) {
    const Node node = root.child("boxes", i);
    node.require(all_positive(scene.boxes(i).size()), "size", "must be above 0 along x, y and z");
    for (int t = 0; t < scene.boxes(i).turns_size(); ++t) {
      const idl::Turn& turn = scene.boxes(i).turns(t);
      const Node turn_node = node.child("turns", t);
      turn_node.require(turn.axis() == "x" || turn.axis() == "y" || turn.axis() == "z", "axis",
                        "must be \"x\", \"y\" or \"z\"");
      turn_node.require(turn.rise() * turn.rise() + turn.run() * turn.run() > 1e-12, "run",
                        "and rise must not both be 0");
    }
  }
  for (int i = 0; i < scene.spheres_size(); ++i) {
    root.child("spheres", i).require(scene.spheres(i).radius_m() > 0, "radius_m", "must be above 0");
  }
}

void check_flow(const Node& root, const idl::Scene& scene, const Names& types) {
  root.require(!is_bullet(scene) || scene.emitters_size() == 0, "emitters", "need engine: \"particles\"", 0);
  root.require(!is_bullet(scene) || scene.regions_size() == 0, "regions", "need engine: \"particles\"", 0);
  for (int i = 0; i < scene.emitters_size(); ++i) {
    const idl::Emitter& emitter = scene.emitters(i);
    const Node node = root.child("emitters", i);
    node.require(ordered(emitter.region().low(), emitter.region().high()), "region",
                 "must have low below high");
    node.require(ordered(scene.bounds().low(), emitter.region().low()) &&
                     ordered(emitter.region().high(), scene.bounds().high()),
                 "region", "must lie within the scene's bounds");
    node.require(emitter.rate_per_s() >= 0, "rate_per_s", "must not be negative");
    node.require(types.count(emitter.type()) == 1, "type", "must name one of the types");
  }
  for (int i = 0; i < scene.regions_size(); ++i) {
    const idl::Region& region = scene.regions(i);
    const Node node = root.child("regions", i);
    node.require(ordered(region.region().low(), region.region().high()), "region",
                 "must have low below high");
    node.require(region.action_case() != idl::Region::ACTION_NOT_SET, "",
                 "needs remove, teleport_by or set_type");
    node.require(region.action_case() != idl::Region::kRemove || region.remove(), "remove", "must be true");
    node.require(region.action_case() != idl::Region::kSetType || types.count(region.set_type()) == 1,
                 "set_type", "must name one of the types");
  }
}

const idl::BodyType* box_named(const idl::Scene& scene, const std::string& name) {
  const auto& types = scene.types();
  const auto found =
      std::find_if(types.begin(), types.end(), [&name](const auto& type) { return type.name() == name; });
  return found != types.end() && found->has_box() ? &*found : nullptr;
}

void check_towers(const Node& root, const idl::Scene& scene) {
  root.require(is_bullet(scene), "towers", kNeedsBullet);
  const Node node = root.child("towers");
  const idl::BodyType* type = box_named(scene, scene.towers().type());
  node.require(type != nullptr, "type", "must name a type with a box");
  node.require(scene.towers().layers() >= 1 && scene.towers().layers() <= 1000, "layers",
               "must be from 1 to 1000");
  if (type == nullptr) return;
  node.require(scene.towers().pitch_m() > std::max(type->box().x(), 3 * type->box().z()), "pitch_m",
               "must be above the width of a tower");
}

void check_rows(const Node& root, const idl::Scene& scene) {
  root.require(is_bullet(scene), "rows", kNeedsBullet);
  const Node node = root.child("rows");
  const idl::BodyType* type = box_named(scene, scene.rows().type());
  node.require(type != nullptr, "type", "must name a type with a box");
  node.require(scene.rows().length() >= 1 && scene.rows().length() <= 100000, "length",
               "must be from 1 to 100000");
  if (type == nullptr) return;
  node.require(scene.rows().pitch_m() > type->box().x(), "pitch_m", "must be above the box's edge along x");
  node.require(scene.rows().row_pitch_m() > type->box().z(), "row_pitch_m",
               "must be above the box's edge along z");
}

void check_cruising(const Node& root, const idl::Scene& scene) {
  root.require(is_bullet(scene), "cruising", kNeedsBullet);
  const Node node = root.child("cruising");
  const idl::Cruising& cruising = scene.cruising();
  node.require(cruising.radius_m() > 0, "radius_m", "must be above 0");
  node.require(cruising.min_speed() >= 0 && cruising.min_speed() <= cruising.max_speed(), "min_speed",
               "must be from 0 to max_speed");
  node.require(cruising.acceleration() >= 0, "acceleration", "must not be negative");
  node.require(cruising.return_acceleration() >= 0, "return_acceleration", "must not be negative");
  node.require(cruising.max_spin() >= 0, "max_spin", "must not be negative");
}

void check_start(const Node& root, const idl::Scene& scene) {
  const int starts = (scene.has_start() ? 1 : 0) + (scene.has_towers() ? 1 : 0) + (scene.has_rows() ? 1 : 0) +
                     (scene.has_cruising() ? 1 : 0);
  root.require(starts <= 1, "start", "and towers, rows and cruising exclude one another");
  root.require(starts == 1 || scene.emitters_size() > 0, "start", "or an emitter is needed");
  root.require(scene.spare() >= 0 && scene.spare() < 1, "spare", "must be at least 0 and below 1");
  if (scene.has_towers()) check_towers(root, scene);
  if (scene.has_rows()) check_rows(root, scene);
  if (scene.has_cruising()) check_cruising(root, scene);
  if (!scene.has_start()) return;
  const Node node = root.child("start");
  const idl::Vec3& p = scene.start().proportions();
  const double least = std::min({p.x(), p.y(), p.z()});
  const double most = std::max({p.x(), p.y(), p.z()});
  node.require(least > 0 && most <= 1000 * least, "proportions", "must be above 0 and at most 1000 to 1");
  node.require(scene.start().spacing() >= 1, "spacing", "must be at least 1");
  node.require(scene.start().jitter() >= 0 && scene.start().jitter() <= 1, "jitter", "must be from 0 to 1");
  node.require(is_bullet(scene) || !scene.start().turned(), "turned", kNeedsBullet);
}

void check_period(const Node& node, double start_s, double period_s, double jitter, double dt_s) {
  node.require(start_s >= 0, "start_s", "must not be negative");
  node.require(period_s >= dt_s, "period_s", "must be at least dt_s");
  node.require(jitter >= 0 && jitter < 1, "period_jitter", "must be at least 0 and below 1");
}

void check_script(const Node& root, const idl::Scene& scene) {
  if (!scene.has_script()) return;
  const Node node = root.child("script");
  const idl::Script& script = scene.script();
  node.require(script.events_size() <= kMaxEvents, "events", "must be at most " + std::to_string(kMaxEvents));
  for (int i = 0; i < script.events_size(); ++i) {
    const Node event = node.child("events", i);
    check_event(event, script.events(i));
    event.require(script.events(i).input_case() != idl::InputEvent::kSeekS, "seek_s",
                  "belongs into a client's script");
    event.require(is_bullet(scene) || !script.events(i).has_spawn(), "spawn", kNeedsBullet);
    event.require(is_bullet(scene) || !script.events(i).has_remove(), "remove", kNeedsBullet);
    event.require(!script.events(i).has_spawn() ||
                      static_cast<int>(script.events(i).spawn().type()) < scene.types_size(),
                  "spawn", "must name one of the types, from 0");
    node.child("events", i)
        .require(script.events(i).user() < kMaxUsers, "user", "must be below " + std::to_string(kMaxUsers));
  }
  for (int i = 0; i < script.tilting_size(); ++i) {
    const idl::Tilting& tilting = script.tilting(i);
    const Node child = node.child("tilting", i);
    check_period(child, tilting.start_s(), tilting.period_s(), tilting.period_jitter(), scene.dt_s());
    child.require(tilting.spread() >= 0, "spread", "must not be negative");
    child.require(tilting.strength() >= 0 && tilting.strength() <= 10, "strength", "must be from 0 to 10");
    child.require(tilting.send_every_s() >= 0, "send_every_s", "must not be negative");
    child.require(
        tilting.swing_s() >= 0 && tilting.swing_s() <= tilting.period_s() * (1 - tilting.period_jitter()),
        "swing_s", "must not last longer than the shortest period");
  }
  for (int i = 0; i < script.poking_size(); ++i) {
    const idl::Poking& poking = script.poking(i);
    const Node child = node.child("poking", i);
    check_period(child, poking.start_s(), poking.period_s(), poking.period_jitter(), scene.dt_s());
    child.require(ordered(poking.region().low(), poking.region().high()), "region",
                  "must have low below high");
    child.require(poking.radius_m() > 0, "radius_m", "must be above 0");
    child.require(poking.speed_m_per_s() >= 0, "speed_m_per_s", "must not be negative");
  }
}

}  // namespace

void check_event(const Node& node, const idl::InputEvent& event) {
  node.require(event.when_case() != idl::InputEvent::WHEN_NOT_SET, "", "needs time_s or frame");
  node.require(event.when_case() != idl::InputEvent::kTimeS || event.time_s() >= 0, "time_s",
               "must not be negative");
  node.require(event.when_case() != idl::InputEvent::kFrame || event.frame() >= 1, "frame",
               "must be at least 1");
  node.require(event.input_case() != idl::InputEvent::INPUT_NOT_SET, "",
               "needs gravity, push, spawn, remove or seek_s");
  node.require(event.seek_s() >= 0, "seek_s", "must not be negative");
  if (event.input_case() == idl::InputEvent::kPush) {
    node.child("push").require(event.push().radius_m() > 0, "radius_m", "must be above 0");
  }
  if (event.has_remove())
    node.child("remove").require(event.remove().radius_m() > 0, "radius_m", "must be above 0");
  if (event.has_spawn())
    node.child("spawn").require(event.spawn().type() < kMaxTypes, "type", "must be below 4096");
}

bool read_colour(const std::string& text, std::uint32_t& rgba) {
  if (text.empty()) {
    rgba = 0xB0B0B0FF;
    return true;
  }
  if (text.size() != 7 || text[0] != '#') return false;
  std::uint32_t rgb = 0;
  const char* const end = text.data() + text.size();
  const auto read = std::from_chars(text.data() + 1, end, rgb, 16);
  rgba = rgb << 8U | 0xFFU;
  return read.ec == std::errc() && read.ptr == end;
}

void check_scene(const Node& root, const idl::Scene& scene) {
  root.require_sane_numbers();
  root.require(scene.dt_s() >= 1e-6 && scene.dt_s() <= 1, "dt_s", "must be from 1e-6 to 1");
  root.require(scene.substeps() <= 64, "substeps", "must be at most " + std::to_string(kMaxUsers));
  root.require(scene.damping_per_s() >= 0 && scene.damping_per_s() * scene.dt_s() < 1, "damping_per_s",
               "must be at least 0 and below 1 / dt_s");
  root.require(scene.threshold_radii() > 0 && scene.threshold_radii() <= 10, "threshold_radii",
               "must be above 0 and at most 10");
  root.require(scene.bounds().low().x() < scene.bounds().high().x() &&
                   scene.bounds().low().y() < scene.bounds().high().y() &&
                   scene.bounds().low().z() < scene.bounds().high().z(),
               "bounds", "must have low below high along x, y and z");
  root.require(scene.engine().empty() || scene.engine() == "particles" || is_bullet(scene), "engine",
               "must be \"particles\" or \"bullet\"");
  root.require(is_bullet(scene) || !scene.has_rigid(), "rigid", kNeedsBullet);
  root.require(scene.rigid().friction() >= 0 && scene.rigid().friction() <= 10 &&
                   scene.rigid().restitution() >= 0 && scene.rigid().restitution() <= 1,
               "rigid", "must have a friction from 0 to 10 and a restitution from 0 to 1");
  root.require(scene.users() <= kMaxUsers, "users", "must be at most " + std::to_string(kMaxUsers));
  root.require(scene.has_pair(), "pair", "is missing");
  if (scene.has_pair()) check_material(root.child("pair"), scene.pair());
  if (scene.has_wall()) check_material(root.child("wall"), scene.wall());
  root.require(scene.max_gravity() >= 0 && scene.max_push() >= 0, "max_gravity",
               "and max_push must not be negative");
  root.require(scene.push_budget() >= 0, "push_budget", "must not be negative");
  root.require(scene.sleep_speed() >= 0, "sleep_speed", "must not be negative");
  const Names types = check_types(root, scene);
  check_geometry(root, scene);
  check_start(root, scene);
  check_flow(root, scene, types);
  check_script(root, scene);
  root.require(scene.script().tilting_size() == 0 || squared(scene.gravity()) > 0, "gravity",
               "must not be 0 where the script tilts it");
}

}  // namespace tandem::scenes
