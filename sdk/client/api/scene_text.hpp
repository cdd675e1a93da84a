#pragma once
// What is drawn of a scene, read from the protobuf text (idl/scene.proto) that a session carries.

#include <array>
#include <cstddef>
#include <string_view>
#include <vector>

#include "tandem/result.hpp"

namespace tandem::api {

using Vector = std::array<double, 3>;

/// What bodies cannot pass. What its shape does not name is 0.
struct Solid {
  enum class Shape { kPlane, kBox, kSphere };
  Shape shape = Shape::kPlane;
  Vector centre{};                                ///< of a plane: a point of it
  Vector normal{};                                ///< of a plane: of norm 1
  Vector size{};                                  ///< of a box: full edges
  std::array<double, 4> orientation{0, 0, 0, 1};  ///< x, y, z, w
  double radius = 0;
};

struct SceneText {
  static constexpr std::size_t kMostSolids = 4096;  ///< of each shape

  Vector gravity{};
  double max_gravity = 0, max_push = 0;  ///< 0: not told
  Vector low{}, high{};                  ///< bounds
  std::vector<Solid> solids;             ///< planes, boxes, spheres
};

/// The text comes from the network: sizes, depths and counts are bounded. Unknown fields are skipped, fields
/// of a wrong type count as left out, planes without a normal and what is not finite are left out. Errors:
/// kMalformed, naming the line.
[[nodiscard]] Result<SceneText> read_scene_text(std::string_view text);

}  // namespace tandem::api
