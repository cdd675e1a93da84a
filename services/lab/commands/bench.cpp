#include "services/lab/commands/bench.hpp"

#include <fmt/format.h>

#include <limits>

#include "sdk/core/tables/codec_table.hpp"
#include "sdk/core/tables/predictor_table.hpp"
#include "services/program/number.hpp"
#include "services/tool/print_error.hpp"

namespace tandem::lab {
namespace {

constexpr double kLeastScale = std::numeric_limits<double>::min(), kMaxScale = 1e6;

}  // namespace

int report(const std::string& command, const Error& error) {
  tool::print_error(fmt::format("tandem {}: {}\n", command, error.message));
  return error.code == ErrorCode::kInvalidArgument ? 2 : 1;
}

Result<std::vector<scenes::Scene>> load_scenes(const std::vector<std::string>& names) {
  std::vector<scenes::Scene> loaded;
  static const std::vector<std::string> all{"half_pipe", "cube", "four_cubes", "half_pipe_2", "half_pipe_3"};
  for (const std::string& name : names == std::vector<std::string>{"all"} ? all : names) {
    auto scene = scenes::load_scene(name);
    if (!scene) return tl::unexpected(scene.error());
    loaded.push_back(std::move(*scene));
  }
  return loaded;
}

std::vector<std::string> codec_choices() { return {codec_names().begin(), codec_names().end()}; }

std::vector<std::string> predictor_choices() {
  std::vector<std::string> names = predictor_names();
  names.insert(names.begin(), std::string(planning::kAutomaticPredictor));
  return names;
}

void add_scene_option(commandline::Command command, std::vector<std::string>& scenes) {
  command
      .add_option("--scene", scenes, "Scenes by name or file, separated by commas; all for the thesis's five")
      .separated_by(',')
      .required();
}

void add_bodies_option(commandline::Command command, std::vector<std::uint32_t>& bodies) {
  command.add_option("--bodies", bodies, "Numbers of bodies, separated by commas")
      .separated_by(',')
      .range(1U, engine::kMaxBodies)
      .show_default();
}

commandline::Option add_seed_option(commandline::Command command, std::uint64_t& seed,
                                    const std::string& help) {
  // The parser would read -1 and numbers that are too large as 2^64 - 1.
  return command.add_option("--seed", seed, help)
      .check([](const std::string& text) {
        return text::number<std::uint64_t>(text) ? "" : "must be a whole number below 2^64";
      })
      .show_default();
}

void add_overwrite_option(commandline::Command command, bool& overwrite) {
  command.add_flag("--overwrite", overwrite,
                   "Replace what is there; without it, a file that exists is refused");
}

commandline::Option add_threshold_scale(commandline::Command command, sessions::SessionChoice& choice) {
  return command
      .add_option("--threshold-scale", choice.threshold_scale, "Factor for the scene's error threshold")
      .range(kLeastScale, kMaxScale);
}

void add_threshold_options(commandline::Command command, sessions::SessionChoice& choice) {
  const commandline::Option scale = add_threshold_scale(command, choice);
  command
      .add_option("--threshold", choice.threshold_m, "Error threshold in scene units (default: the scene's)")
      .range(planning::kLeastLength, planning::kMaxLength)
      .excludes(scale);
}

}  // namespace tandem::lab

void tandem::tool::add_bench(commandline::Command app, Run& run) {
  using namespace tandem::lab;
  commandline::Command bench =
      app.add_subcommand("bench", "Measures bandwidth and what a client costs on this device.");
  bench.require_subcommand();
  add_bandwidth(bench, run);
  add_client(bench, run);
}
