#pragma once
// A world as streams need it: its bodies, its size, and what bodies meet.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sdk/wire/messages.hpp"
#include "services/host/planning/trained_table.hpp"
#include "tandem/body_shape.hpp"
#include "tandem/scenery.hpp"

namespace tandem::planning {

/// A type of bodies. Lengths are in scene units.
struct BodyType {
  std::string name = {};
  double bounding_radius = 0;  ///< radius of the sphere around the body
  double contact_radius = 0;   ///< radius of the sphere that stands for the body in contacts
  double mass = 1;
  std::uint32_t colour_rgba = 0xFFFFFFFF;
  BodyShape shape = BodyShape::kSphere;
  std::vector<float> shape_values = {};
};

struct PlannedWorld {
  std::string name = {};        ///< a name to display
  std::string scene_json = {};  ///< what clients draw: see SessionMessage::scene_json; empty: the scenery
  std::uint32_t capacity = 0;
  double dt_s = 0;
  double extent = 0;     ///< maximum |coordinate|
  double threshold = 0;  ///< error threshold unless the operator wishes another
  bool turns = false;    ///< bodies have orientations
  WorldFeatures tells = {};
  transport::UpAxis up_axis = transport::UpAxis::kY;
  std::vector<BodyType> types = {};
  std::optional<Scenery> scenery = {};     ///< empty: contacts cannot be predicted
  std::vector<TrainedTable> trained = {};  ///< tables of the thesis's codecs
};

}  // namespace tandem::planning
