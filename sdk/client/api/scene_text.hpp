#pragma once
// The parts of a scene that are drawn, read from the protobuf text (idl/scene.proto) that a session carries.

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

struct SceneText {
  static constexpr std::size_t kMaxSolids = 4096;  ///< maximum for each shape

  Vector gravity{};
  double max_gravity = 0, max_push = 0;  ///< 0: unknown
  Vector low{}, high{};                  ///< bounds
  std::vector<Solid> solids;             ///< planes, boxes, spheres
};

/// Reads the text. It comes from the network: sizes, depths and counts are bounded. Unknown fields are
/// skipped. Fields of a wrong type, planes without a normal and values that are not finite are left out.
/// Errors: kMalformed, naming the line.
[[nodiscard]] Result<SceneText> read_scene_text(std::string_view text);

}  // namespace tandem::api
