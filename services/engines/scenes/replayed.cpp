#include "services/engines/scenes/replayed.hpp"

#include <utility>

#include "services/engines/scenes/scene_json.hpp"

namespace tandem::scenes {

std::string replayed(const std::string& json, const Recording& recording) {
  Result<idl::Scene> scene = json.empty() ? idl::Scene() : read_json(json, "scene");
  if (!scene) return json;
  idl::Recording& told = *scene->mutable_recording();
  told.Clear();
  told.set_started_unix_ms(recording.started_unix_ms);
  told.set_length_s(recording.length_s);
  told.set_from_s(recording.from_s);
  told.set_from_frame(recording.from_frame);
  told.set_frame_rate_hz(recording.frame_rate_hz);
  for (const Recording::Event& event : recording.events) {
    idl::Recording::Event& added = *told.add_events();
    added.set_at_s(event.at_s);
    added.set_text(event.text);
  }
  if (scene->dt_s() == 0) scene->set_dt_s(1 / recording.frame_rate_hz);
  return to_json(std::move(*scene));
}

}  // namespace tandem::scenes
