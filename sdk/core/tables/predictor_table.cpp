#include "sdk/core/tables/predictor_table.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "sdk/core/predict/ballistic/ballistic.hpp"
#include "sdk/core/predict/contact/contact.hpp"
#include "sdk/core/predict/hard/hard.hpp"
#include "sdk/core/predict/rigid/rigid.hpp"

namespace tandem {
namespace {

using Made = Result<std::unique_ptr<Predictor>>;

Made make_ballistic(std::uint32_t /*capacity*/, std::span<const std::int32_t> constants) {
  if (!constants.empty()) return fail(ErrorCode::kMalformed, "predictor 'ballistic' takes no constants");
  return std::make_unique<Ballistic>();
}

Made make_contact(std::uint32_t capacity, std::span<const std::int32_t> constants) {
  return read_contact_constants(constants).map([&](ContactConstants&& read) {
    return std::unique_ptr<Predictor>(std::make_unique<Contact>(capacity, std::move(read)));
  });
}

Made make_hard(std::uint32_t capacity, std::span<const std::int32_t> constants) {
  return read_contact_constants(constants).map([&](ContactConstants&& read) {
    return std::unique_ptr<Predictor>(std::make_unique<Hard>(capacity, std::move(read)));
  });
}

Made make_rigid(std::uint32_t capacity, std::span<const std::int32_t> constants) {
  return read_rigid_constants(constants).map([&](RigidConstants&& read) {
    return std::unique_ptr<Predictor>(std::make_unique<Rigid>(capacity, std::move(read)));
  });
}

// With more bodies `field` would take a server of two cores a whole frame. (A client for which it takes too
// long plays the stream without it.)
constexpr std::uint32_t kMaxForField = 1U << 20U;
// With more bodies a trial of `hard` or `rigid` would take a large part of a frame.
constexpr std::uint32_t kMaxForTrialOfHard = 20'000, kMaxForTrialOfRigid = 4'000;
// A slot of `hard` takes 1.2 kB, and nobody can step more bodies in a frame; one of `rigid` takes 6 kB.
constexpr std::uint32_t kMaxSlotsOfHard = 1U << 18U, kMaxSlotsOfRigid = 1U << 14U;
constexpr StepWork kWorkOfContact{.plane = 1, .solid = 4, .body = 32, .each_substep = true};
constexpr StepWork kWorkOfHard{.plane = 1, .solid = 4, .body = 64};
constexpr StepWork kWorkOfRigid{.plane = 16, .solid = 32, .body = 1200};
constexpr std::uint32_t kAnyNumber = std::numeric_limits<std::uint32_t>::max();

constexpr std::array kTable{
    // Computes contacts in one step per frame, which leaves a force to learn. Bodies are corrected more
    // often, and early at 0.08: the RMS error falls by 4 % for 4 % of the bits. Decay 20 %, beta 1.2, gamma
    // 0.25.
    PredictorTraits{.name = "field",
                    .most_bodies = kMaxForField,
                    .only_spheres = true,
                    .reads_world = true,
                    .one_step = true,
                    .work = kWorkOfContact,
                    .tracker = {.hit_k = 3, .early = 5243},
                    .first_gains = {13000, 39322, 16384},
                    .gain_aim = {10, -10},
                    .make = &make_contact},
    // Contacts are predicted, so the remaining error grows more slowly, and there is no force to learn. c is
    // kept (92 %) only until it is clear whether it should be. beta 0.7, gamma 0.
    PredictorTraits{.name = "contact",
                    .most_bodies = 0,
                    .only_spheres = true,
                    .reads_world = true,
                    .work = kWorkOfContact,
                    .tracker = {.hit_k = 3},
                    .first_gains = {60000, 22938, 0},
                    .gain_aim = {},
                    .make = &make_contact},
    // For engines whose bodies hardly overlap. What the step leaves out (spin, restitution) is learned as a
    // force. Early as with `field`; decay, beta and gamma as well.
    PredictorTraits{.name = "hard",
                    .most_bodies = 0,
                    .only_spheres = true,
                    .most_on_trial = kMaxForTrialOfHard,
                    .reads_world = true,
                    .hard_contacts = true,
                    .most_slots = kMaxSlotsOfHard,
                    .work = kWorkOfHard,
                    .tracker = {.hit_k = 3, .early = 5243},
                    .first_gains = {13000, 39322, 16384},
                    .gain_aim = {10, 30},
                    .make = &make_hard},
    // For engines of bodies that turn and hardly overlap. Gains as with `ballistic`.
    PredictorTraits{.name = "rigid",
                    .most_bodies = 0,
                    .only_spheres = false,
                    .most_on_trial = kMaxForTrialOfRigid,
                    .reads_world = true,
                    .reads_shapes = true,
                    .hard_contacts = true,
                    .most_slots = kMaxSlotsOfRigid,
                    .work = kWorkOfRigid,
                    .tracker = {},
                    .first_gains = {13000, 26214, 9830},
                    .gain_aim = {},
                    .make = &make_rigid},
    // Bodies move at the start, so little of c is worth keeping: decay 20 %, beta 0.8, gamma 0.15.
    PredictorTraits{.name = "ballistic",
                    .most_bodies = kAnyNumber,
                    .only_spheres = false,
                    .reads_world = false,
                    .tracker = {},
                    .first_gains = {13000, 26214, 9830},
                    .gain_aim = {},
                    .make = &make_ballistic},
};

std::string known_names() {
  std::string text;
  for (auto each = kTable.rbegin(); each != kTable.rend(); ++each) {
    if (!text.empty()) text += ", ";
    text += each->name;
  }
  return text;
}

}  // namespace

std::span<const PredictorTraits> predictors() { return kTable; }

const PredictorTraits& basic_predictor() { return kTable.back(); }

std::vector<std::string> predictor_names() {
  std::vector<std::string> names;
  for (const PredictorTraits& each : kTable) names.insert(names.begin(), std::string(each.name));
  return names;
}

Result<const PredictorTraits*> find_predictor(std::string_view name) {
  const auto* const found = std::find_if(kTable.begin(), kTable.end(),
                                         [name](const PredictorTraits& each) { return each.name == name; });
  if (found != kTable.end()) return found;
  return fail(ErrorCode::kUnsupported,
              "unknown predictor '" + std::string(name) + "' (known: " + known_names() + ")");
}

Result<void> check_predictor(std::string_view name, std::uint32_t capacity,
                             std::span<const std::int32_t> constants) {
  const auto traits = find_predictor(name);
  if (!traits) return tl::unexpected(traits.error());
  const auto refuse = [name](const std::string& what) {
    return fail(ErrorCode::kInvalidArgument, "predictor '" + std::string(name) + "' " + what);
  };
  const std::uint32_t most = (*traits)->most_slots;
  if (capacity == 0 || capacity > most) return refuse("takes 1 to " + std::to_string(most) + " slots");
  const StepWork& work = (*traits)->work;
  const ContactCounts of = count_contact_constants(constants);
  const std::string shapes = std::to_string(of.planes + of.boxes + of.balls);
  const std::uint64_t a_slot =
      work.body + std::uint64_t{work.plane} * of.planes + std::uint64_t{work.solid} * (of.boxes + of.balls);
  const std::uint64_t all = capacity * a_slot * (work.each_substep ? of.substeps : 1);
  if (all <= kMaxStepWork) return {};
  return refuse("takes too long to step " + std::to_string(capacity) + " slots with " + shapes +
                " shapes: it takes at most " + std::to_string(kMaxStepWork * capacity / all) +
                " slots with so many. Have fewer slots or shapes, or predictor 'ballistic'");
}

Result<std::unique_ptr<Predictor>> make_predictor(std::string_view name, std::uint32_t capacity,
                                                  std::span<const std::int32_t> constants) {
  return check_predictor(name, capacity, constants).and_then([&] {
    return (*find_predictor(name))->make(capacity, constants);
  });
}

}  // namespace tandem
