#pragma once
// Inputs that nobody has to type: of a scene's scripted users, and from input script files.

#include <cstdint>
#include <string>
#include <vector>

#include "services/host/simulation.hpp"
#include "tandem/result.hpp"

namespace tandem::scenes {

struct Scene;

struct ScriptedInput {
  std::uint64_t frame = 1;  ///< acts in the step that produces this frame
  std::uint32_t user = 0;
  engine::Input input;
};

/// What `users` users of the scene do up to frame `frames`, ascending by frame, then by user. The same for a
/// seed on every machine; a larger `frames` only appends. `users` 0 means as many as the scene says.
[[nodiscard]] std::vector<ScriptedInput> scripted_inputs(const Scene& scene, std::uint64_t seed,
                                                         std::uint32_t users, std::uint64_t frames);

/// Reads an input script (InputScript in idl/scene.proto); frames count from the first that the client
/// applies, 1 is the first. Ascending by frame; events of one frame keep their order. Errors: kIo, kMalformed
/// with file, line and field. Values are checked to be finite; the server decides whether they are in range.
[[nodiscard]] Result<std::vector<ScriptedInput>> load_input_script(const std::string& path, double dt_s);

}  // namespace tandem::scenes
