#pragma once
// A world as streams see it: what bodies are, how far they go, and what they meet.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "services/planning/trained_table.hpp"
#include "tandem/body_shape.hpp"
#include "tandem/scenery.hpp"

namespace tandem::planning {

/// Lengths in scene units.
struct BodyType {
  std::string name = {};
  double bounding_radius = 0;  ///< of the sphere around it
  double contact_radius = 0;   ///< of the sphere that predictors of contacts take it for
  double mass = 1;
  std::uint32_t colour_rgba = 0xFFFFFFFF;
  BodyShape shape = BodyShape::kSphere;
  std::vector<float> shape_values = {};
};

struct World {
  std::string name = {};         ///< to show
  std::string description = {};  ///< for clients to draw: protobuf text of idl/scene.proto
  std::uint32_t capacity = 0;
  double dt_s = 0;
  double extent = 0;     ///< largest |coordinate|
  double threshold = 0;  ///< error threshold where nobody wishes another
  bool turns = false;    ///< bodies have orientations
  std::vector<BodyType> types = {};
  std::optional<Scenery> scenery = {};     ///< empty: contacts cannot be predicted
  std::vector<TrainedTable> trained = {};  ///< of the paper's codecs
};

}  // namespace tandem::planning
