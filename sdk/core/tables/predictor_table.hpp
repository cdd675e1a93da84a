#pragma once
// The table of predictors: what other code has to know about a predictor, by its name.

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sdk/core/layout/tracker_kind.hpp"
#include "sdk/core/predict/predictor.hpp"
#include "tandem/result.hpp"

namespace tandem {

/// The decay and gains of the first frame, as in StreamParameters. They suit most scenes.
struct FirstGains {
  std::uint16_t decay = 0, beta = 0, gamma = 0;
};

/// Mean cosines (see GainEvidence), in 1/100, at which a stream needs the fewest bits. They are not 0,
/// because corrections come late, when a body is beyond the threshold, or early, where the encoder likes to
/// be.
struct GainAim {
  std::int32_t agreement = 25;
  std::int32_t forwardness = 20;
};

/// The work of a step in its worst state, in about 10 ns of a server's core: `body` for each slot, and
/// `plane` and `solid` (a box or a ball) for each slot and shape; with `each_substep`, as often as there are
/// sub-steps. idl/PROTOCOL.md, "Predicted step".
struct StepWork {
  std::uint32_t plane = 0, solid = 0, body = 0;
  bool each_substep = false;
};
/// Maximum work of a step that a stream may announce.
inline constexpr std::uint64_t kMaxStepWork = 60'000'000;

/// The properties of a predictor. A new predictor needs a line in predictor_table.cpp and a folder with its
/// step.
struct PredictorTraits {
  std::string_view name;
  /// `--predictor auto` chooses this predictor for worlds with at most this many bodies; 0: never. With
  /// `only_spheres` they must be spheres of about one size, because others cost it more than it gains.
  std::uint32_t most_bodies = 0;
  bool only_spheres = false;
  /// With `auto` a server also measures this one in worlds with at most this many bodies, and offers it if it
  /// pays; 0: never. With `only_spheres` the bodies must be such spheres, otherwise others.
  std::uint32_t most_on_trial = 0;
  /// Its constants are the world's geometry and materials (ContactConstants); otherwise it has none.
  bool reads_world = false;
  /// Its constants are those for one step per frame: in_one_step().
  bool one_step = false;
  /// Its constants are RigidConstants, and its streams list the group `orientation`.
  bool reads_shapes = false;
  /// Its streams list ContactParameters, which the server learns.
  bool hard_contacts = false;
  /// Maximum number of slots.
  std::uint32_t most_slots = kMaxCapacity;
  StepWork work = {};
  TrackerKind tracker;
  FirstGains first_gains;
  GainAim gain_aim;
  /// Makes the predictor, as make_predictor(); `capacity` was checked.
  Result<std::unique_ptr<Predictor>> (*make)(std::uint32_t capacity, std::span<const std::int32_t> constants);
};

/// The predictors of this build. The first has the fewest bits in worlds that suit it; the last,
/// basic_predictor(), suits any world.
[[nodiscard]] std::span<const PredictorTraits> predictors();

/// The last of predictors().
[[nodiscard]] const PredictorTraits& basic_predictor();

/// The names of predictors(), the basic one first.
[[nodiscard]] std::vector<std::string> predictor_names();

/// Finds a predictor by name. Errors: kUnsupported, naming the predictors that there are.
[[nodiscard]] Result<const PredictorTraits*> find_predictor(std::string_view name);

/// Checks what nobody has to allocate for: that there is such a predictor, and that it can step so many slots
/// with these constants in time. Errors: kUnsupported for a name that this build does not know,
/// kInvalidArgument for too many slots, or too many shapes for them.
[[nodiscard]] Result<void> check_predictor(std::string_view name, std::uint32_t capacity,
                                           std::span<const std::int32_t> constants);

/// Makes the predictor that a session names, with the session's constants. Errors: those of
/// check_predictor(), and kMalformed for constants that do not fit it.
[[nodiscard]] Result<std::unique_ptr<Predictor>> make_predictor(std::string_view name, std::uint32_t capacity,
                                                                std::span<const std::int32_t> constants);

}  // namespace tandem
