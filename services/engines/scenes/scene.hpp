#pragma once
// Scenes as the services see them: plain values, read from protobuf text.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "services/engines/bullet/world.hpp"
#include "services/engines/common/shape.hpp"
#include "services/engines/common/world.hpp"
#include "services/engines/scenes/script.hpp"
#include "services/engines/scenes/trained.hpp"
#include "tandem/result.hpp"
#include "tandem/simulation.hpp"

namespace tandem::scenes {

inline constexpr std::uint32_t kMaxUsers = 64;

struct BodyType {
  std::string name;
  double radius_m = 0;           ///< for a shape that is not a sphere, half of its minimum extent
  double bounding_radius_m = 0;  ///< of the sphere around it
  double mass_kg = 0;
  std::uint32_t colour_rgba = 0;  ///< 0xRRGGBBAA
  std::uint32_t share = 0;        ///< of the start block, relative to the others
  engine::Shape shape;
};

/// A block of bodies; see StartBlock in idl/scene.proto.
struct StartBlock {
  engine::Vec3 base{}, proportions{1, 1, 1}, velocity{};
  double spacing = 1, jitter = 0;
  bool turned = false, walled = false;
};

/// See Towers in idl/scene.proto.
struct Towers {
  engine::Vec3 base{};
  std::uint16_t type = 0;
  std::uint32_t layers = 1;
  double pitch_m = 1;
};

/// See Rows in idl/scene.proto.
struct Rows {
  engine::Vec3 base{};
  std::uint16_t type = 0;
  std::uint32_t length = 1;
  double pitch_m = 1, row_pitch_m = 1;
};

/// See Cruising in idl/scene.proto.
struct Cruising {
  double radius_m = 1, min_speed = 0, max_speed = 0, acceleration = 0, return_acceleration = 0, max_spin = 0;
};

enum class EngineKind : std::uint8_t { kParticles, kBullet };

/// See Tilting in idl/scene.proto.
struct Tilting {
  double start_s = 0, period_s = 1, period_jitter = 0, spread = 0, swing_s = 0, send_every_s = 0,
         strength = 1;
  bool turn_over = false;
};

/// See Poking in idl/scene.proto.
struct Poking {
  double start_s = 0, period_s = 1, period_jitter = 0;
  engine::Vec3 low{}, high{};
  double radius_m = 0, speed_m_per_s = 0;
};

struct Scene {
  std::string name;
  std::string path;
  std::uint32_t number = 0;  ///< number in the thesis's tables; 0: none
  std::string description;
  std::string text;  ///< the scene without its script as protobuf text, for a scene file
  std::string json;  ///< the same in protobuf's JSON mapping, for clients that draw it
  double dt_s = 0;
  double damping_per_s = 0;
  engine::Vec3 gravity{};
  double smallest_radius_m = 0;
  double threshold_m = 0;  ///< error threshold
  double extent_m = 0;     ///< maximum |coordinate| within the bounds
  std::uint32_t users = 1;
  bool turns = false;  ///< bodies have orientations: engine::Bodies::orientation
  std::vector<BodyType> types;
  std::vector<TrainedTable> trained;

  EngineKind engine = EngineKind::kParticles;
  engine::EngineWorld world;  ///< all but capacity, seed and start
  float friction = 0, restitution = 0;
  /// At most one of the four; none: all slots start empty.
  std::optional<StartBlock> start;
  std::optional<Towers> towers;
  std::optional<Rows> rows;
  std::optional<Cruising> cruising;
  double spare = 0;  ///< share of the slots that start empty
  std::vector<ScriptedInput> events;
  std::vector<Tilting> tilting;
  std::vector<Poking> poking;
};

/// Names of the scenes that load_scene() finds, sorted.
[[nodiscard]] std::vector<std::string> scene_names();

/// Loads a scene by name, or by path when `name_or_path` holds a '/' or ends in ".textproto". Checks
/// everything. Errors: kInvalidArgument for an unknown name (lists the known ones), kIo, kMalformed with
/// file, line and field.
[[nodiscard]] Result<Scene> load_scene(std::string_view name_or_path);
/// Reads a scene from the JSON that a session announces, without trained tables. `source` names it in errors.
/// Errors: kMalformed.
[[nodiscard]] Result<Scene> parse_scene(const std::string& json, const std::string& source);

/// The scene's simulation with `bodies` slots at frame 0. The number of bodies only changes how far the scene
/// is filled. Errors: kInvalidArgument (bodies 0, above the limit or more than the scene's bounds hold;
/// threads), kUnsupported for an engine that was not built.
[[nodiscard]] Result<std::unique_ptr<engine::Simulation>> make_simulation(const Scene& scene,
                                                                          std::uint32_t bodies,
                                                                          std::uint64_t seed,
                                                                          std::uint32_t threads);

/// The walls around the start block, which grow with it; empty if it has none.
[[nodiscard]] std::vector<engine::Plane> walls_of(const Scene& scene, std::uint32_t bodies);

/// The worlds make_simulation() runs, for tests and tools: of particles, and of rigid bodies. Errors:
/// kInvalidArgument for the number of bodies.
[[nodiscard]] Result<engine::EngineWorld> make_world(const Scene& scene, std::uint32_t bodies,
                                                     std::uint64_t seed);
[[nodiscard]] Result<engine::RigidWorld> make_rigid_world(const Scene& scene, std::uint32_t bodies,
                                                          std::uint64_t seed);

}  // namespace tandem::scenes
