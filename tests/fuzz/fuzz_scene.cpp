// Any text as a scene: refused naming the file, or it makes a world that steps.

#include "services/engines/scenes/scene.hpp"
#include "tests/fuzz/scratch_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const tandem::fuzz::ScratchFolder folder;
  const std::string path = folder.put("any.textproto", {data, size});
  const auto scene = tandem::scenes::load_scene(path);
  if (!scene) {
    if (scene.error().message.find("any.textproto") == std::string::npos) std::abort();
    return 0;
  }
  const auto simulation = tandem::scenes::make_simulation(*scene, 3, 1, 1);
  if (!simulation) return 0;
  for (int frame = 0; frame < 2; ++frame) (*simulation)->step();
  return 0;
}
