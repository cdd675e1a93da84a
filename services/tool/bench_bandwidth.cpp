// `tandem bench bandwidth`: the paper's table 5.3 and everything like it.

#include <fmt/format.h>

#include <memory>

#include "services/tool/bench.hpp"
#include "services/tool/progress.hpp"
#include "services/tool/train.hpp"
#include "services/tool/trajectory.hpp"

namespace tandem::tool {
namespace {

struct BandwidthOptions {
  std::vector<std::string> scenes;
  std::vector<std::uint32_t> bodies{10000};
  std::uint64_t frames = 1000;
  std::vector<std::string> codecs;
  std::string predictor = "ballistic";
  std::string trajectory;
  ThresholdChoice threshold;
  SceneRun run;
  std::size_t budget_bytes = kPaperBudgetBytes;
  bool json = false;
};

std::vector<CodecSetup> codec_setups(const BandwidthOptions& options, const scenes::TrainedTable& table) {
  std::vector<CodecSetup> setups;
  for (const std::string& name : options.codecs)
    setups.push_back(make_codec_setup(name, table, options.budget_bytes));
  return setups;
}

/// All codecs over one source; the rows lack only what the source does not know.
Result<std::vector<BandwidthRow>> measure(Source& source, const scenes::TrainedTable& table,
                                          const std::string& name, const BandwidthOptions& options,
                                          std::uint64_t frames) {
  auto run = make_run(source, table, options.predictor, frames);
  if (!run) return tl::unexpected(run.error());
  auto replay =
      Replay::create(*source.simulation, std::move(source.script), source.lattice, source.type_count);
  if (!replay) return tl::unexpected(replay.error());
  Progress progress(fmt::format("{}, {} bodies: frame", name, run->timeline.capacity), frames);
  auto rows = measure_bandwidth(*replay, *run, codec_setups(options, table),
                                [&](Frame frame) { progress.at(frame); });
  if (!rows) return rows;
  for (BandwidthRow& row : *rows) {
    row.scene = name;
    row.threshold = source.threshold;
  }
  return rows;
}

Result<std::vector<BandwidthRow>> measure_scene(const scenes::Scene& scene, const BandwidthOptions& options,
                                                std::uint32_t bodies) {
  SceneRun run = options.run;
  run.bodies = bodies;
  run.frames = options.frames;
  auto source = make_source(scene, run, options.threshold);
  if (!source) return tl::unexpected(source.error());
  auto rows =
      measure(*source, table_for(scene, bodies, source->threshold), scene.name, options, options.frames);
  if (!rows) return rows;
  // With another number of users it is not the scene of the paper's table.
  const bool as_in_paper = scene.number != 0 && (run.users == 0 || run.users == scene.users);
  for (BandwidthRow& row : *rows) {
    if (as_in_paper) row.number = static_cast<int>(scene.number);
    row.threads = run.threads;
    row.seed = run.seed;
  }
  return rows;
}

Result<Source> trajectory_source(const std::string& path, const ThresholdChoice& threshold) {
  auto trajectory = RecordedTrajectory::open(path);
  if (!trajectory) return tl::unexpected(trajectory.error());
  Source source;
  source.threshold = threshold.of((*trajectory)->info().threshold);
  // A file without any motion has no extent of its own.
  const double extent = std::max((*trajectory)->position_bound(), source.threshold);
  auto lattice = server::choose_lattice(source.threshold, extent, (*trajectory)->dt_s());
  if (!lattice) return fail(lattice.error().code, path + ": " + lattice.error().message);
  source.lattice = *lattice;
  source.simulation = std::move(*trajectory);
  return source;
}

/// There is no other run to train on, so a trajectory trains the paper's codecs itself, in their favour.
Result<std::vector<BandwidthRow>> measure_trajectory(const BandwidthOptions& options) {
  const auto make = [&] { return trajectory_source(options.trajectory, options.threshold); };
  auto opened = RecordedTrajectory::open(options.trajectory);
  if (!opened) return tl::unexpected(opened.error());
  const std::uint64_t frames = std::min(options.frames, (*opened)->frames());
  Progress progress(fmt::format("{}: training, frame", options.trajectory), 2 * frames);
  auto table = train(make, options.predictor, frames, [&](Frame frame) { progress.at(frame); });
  if (!table) return tl::unexpected(table.error());
  auto source = make();
  if (!source) return tl::unexpected(source.error());
  auto rows = measure(*source, *table, options.trajectory, options, frames);
  if (!rows) return rows;
  for (BandwidthRow& row : *rows) row.colliding_per_frame.reset();
  return rows;
}

Result<std::vector<BandwidthRow>> measure_all(const BandwidthOptions& options) {
  if (!options.trajectory.empty()) return measure_trajectory(options);
  auto scenes = load_scenes(options.scenes);
  if (!scenes) return tl::unexpected(scenes.error());
  std::vector<BandwidthRow> rows;
  for (const scenes::Scene& scene : *scenes) {
    for (const std::uint32_t bodies : options.bodies) {
      auto measured = measure_scene(scene, options, bodies);
      if (!measured) return measured;
      rows.insert(rows.end(), measured->begin(), measured->end());
    }
  }
  return rows;
}

int run_bandwidth(const BandwidthOptions& options) {
  const auto rows = measure_all(options);
  if (!rows) return report("bench bandwidth", rows.error());
  fmt::print("{}{}", options.json ? to_json(*rows) : to_table(*rows), options.json ? "\n" : "");
  return 0;
}

}  // namespace

void add_bandwidth(CLI::App& bench, Run& run) {
  CLI::App* command = bench.add_subcommand(
      "bandwidth", "Codecs side by side over the same trajectory; a decoder checks every frame's hash.");
  const auto options = std::make_shared<BandwidthOptions>();
  for (const std::string_view name : codec_names()) options->codecs.emplace_back(name);
  add_scene_option(*command, options->scenes);
  add_bodies_option(*command, options->bodies);
  command->get_option("--scene")->required(false);
  command->add_option("--frames", options->frames, "Frames, from the start block on")
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{10'000'000}))
      ->capture_default_str();
  command->add_option("--codec", options->codecs, "Codecs, separated by commas (default: all)")
      ->delimiter(',')
      ->check(CLI::IsMember(options->codecs));
  command->add_option("--predictor", options->predictor, "Predicted step")->capture_default_str();
  command->add_option("--seed", options->run.seed, "Of the start block and the scripted inputs")
      ->capture_default_str();
  add_threshold_options(*command, options->threshold);
  command->add_option("--threads", options->run.threads, "Of the engine")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  command->add_option("--users", options->run.users, "Scripted users (default: the scene's)")
      ->check(CLI::Range(1U, scenes::kMaxUsers));
  command->add_option("--budget", options->budget_bytes, "Bytes of corrections a frame for `limited`")
      ->capture_default_str();
  command
      ->add_option("--trajectory", options->trajectory,
                   "X.npy with X.json in the place of a scene; trains on itself")
      ->excludes("--scene");
  command->add_flag("--json", options->json, "One JSON object: rows[...]");
  command->footer(
      "Times are medians in ms: encode includes putting the state on the lattice, apply the hash.");
  command->callback([options, &run] {
    if (options->scenes.empty() && options->trajectory.empty())
      throw CLI::RequiredError("--scene or --trajectory");
    run = [options] { return run_bandwidth(*options); };
  });
}

}  // namespace tandem::tool
