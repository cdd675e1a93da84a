#include "services/engines/scenes/scene_json.hpp"

#include <google/protobuf/util/json_util.h>

#include <cmath>
#include <vector>

namespace tandem::scenes {
namespace {

namespace pb = google::protobuf;

void clear_what_is_not_finite(pb::Message& message) {
  const pb::Reflection& values = *message.GetReflection();
  std::vector<const pb::FieldDescriptor*> present;
  values.ListFields(message, &present);
  for (const pb::FieldDescriptor* field : present) {
    if (field->cpp_type() == pb::FieldDescriptor::CPPTYPE_DOUBLE) {
      if (!std::isfinite(values.GetDouble(message, field))) values.ClearField(&message, field);
    } else if (field->cpp_type() == pb::FieldDescriptor::CPPTYPE_MESSAGE) {
      const int count = field->is_repeated() ? values.FieldSize(message, field) : 1;
      for (int i = 0; i < count; ++i)
        clear_what_is_not_finite(*(field->is_repeated() ? values.MutableRepeatedMessage(&message, field, i)
                                                        : values.MutableMessage(&message, field)));
    }
  }
}

}  // namespace

std::string to_json(idl::Scene scene) {
  clear_what_is_not_finite(scene);
  std::string json;
  if (!pb::util::MessageToJsonString(scene, &json).ok()) json.clear();
  return json;
}

Result<idl::Scene> read_json(const std::string& json, const std::string& source) {
  idl::Scene scene;
  pb::util::JsonParseOptions options;
  options.ignore_unknown_fields = true;
  if (const auto read = pb::util::JsonStringToMessage(json, &scene, options); !read.ok())
    return fail(ErrorCode::kMalformed, source + ": " + std::string(read.message()));
  return scene;
}

}  // namespace tandem::scenes
