#include "services/engines/scenes/directory.hpp"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <set>
#include <vector>

#include "services/engines/scenes/scene.hpp"

namespace tandem::scenes {
namespace {

namespace fs = std::filesystem;
constexpr std::string_view kEnding = ".textproto";
constexpr std::string_view kTrainedEnding = ".trained.textproto";

std::vector<fs::path> directories() {
  if (const char* chosen = std::getenv("TANDEM_SCENE_DIR"); chosen != nullptr && *chosen != '\0')
    return {chosen};
  return {TANDEM_SCENE_INSTALL_DIR, TANDEM_SCENE_SOURCE_DIR};
}

}  // namespace

std::vector<std::string> scene_names() {
  std::set<std::string> names;
  for (const fs::path& directory : directories()) {
    std::error_code ignored;
    for (const auto& entry : fs::directory_iterator(directory, ignored)) {
      const std::string file = entry.path().filename().string();
      if (file.ends_with(kEnding) && !file.ends_with(kTrainedEnding)) names.insert(scene_name_of(file));
    }
  }
  return {names.begin(), names.end()};
}

Result<std::string> find_scene_file(std::string_view name_or_path) {
  const std::string wanted(name_or_path);
  if (wanted.find('/') != std::string::npos || wanted.ends_with(kEnding)) return wanted;
  for (const fs::path& directory : directories()) {
    const fs::path file = directory / (wanted + std::string(kEnding));
    std::error_code ignored;
    if (!wanted.empty() && fs::is_regular_file(file, ignored)) return file.string();
  }
  std::string known;
  for (const std::string& name : scene_names()) known += (known.empty() ? "" : ", ") + name;
  return fail(ErrorCode::kInvalidArgument, "unknown scene \"" + wanted +
                                               "\"; known: " + (known.empty() ? "none" : known) +
                                               " (or give the path of a .textproto file)");
}

std::string scene_name_of(const std::string& path) {
  std::string name = fs::path(path).filename().string();
  if (name.ends_with(kEnding)) name.resize(name.size() - kEnding.size());
  return name;
}

}  // namespace tandem::scenes
