#include <algorithm>

#include "services/engines/scenes/convert.hpp"
#include "services/engines/scenes/scene_checks.hpp"
#include "services/engines/scenes/script.hpp"
#include "services/program/protobuf_text/protobuf_text.hpp"

namespace tandem::scenes {

Result<std::vector<ScriptedInput>> load_input_script(const std::string& path, double dt_s) {
  idl::InputScript file;
  google::protobuf::TextFormat::ParseInfoTree lines;
  if (auto read = protobuf_text::read_file(path, file, lines); !read) return tl::unexpected(read.error());
  Findings findings{path, {}};
  const Node root(file, &lines, "", 1, findings);
  root.require_sane_numbers();
  std::vector<ScriptedInput> result;
  for (int i = 0; i < file.inputs_size(); ++i) {
    check_event(root.child("inputs", i), file.inputs(i));
    root.child("inputs", i).require(file.inputs(i).user() == 0, "user", "belongs into a scene's script");
  }
  if (findings.first) return tl::unexpected(*findings.first);
  for (const idl::InputEvent& event : file.inputs())
    result.push_back({to_frame(event, dt_s), 0, to_input(event)});
  std::stable_sort(result.begin(), result.end(),
                   [](const ScriptedInput& a, const ScriptedInput& b) { return a.frame < b.frame; });
  return result;
}

}  // namespace tandem::scenes
