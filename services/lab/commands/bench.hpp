#pragma once
// The subcommands of `tandem bench` and what they share with `tandem export`.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "sdk/workers/workers.hpp"
#include "services/engines/scenes/scene.hpp"
#include "services/engines/sessions/session_plan.hpp"
#include "services/tool/commands.hpp"

namespace tandem::lab {

using tool::Run;

void add_bandwidth(commandline::Command bench, Run& run);
void add_client(commandline::Command bench, Run& run);

/// Prints the error to stderr. Returns the exit code: 2 if the user named something that does not exist or is
/// out of range, else 1.
int report(const std::string& command, const Error& error);

/// Loads the scenes of a --scene flag: names, files, or "all" for the thesis's. Errors: those of
/// load_scene().
[[nodiscard]] Result<std::vector<scenes::Scene>> load_scenes(const std::vector<std::string>& names);

inline constexpr std::uint64_t kMaxFrames = 10'000'000;  ///< of a run

/// All values of --codec.
[[nodiscard]] std::vector<std::string> codec_choices();
/// The values of --predictor where it may be chosen automatically.
[[nodiscard]] std::vector<std::string> predictor_choices();

/// Flags that several subcommands have.
void add_scene_option(commandline::Command command, std::vector<std::string>& scenes);
void add_bodies_option(commandline::Command command, std::vector<std::uint32_t>& bodies);
void add_threshold_options(commandline::Command command, sessions::SessionChoice& choice);
void add_overwrite_option(commandline::Command command, bool& overwrite);
commandline::Option add_seed_option(commandline::Command command, std::uint64_t& seed,
                                    const std::string& help);
commandline::Option add_threshold_scale(commandline::Command command, sessions::SessionChoice& choice);

}  // namespace tandem::lab
