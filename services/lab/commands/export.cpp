// `tandem export`: the full simulation's trajectory as X.npy and X.json.

#include <fmt/format.h>

#include <atomic>
#include <filesystem>
#include <memory>

#include "services/engines/sessions/session_plan.hpp"
#include "services/follow/audience/manifest.hpp"
#include "services/follow/recording/output_file.hpp"
#include "services/lab/commands/bench.hpp"
#include "services/lab/measures/scene_source.hpp"
#include "services/lab/trajectories/export_audience.hpp"
#include "services/lab/trajectories/export_recording.hpp"
#include "services/lab/trajectories/trajectory.hpp"
#include "services/program/process/signal_watch.hpp"
#include "services/tool/progress.hpp"

namespace tandem::lab {
namespace {

struct ExportOptions {
  std::string scene;
  SceneRun run;
  std::string out;
  std::string recording, points, http;  // instead of a scene
  std::uint32_t every = 1;
  bool overwrite = false;
};

Result<void> export_trajectory(const ExportOptions& options, const std::atomic<bool>& stop) {
  const auto scene = scenes::load_scene(options.scene);
  if (!scene) return tl::unexpected(scene.error());
  auto source = make_source(*scene, options.run);
  if (!source) return tl::unexpected(source.error());
  sessions::SessionChoice choice;
  choice.bodies = options.run.bodies;
  const auto stream = sessions::plan_stream(*scene, choice);
  if (!stream) return tl::unexpected(stream.error());
  const bool turning = !source->simulation->bodies().orientation[0].empty();
  auto writer =
      TrajectoryWriter::create(options.out, options.run.bodies, turning ? kRigidChannels : kPointChannels);
  if (!writer) return tl::unexpected(writer.error());
  auto replay = Replay::create(*source->simulation, std::move(source->script), stream->lattice);
  if (!replay) return tl::unexpected(replay.error());
  TrajectoryInfo info;
  info.dt_s = scene->dt_s;
  info.damping_per_s = scene->damping_per_s;
  info.radius = scene->smallest_radius_m;
  info.threshold = scene->threshold_m;
  info.scene = options.scene;
  if (turning) {
    for (const scenes::BodyType& type : scene->types) info.shapes.push_back(type.shape);
    info.shape_of.resize(options.run.bodies);
  }
  // A scene by its path is found from everywhere.
  if (scene->path == options.scene) info.scene = std::filesystem::absolute(scene->path).string();
  tool::Progress progress(fmt::format("{}, {} bodies: frame", scene->name, options.run.bodies),
                          options.run.frames);
  for (Frame frame = 0;; ++frame) {
    if (stop) return stopped();
    info.gravity.push_back(replay->simulation().gravity());
    const engine::Bodies bodies = replay->simulation().bodies();
    if (auto appended = writer->append(bodies); !appended) return appended;
    // The last that lived in a slot.
    for (std::size_t slot = 0; slot < info.shape_of.size(); ++slot) {
      if (bodies.alive[slot] != 0) info.shape_of[slot] = bodies.type[slot];
    }
    if (frame == options.run.frames) break;
    if (auto stepped = replay->next(); !stepped) return stepped;
    progress.at(frame);
  }
  return writer->finish(info);
}

/// Before the work, which may take long.
Result<void> check_outputs(const ExportOptions& options) {
  if (options.overwrite) return {};
  if (!options.http.empty()) return recording::check_free(options.http + "/" + audience::kManifestName);
  if (!options.points.empty()) return recording::check_free(options.points);
  return check_trajectory_free(options.out);
}

Result<void> export_chosen(const ExportOptions& options, const std::atomic<bool>& stop) {
  if (auto free = check_outputs(options); !free) return free;
  if (options.recording.empty()) return export_trajectory(options, stop);
  if (!options.http.empty()) return export_audience(options.recording, options.http, stop);
  if (options.points.empty()) return export_states(options.recording, options.out, stop);
  return export_points(options.recording, options.points, options.every, stop);
}

}  // namespace

}  // namespace tandem::lab

void tandem::tool::add_export(commandline::Command app, Run& run) {
  using namespace tandem::lab;
  commandline::Command command = app.add_subcommand(
      "export",
      "Writes the trajectory of a scene or a recording: X.npy, float32 [frames + 1][bodies][6] (position, "
      "velocity) or, with orientations, [13]; and X.json. Can also turn a recording into point clouds, or into files for an audience.");
  command.footer(std::string(kTrajectoryFormat) + "\n\n" + kRecordingFormat);
  const auto options = std::make_shared<ExportOptions>();
  options->run.bodies = 10000;
  options->run.frames = 1000;
  const commandline::Option scene = command.add_option("--scene", options->scene, "Scene by name or file");
  const commandline::Option from =
      command
          .add_option("--from", options->recording,
                      "Recording of `tandem record` whose agreed states are taken instead of a scene")
          .excludes(scene);
  const commandline::Option points =
      command
          .add_option("--points", options->points,
                      "MCAP file of point clouds to write instead of --out; Foxglove opens it")
          .needs(from);
  const commandline::Option http =
      command
          .add_option(
              "--http", options->http,
              "Folder to write the recording into instead of --out, for a web server: the viewer plays it "
              "with `?from=` and its address (idl/AUDIENCE.md)")
          .needs(from)
          .excludes(points);
  command
      .add_option("--every", options->every,
                  "With --points, write only frames whose numbers are multiples of this")
      .range(1U, 1U << 20U)
      .needs(points)
      .show_default();
  command.add_option("--bodies", options->run.bodies, "Number of bodies")
      .range(1U, engine::kMaxBodies)
      .excludes(from)
      .show_default();
  command.add_option("--frames", options->run.frames, "Number of frames after the start")
      .range(std::uint64_t{1}, kMaxFrames)
      .excludes(from)
      .show_default();
  add_seed_option(command, options->run.seed, "Seed of the start block and the scripted inputs")
      .excludes(from);
  command.add_option("--threads", options->run.threads, "Threads of the engine")
      .range(1U, kMaxThreads)
      .excludes(from)
      .show_default();
  command.add_option("--users", options->run.users, "Number of scripted users (default: the scene's)")
      .range(1U, scenes::kMaxUsers)
      .excludes(from);
  command.add_option("--out", options->out, "The .npy file to write; the .json file is written next to it")
      .excludes(points)
      .excludes(http);
  add_overwrite_option(command, options->overwrite);
  command.on_chosen([options, &run] {
    if (options->scene.empty() && options->recording.empty())
      commandline::refuse("--scene", "expected --scene or --from");
    if (options->out.empty() && options->points.empty() && options->http.empty())
      commandline::refuse("--out", "expected the .npy file to write");
    run = [options] {
      SignalWatch signals("tandem export");
      const auto exported = export_chosen(*options, signals.stop());
      return signals.finish(exported ? 0 : report("export", exported.error()));
    };
  });
}
