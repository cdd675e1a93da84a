#pragma once
// Finds scene files. Internal to scenes.

#include <string>
#include <string_view>

#include "tandem/result.hpp"

namespace tandem::scenes {

/// Errors: kInvalidArgument for an unknown name, listing the known ones.
[[nodiscard]] Result<std::string> find_scene_file(std::string_view name_or_path);

/// "half_pipe" for ".../half_pipe.textproto".
[[nodiscard]] std::string scene_name_of(const std::string& path);

}  // namespace tandem::scenes
