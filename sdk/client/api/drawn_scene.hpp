#pragma once
// The parts of a scene that are drawn, read from the JSON (idl/scene.proto) that a session carries.

#include <array>
#include <cstddef>
#include <string_view>
#include <vector>

#include "tandem/result.hpp"

namespace tandem::api {

using Vector = std::array<double, 3>;

/// A solid that bodies cannot pass. Fields that its shape does not use are 0.
struct Solid {
  enum class Shape { kPlane, kBox, kSphere };
  Shape shape = Shape::kPlane;
  Vector centre{};                                ///< centre; for a plane: any point on it
  Vector normal{};                                ///< plane: norm 1
  Vector size{};                                  ///< box: full edge lengths
  std::array<double, 4> orientation{0, 0, 0, 1};  ///< x, y, z, w
  double radius = 0;
};

struct DrawnScene {
  static constexpr std::size_t kMaxSolids = 4096;  ///< maximum for each shape

  Vector gravity{};
  double max_gravity = 0, max_push = 0;  ///< 0: unknown
  Vector low{}, high{};                  ///< bounds
  std::vector<Solid> solids;             ///< planes, boxes, spheres
};

/// Reads the JSON; the empty text is an empty scene. It comes from the network: size, depth and counts are
/// bounded. Unknown members are ignored. Values of a wrong type, planes without a normal and numbers that are
/// not finite are left out; of members of one name the last counts. Errors: kMalformed, naming the line.
[[nodiscard]] Result<DrawnScene> read_scene_json(std::string_view json);

}  // namespace tandem::api
