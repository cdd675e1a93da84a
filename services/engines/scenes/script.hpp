#pragma once
// Scripted inputs of a scene's users, and of input script files.

#include <cstdint>
#include <string>
#include <vector>

#include "services/engines/scenes/random.hpp"
#include "tandem/result.hpp"
#include "tandem/simulation.hpp"

namespace tandem::scenes {

struct Scene;
struct Tilting;
struct Poking;

struct ScriptedInput {
  std::uint64_t frame = 1;  ///< acts in the step that produces this frame
  std::uint32_t user = 0;
  engine::Input input;
};

/// The inputs of `users` users of the scene, frame by frame, for as long as a session lasts. A seed gives the
/// same inputs on every machine. `users` 0 stands for the scene's number. Memory does not grow with the
/// frames. Not thread-safe.
class Script {
 public:
  /// `scene` must outlive the script.
  Script(const Scene& scene, std::uint64_t seed, std::uint32_t users);

  /// All inputs that act after the frame of the last call and up to `frame`, ascending by frame, then by
  /// user.
  [[nodiscard]] std::vector<ScriptedInput> until(std::uint64_t frame);
  /// Inputs made already that act on later frames.
  [[nodiscard]] std::size_t pending() const { return pending_.size(); }

 private:
  struct Pending {
    std::size_t rank = 0;  // of its routine: the order within a frame and user
    ScriptedInput input;
  };
  // One user's tilting or poking: the time of the next action, and what it depends on.
  struct Routine {
    std::uint32_t user = 0;
    std::size_t rank = 0;
    const Tilting* tilting = nullptr;  // either this
    const Poking* poking = nullptr;    // or that
    double next_s = 0;
    Random random{0};
    engine::Vec3 held{};  // the gravity of before
    bool over = false;
  };
  void act(const Routine& routine, double time_s, engine::Input input);
  void tilt(Routine& routine);
  void poke(Routine& routine);

  const Scene* scene_;
  std::vector<Routine> routines_;  // ascending by rank
  std::vector<Pending> pending_;   // in no order
};

/// All of a script up to frame `frames`.
[[nodiscard]] std::vector<ScriptedInput> scripted_inputs(const Scene& scene, std::uint64_t seed,
                                                         std::uint32_t users, std::uint64_t frames);

/// Reads an input script (InputScript in idl/scene.proto); frames count from the first that the client
/// applies, 1 is the first. Ascending by frame; events of one frame keep their order. Errors: kIo, kMalformed
/// with file, line and field. Values are checked to be finite; the server decides whether they are in range.
[[nodiscard]] Result<std::vector<ScriptedInput>> load_input_script(const std::string& path, double dt_s);

}  // namespace tandem::scenes
