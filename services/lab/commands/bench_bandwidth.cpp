// `tandem bench bandwidth`: the thesis's table 5.3 and similar measurements.

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <iterator>
#include <memory>
#include <mutex>
#include <thread>

#include "sdk/core/tables/codec_table.hpp"
#include "sdk/core/tables/predictor_table.hpp"
#include "services/lab/bandwidth/bandwidth.hpp"
#include "services/lab/bandwidth/bandwidth_columns.hpp"
#include "services/lab/commands/bench.hpp"
#include "services/lab/measures/train.hpp"
#include "services/lab/trajectories/trajectory.hpp"
#include "services/program/number.hpp"
#include "services/tool/progress.hpp"

namespace tandem::lab {
namespace {

struct BandwidthOptions {
  std::vector<std::string> scenes;
  std::vector<std::uint32_t> bodies{10000};
  std::uint64_t frames = 1000;
  std::vector<std::string> codecs = codec_choices();
  std::string trajectory;
  sessions::SessionChoice choice;
  SceneRun run;
  bool json = false;
  bool series = false;
  bool peers = false;
  unsigned jobs = std::max(1U, std::thread::hardware_concurrency());
};

/// One scene at one size.
struct Job {
  const scenes::Scene* scene;
  std::uint32_t bodies;
};

/// Measures all codecs over one source. The caller adds to the rows what only the scene knows.
Result<std::vector<BandwidthRow>> measure(const scenes::Scene& scene, Source& source,
                                          const BandwidthOptions& options, std::uint64_t frames,
                                          const std::function<void(Frame)>& progress) {
  sessions::SessionChoice choice = options.choice;
  choice.bodies = source.simulation->capacity();
  choice.threads = options.run.threads;
  std::vector<host::StreamConfig> streams;
  for (const std::string& codec : options.codecs) {
    choice.codec = codec;
    const auto traits = codec_traits(codec);
    if (!traits) return tl::unexpected(traits.error());
    choice.predictor = traits->is_baseline ? std::string(basic_predictor().name) : options.choice.predictor;
    auto stream = sessions::plan_stream(scene, choice);
    if (!stream) return tl::unexpected(stream.error());
    if (!traits->reads_threshold) stream->quality.reset();
    streams.push_back(std::move(*stream));
  }
  auto replay = Replay::create(*source.simulation, std::move(source.script), streams[0].lattice);
  if (!replay) return tl::unexpected(replay.error());
  const double threshold = choice.threshold_m.value_or(scene.threshold_m * choice.threshold_scale);
  auto rows = measure_bandwidth(*replay, streams, frames, progress,
                                options.peers ? std::optional(threshold) : std::nullopt);
  if (!rows) return rows;
  for (BandwidthRow& row : *rows) {
    row.scene = scene.name;
    row.threshold = threshold;
    if (choice.automatic && !row.predictor.empty())
      row.threshold = row.parameters.codec.threshold * row.lattice_unit;
  }
  return rows;
}

Result<std::vector<BandwidthRow>> measure_scene(const scenes::Scene& scene, const BandwidthOptions& options,
                                                std::uint32_t bodies,
                                                const std::function<void(Frame)>& progress) {
  SceneRun run = options.run;
  run.bodies = bodies;
  run.frames = options.frames;
  auto source = make_source(scene, run);
  if (!source) return tl::unexpected(source.error());
  auto rows = measure(scene, *source, options, options.frames, progress);
  if (!rows) return rows;
  // With another number of users, the scene differs from that of the thesis's table.
  const bool as_in_paper = scene.number != 0 && (run.users == 0 || run.users == scene.users);
  for (BandwidthRow& row : *rows) {
    if (as_in_paper) row.number = static_cast<int>(scene.number);
    row.threads = run.threads;
    row.seed = run.seed;
  }
  return rows;
}

/// Describes a trajectory as a scene, from which a session can be planned. Errors: kMalformed if the file
/// that it names is not a scene.
Result<scenes::Scene> scene_of(const RecordedTrajectory& trajectory, const std::string& path) {
  scenes::Scene scene;
  scene.name = path;
  scene.dt_s = trajectory.dt_s();
  scene.threshold_m = trajectory.info().threshold;
  // A file without any motion has no extent of its own.
  scene.extent_m = std::max(trajectory.position_bound(), trajectory.info().threshold);
  scene.turns = !trajectory.bodies().orientation[0].empty();
  scene.types.resize(1);
  scene.types.front().bounding_radius_m = trajectory.info().radius;
  const std::vector<engine::Shape>& shapes = trajectory.info().shapes;
  if (!shapes.empty()) scene.types.clear();
  for (const engine::Shape& shape : shapes) {
    scenes::BodyType& type = scene.types.emplace_back();
    type.radius_m = engine::inner_radius(shape);
    type.bounding_radius_m = engine::bounding_radius(shape);
    type.shape = shape;
  }
  if (trajectory.info().scene.empty()) return scene;
  auto named = scenes::load_scene(trajectory.info().scene);
  if (!named) {
    return fail(ErrorCode::kMalformed,
                fmt::format("{}: \"scene\": {}", sidecar_path(path).value(), named.error().message));
  }
  scene.extent_m = std::max(scene.extent_m, named->extent_m);
  scene.world = std::move(named->world);
  // A recording does not say which of the scene's types a body has.
  scene.world.types.resize(1);
  if (shapes.empty()) return scene;
  const engine::ParticleType first = scene.world.types.front();
  scene.world.types.clear();
  for (const scenes::BodyType& type : scene.types)
    scene.world.types.push_back({static_cast<float>(type.radius_m), first.mass});
  return scene;
}

/// Predictors that compute contacts need the bodies' radius and materials, and the walls.
Result<void> check_world_is_known(const RecordedTrajectory& trajectory, const BandwidthOptions& options) {
  const std::string& predictor = options.choice.predictor;
  const auto is_ours = [](const std::string& codec) {
    const auto traits = codec_traits(codec);
    return traits && !traits->is_baseline;
  };
  const auto named = find_predictor(predictor);  // none if it is chosen automatically
  const bool asked = named && (*named)->reads_world && std::ranges::any_of(options.codecs, is_ours);
  if (!asked || !trajectory.info().scene.empty()) return {};
  return fail(ErrorCode::kInvalidArgument,
              fmt::format("{}: no \"scene\"; --predictor {} needs one for radius, materials and walls (see "
                          "`tandem export --help`)",
                          sidecar_path(options.trajectory).value(), predictor));
}

/// Trains the thesis's codecs with the trajectory itself, as there is no other run. This favours them.
Result<std::vector<BandwidthRow>> measure_trajectory(const BandwidthOptions& options) {
  const auto make = [&] {
    return RecordedTrajectory::open(options.trajectory)
        .map([](std::unique_ptr<RecordedTrajectory>&& trajectory) {
          return Source{std::move(trajectory), {}};
        });
  };
  const auto opened = RecordedTrajectory::open(options.trajectory);
  if (!opened) return tl::unexpected(opened.error());
  if (auto known = check_world_is_known(**opened, options); !known) return tl::unexpected(known.error());
  auto scene_or = scene_of(**opened, options.trajectory);
  if (!scene_or) return tl::unexpected(scene_or.error());
  scenes::Scene& scene = *scene_or;
  const std::uint64_t frames = std::min(options.frames, (*opened)->frames());
  sessions::SessionChoice choice = options.choice;
  choice.bodies = (*opened)->capacity();
  const auto is_trained = [](const std::string& codec) { return codec_traits(codec)->reads_steps; };
  if (std::ranges::any_of(options.codecs, is_trained)) {
    tool::Progress progress(fmt::format("{}: training, frame", options.trajectory), kTrainingPasses * frames);
    auto table = train(scene, choice, make, frames, [&](Frame frame) { progress.at(frame); });
    if (!table) return fail(table.error().code, options.trajectory + ": " + table.error().message);
    scene.trained = {std::move(*table)};
  }
  auto source = make();
  if (!source) return tl::unexpected(source.error());
  tool::Progress progress(fmt::format("{}: frame", options.trajectory), frames);
  auto rows = measure(scene, *source, options, frames, [&](Frame frame) { progress.at(frame); });
  if (!rows) return rows;
  for (BandwidthRow& row : *rows) row.colliding_per_frame.reset();
  return rows;
}

/// Runs jobs in parallel, and returns their rows in the order of the jobs.
Result<std::vector<BandwidthRow>> measure_jobs(std::span<const Job> jobs, const BandwidthOptions& options) {
  std::vector<Result<std::vector<BandwidthRow>>> results(jobs.size());
  std::atomic<std::size_t> next = 0;
  std::atomic<bool> failed = false;
  std::mutex mutex;
  std::uint64_t done = 0;
  tool::Progress progress(fmt::format("{} runs: frame", jobs.size()), jobs.size() * options.frames);
  const auto one_frame = [&](Frame) {
    const std::lock_guard lock(mutex);
    progress.at(++done);
  };
  const auto work = [&] {
    for (std::size_t job = next++; job < jobs.size() && !failed; job = next++) {
      results[job] = measure_scene(*jobs[job].scene, options, jobs[job].bodies, one_frame);
      if (!results[job]) failed = true;
    }
  };
  {
    std::vector<std::jthread> workers;
    for (std::size_t i = 1; i < std::min<std::size_t>(options.jobs, jobs.size()); ++i)
      workers.emplace_back(work);
    work();
  }
  std::vector<BandwidthRow> rows;
  for (auto& result : results) {
    if (!result) return result;
    std::move(result->begin(), result->end(), std::back_inserter(rows));
  }
  return rows;
}

Result<std::vector<BandwidthRow>> measure_all(const BandwidthOptions& options) {
  if (!options.trajectory.empty()) return measure_trajectory(options);
  auto scenes = load_scenes(options.scenes);
  if (!scenes) return tl::unexpected(scenes.error());
  std::vector<Job> jobs;
  for (const scenes::Scene& scene : *scenes) {
    for (const std::uint32_t bodies : options.bodies) jobs.push_back({&scene, bodies});
  }
  return measure_jobs(jobs, options);
}

int run_bandwidth(const BandwidthOptions& options) {
  const auto rows = measure_all(options);
  if (!rows) return report("bench bandwidth", rows.error());
  fmt::print("{}", options.json ? to_json(*rows, options.series) + '\n' : to_table(*rows));
  return 0;
}

/// Adds the options with the same meaning as in tandemd.
void add_quality_options(commandline::Command command, sessions::SessionChoice& choice) {
  const commandline::Option scale = add_threshold_scale(command, choice);
  command
      .add_option_function<std::string>(
          "--threshold",
          [&choice](const std::string& text) {
            choice.automatic = text == "auto";
            if (choice.automatic) return;
            choice.threshold_m = text::number<double>(text);
            if (!choice.threshold_m || !(*choice.threshold_m >= planning::kLeastLength &&
                                         *choice.threshold_m <= planning::kMaxLength))
              commandline::refuse("--threshold", "must be a length from 1e-9 to 1e9 scene units, or auto");
          },
          "Error threshold in scene units, or auto to choose it at run time (default: the scene's)")
      .type_name("FLOAT|auto")
      .excludes(scale);
  command
      .add_option(
          "--target-bandwidth", choice.target_mbit_per_s,
          "Target of --threshold auto, in Mbit/s of payload (default: none, so only ranges are chosen)")
      .range(0.001, 1e6);
  command
      .add_option("--max-error", choice.max_error_m,
                  "Maximum threshold of --threshold auto, in scene units (default: four times the scene's)")
      .range(1e-9, 1e9);
}

}  // namespace

void add_bandwidth(commandline::Command bench, Run& run) {
  commandline::Command command = bench.add_subcommand(
      "bandwidth", "Compares codecs on the same trajectory; a decoder checks every frame's hash.");
  const auto options = std::make_shared<BandwidthOptions>();
  add_scene_option(command, options->scenes);
  add_bodies_option(command, options->bodies);
  command.option("--scene").required(false);
  command.add_option("--frames", options->frames, "Number of frames from the start block on")
      .range(std::uint64_t{1}, kMaxFrames)
      .show_default();
  command.add_option("--codec", options->codecs, "Codecs, separated by commas (default: all)")
      .separated_by(',')
      .one_of(codec_choices());
  const std::string_view basic = basic_predictor().name;
  command
      .add_option(
          "--predictor", options->choice.predictor,
          fmt::format(
              "Predicted step of `tracker`: {}, or auto ({} for spheres, else {}). The thesis's codecs use "
              "{}",
              fmt::join(predictor_names(), ", "), predictors().front().name, basic, basic))
      .one_of(predictor_choices())
      .show_default();
  add_seed_option(command, options->run.seed, "Seed of the start block and the scripted inputs");
  add_quality_options(command, options->choice);
  command
      .add_option("--threads", options->run.threads, "Threads of the engine, and of the codec for its blocks")
      .range(1U, kMaxThreads)
      .show_default();
  command.add_option("--users", options->run.users, "Number of scripted users (default: the scene's)")
      .range(1U, scenes::kMaxUsers);
  command
      .add_option(
          "--budget", options->choice.budget_bytes,
          "Maximum bytes of corrections per frame, for `limited` (default: 6553) and `tracker` (default: no "
          "limit)")
      .range(planning::kLeastBudgetBytes, std::size_t{1} << 30U);
  command
      .add_option(
          "--trajectory", options->trajectory,
          "X.npy with X.json, see `tandem export --help`; measured instead of a scene, and also trained on")
      .excludes({"--scene", "--bodies", "--seed", "--users"});
  command
      .add_option("--jobs", options->jobs,
                  "Number of scenes measured at the same time; only 1 gives reliable times")
      .range(1, 64)
      .show_default();
  command.add_flag(
      "--peers", options->peers,
      "Also measure Draco, zfp, zstd and dead reckoning (DIS), with the threshold as their maximum error");
  command.add_flag("--json", options->json, "Print one JSON object: rows[...]");
  command.add_flag(
      "--series", options->series,
      "With --json, each row also has payload_bytes and colliding (bodies in contact) of every frame");
  command.footer(
      "Errors and the threshold apply to centres. In a session with orientations, the threshold applies to\n"
      "surfaces; max surf and rms surf are errors on the surface of the sphere around each body.\n"
      "wire: Mbit/s that one observer takes on the network, computed by header sizes, with deltas collected for\n"
      "0.2 s; of --peers each frame travels alone.\n"
      "bound: Mbit/s of tracker's decisions with the best fixed probability of each context.\n"
      "Times are medians in ms. encode includes putting the state on the lattice, apply includes the hash.\n"
      "Bits and errors do not depend on --threads and --jobs; times are reliable with --jobs 1 only.");
  command.on_chosen([options, &run] {
    if (options->scenes.empty() && options->trajectory.empty())
      commandline::refuse_missing("--scene or --trajectory");
    const sessions::SessionChoice& choice = options->choice;
    if (!choice.automatic && choice.target_mbit_per_s > 0)
      commandline::refuse_without("--target-bandwidth", "--threshold auto");
    if (!choice.automatic && choice.max_error_m)
      commandline::refuse_without("--max-error", "--threshold auto");
    run = [options] { return run_bandwidth(*options); };
  });
}

}  // namespace tandem::lab
