// `bench_lab scale`: the stages of a frame, from thousands of bodies to millions, over DDS on loopback.

#include <fmt/format.h>

#include <cstdio>
#include <memory>

#include "sdk/transport/dds/dds_ports.hpp"
#include "services/follow/recording/output_file.hpp"
#include "services/lab/commands/bench.hpp"
#include "services/program/json/json.hpp"
#include "tests/bench/lab/commands.hpp"
#include "tests/bench/lab/scale/chart.hpp"
#include "tests/bench/lab/scale/machine.hpp"
#include "tests/bench/lab/scale/peers.hpp"
#include "tests/bench/lab/scale/scale.hpp"

namespace tandem::lab {
namespace {

/// What a body takes of this machine's memory while a row is measured, at most: engine, server, client, and
/// DDS between them. The rows say what engine, server and client took of it.
constexpr std::uint64_t kBytesABody = 2000;
constexpr std::uint64_t kBytesBesides = std::uint64_t{600} << 20U;  // the arrays of the memory's bandwidth

struct ScaleOptions {
  std::string scene = "field";
  std::vector<std::uint32_t> bodies{10'000, 30'000, 100'000, 300'000, 1'000'000};
  std::vector<std::uint32_t> threads{1, 2};
  std::vector<std::string> predictors{"ballistic"}, states{"settled", "moving"};
  std::string codec = "tracker", chart, play;
  std::uint64_t frames = 120;
  std::uint64_t settled_after = 3000, moving_after = 60;
  std::uint64_t seed = 1;
  std::uint32_t domain = 0;
  bool json = false, peers = false, pipeline = false, overwrite = false;
};

struct Case {
  std::string state, predictor;
  std::uint32_t threads = 1, bodies = 0;
};

struct Stage {
  const char* name;
  StageTime ScaleRow::*time;
};
constexpr Stage kStages[] = {{"step", &ScaleRow::step},
                             {"quantise", &ScaleRow::quantise},
                             {"predict", &ScaleRow::predict},
                             {"encode", &ScaleRow::encode},
                             {"apply", &ScaleRow::apply},
                             {"publish", &ScaleRow::publish},
                             {"client_predict", &ScaleRow::client_predict},
                             {"client_decode", &ScaleRow::client_decode},
                             {"client_apply", &ScaleRow::client_apply}};

std::vector<Case> cases_of(const ScaleOptions& options) {
  std::vector<Case> cases;
  for (const std::string& state : options.states)
    for (const std::string& predictor : options.predictors)
      for (const std::uint32_t threads : options.threads)
        for (const std::uint32_t bodies : options.bodies)
          cases.push_back({state, predictor, threads, bodies});
  return cases;
}

sessions::SessionChoice choice_of(const ScaleOptions& options, const Case& which) {
  sessions::SessionChoice choice;
  choice.bodies = which.bodies;
  choice.predictor = which.predictor;
  choice.codec = options.codec;
  choice.threads = which.threads;
  return choice;
}

Result<void> check_memory(std::uint32_t bodies, std::uint64_t free) {
  const std::uint64_t needed = kBytesABody * bodies + kBytesBesides;
  if (free == 0 || needed <= free) return {};
  return fail(ErrorCode::kInvalidArgument,
              fmt::format("{} bodies need up to {} MB of memory, and {} MB are free", bodies, needed >> 20U,
                          free >> 20U));
}

/// Errors: what a row would be refused for, before the first row is measured.
Result<void> check(const scenes::Scene& scene, const ScaleOptions& options, const std::vector<Case>& cases) {
  if (scene.engine != scenes::EngineKind::kParticles)
    return fail(ErrorCode::kInvalidArgument, scene.name + " is not a scene of engine \"particles\"");
  const std::uint64_t free = free_memory_bytes();
  for (const Case& which : cases) {
    if (auto fits = check_memory(which.bodies, free); !fits) return fits;
    const auto plan = sessions::plan_session(scene, choice_of(options, which));
    if (!plan) {
      return fail(plan.error().code, fmt::format("{} bodies with predictor {}: {}", which.bodies,
                                                 which.predictor, plan.error().message));
    }
  }
  return {};
}

double ns_a_body(const StageTime& time, std::uint32_t bodies) { return time.p50 * 1e6 / bodies; }

Json to_json(const StageTime& time) { return {{"p50", time.p50}, {"p99", time.p99}}; }

Json to_json(const Case& which, const ScaleRow& row) {
  Json out{{"state", which.state},
           {"predictor", which.predictor},
           {"threads", which.threads},
           {"bodies", which.bodies}};
  for (const Stage& stage : kStages) {
    out[fmt::format("{}_ms", stage.name)] = to_json(row.*stage.time);
    out[fmt::format("{}_ns_a_body", stage.name)] = ns_a_body(row.*stage.time, which.bodies);
  }
  out["frame_ms"] = to_json(row.frame);
  out["steps_before"] = row.warm_up;
  out["standing"] = row.standing;
  out["mbit_per_s"] = row.mbit_per_s;
  out["frames_per_s"] = row.frames_per_s;
  out["corrected_per_frame"] = row.corrected_per_frame;
  out["colliding_per_frame"] = row.colliding_per_frame ? Json(*row.colliding_per_frame) : Json();
  out["engine_bytes_a_body"] = row.engine_bytes;
  out["server_bytes_a_body"] = row.server_bytes;
  out["client_bytes_a_body"] = row.client_bytes;
  return out;
}

void print_heading(const ScaleOptions& options, const std::vector<double>& bandwidth) {
  fmt::print("{}, codec {}; memory copies", options.scene, options.codec);
  for (std::size_t i = 0; i < bandwidth.size(); ++i)
    fmt::print("{} {:.1f} GB/s on {} threads", i == 0 ? "" : ",", bandwidth[i] * 1e-9, options.threads[i]);
  fmt::print(" (read and written)\nms of a frame, median/p99; below it ns a body\n{:<8} {:<10} {:>2} {:>8}",
             "state", "predictor", "th", "bodies");
  for (const Stage& stage : kStages) fmt::print(" {:>13}", std::string(stage.name).substr(0, 13));
  fmt::print(" {:>13} {:>8} {:>8} {:>9} {:>6} {:>6} {:>6} {:>6} {:>7}\n", "server frame", "frames/s",
             "Mbit/s", "corrected", "engine", "server", "client", "after", "still");
}

void print(const Case& which, const ScaleRow& row) {
  const auto two = [](const StageTime& time) { return fmt::format("{:.2f}/{:.1f}", time.p50, time.p99); };
  fmt::print("{:<8} {:<10} {:>2} {:>8}", which.state, which.predictor, which.threads, which.bodies);
  for (const Stage& stage : kStages) fmt::print(" {:>13}", two(row.*stage.time));
  fmt::print(" {:>13} {:>8.1f} {:>8.2f} {:>9.0f} {:>6.0f} {:>6.0f} {:>6.0f} {:>6} {:>6.2f}%\n{:>31}",
             two(row.frame), row.frames_per_s, row.mbit_per_s, row.corrected_per_frame, row.engine_bytes,
             row.server_bytes, row.client_bytes, row.warm_up, 100 * row.standing, "");
  for (const Stage& stage : kStages) fmt::print(" {:>13.1f}", ns_a_body(row.*stage.time, which.bodies));
  fmt::print("\n");
  std::fflush(stdout);
}

/// One line of a chart, or of the table of slopes, for each stage of each series of sizes.
std::vector<ChartLine> lines_of(const std::vector<Case>& cases, const std::vector<ScaleRow>& rows) {
  std::vector<ChartLine> lines;
  for (const Stage& stage : kStages) {
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const Case& c = cases[i];
      const std::string name = fmt::format("{} {} {} x{}", stage.name, c.state, c.predictor, c.threads);
      if (lines.empty() || lines.back().name != name) lines.push_back({name, {}});
      lines.back().points.emplace_back(c.bodies, (rows[i].*stage.time).p50);
    }
  }
  return lines;
}

Json to_json(const PileTime& time) { return {{"processor", time.processor}, {"wall", time.wall}}; }

void print(std::uint32_t bodies, const PileRow& row) {
  fmt::print("{:>8} {:<7} {:>2}", bodies, row.engine, row.threads);
  for (const PileTime* const time : {&row.moving, &row.settled, &row.asleep}) {
    if (row.not_run.empty() && time->wall > 0) {
      fmt::print(" {:>7.1f} {:>7.1f}", time->processor, time->wall);
    } else {
      fmt::print(" {:>15}", "-");
    }
  }
  fmt::print("{}{}\n", row.not_run.empty() ? "" : " not run: ", row.not_run);
  std::fflush(stdout);
}

/// Only the engine, beside others with the same pile.
int run_peers(const ScaleOptions& options) {
  const std::uint64_t free = free_memory_bytes();
  for (const std::uint32_t bodies : options.bodies) {
    if (const auto fits = check_memory(bodies, free); !fits) return refuse("scale", fits.error());
  }
  if (!options.json) {
    fmt::print(
        "a pile of 16 layers, ns a body and step, mean of {} steps; LAMMPS and Bullet also turn the bodies\n{:>8} "
        "{:<7} {:>2} {:>15} {:>15} {:>15}\n{:>19}",
        options.frames, "bodies", "engine", "th", "moving", "settled", "asleep", "");
    for (int i = 0; i < 3; ++i) fmt::print(" {:>7} {:>7}", "proc.", "wall");
    fmt::print("\n");
  }
  Json printed = Json::array();
  for (const std::uint32_t bodies : options.bodies) {
    const auto rows = measure_piles({.bodies = bodies,
                                     .steps = options.frames,
                                     .settle = options.settled_after,
                                     .threads = options.threads,
                                     .stop = &stop_on_signals()});
    if (!rows) return refuse("scale", rows.error());
    for (const PileRow& row : *rows) {
      if (!options.json) print(bodies, row);
      Json out{{"bodies", bodies}, {"engine", row.engine}, {"threads", row.threads}};
      if (!row.not_run.empty()) {
        out["not_run"] = row.not_run;
      } else {
        out["moving_ns_a_body"] = to_json(row.moving);
        out["settled_ns_a_body"] = to_json(row.settled);
        if (row.asleep.wall > 0) out["asleep_ns_a_body"] = to_json(row.asleep);
      }
      printed.push_back(out);
    }
  }
  if (options.json) fmt::print("{}\n", Json{{"steps", options.frames}, {"rows", printed}}.dump());
  return 0;
}

int run_scale(const ScaleOptions& options) {
  if (!options.play.empty()) return play_scale(options.play, options.domain, options.frames);
  if (options.peers) return run_peers(options);
  if (!options.chart.empty() && !options.overwrite) {  // before the work, which takes long
    if (const auto free = recording::check_free(options.chart); !free) return refuse("scale", free.error());
  }
  const auto scene = scenes::load_scene(options.scene);
  if (!scene) return refuse("scale", scene.error());
  const std::vector<Case> cases = cases_of(options);
  if (auto good = check(*scene, options, cases); !good) return refuse("scale", good.error());
  std::vector<double> bandwidth;
  for (const std::uint32_t threads : options.threads) bandwidth.push_back(memory_bytes_per_s(threads));
  if (!options.json) print_heading(options, bandwidth);
  std::vector<ScaleRow> rows;
  Json printed = Json::array();
  for (const Case& which : cases) {
    const bool settled = which.state != "moving";
    const Motion motion = !settled                   ? Motion::kMoving
                          : which.state == "settled" ? Motion::kSettled
                                                     : Motion::kStirred;
    const auto row = measure_scale(*scene, {.choice = choice_of(options, which),
                                            .threads = which.threads,
                                            .pipeline = options.pipeline,
                                            .motion = motion,
                                            .warm_up = settled ? options.settled_after : options.moving_after,
                                            .frames = options.frames,
                                            .seed = options.seed,
                                            .domain = options.domain,
                                            .stop = &stop_on_signals()});
    if (!row) return refuse("scale", row.error());
    rows.push_back(*row);
    printed.push_back(to_json(which, *row));
    if (!options.json) print(which, *row);
  }
  const std::vector<ChartLine> lines = lines_of(cases, rows);
  Json slopes = Json::object();
  for (const ChartLine& line : lines) {
    if (line.points.size() < 2) continue;
    slopes[line.name] = log_slope(line.points);
    if (!options.json) fmt::print("slope {:.2f}  {}\n", log_slope(line.points), line.name);
  }
  if (!options.chart.empty()) {
    const auto drawn =
        draw_chart(options.chart, fmt::format("{}: time of each stage of a frame", scene->name), "bodies",
                   "ms (median)", lines);
    if (!drawn) return refuse("scale", drawn.error());
  }
  if (options.json) {
    Json memory = Json::object();
    for (std::size_t i = 0; i < bandwidth.size(); ++i)
      memory[std::to_string(options.threads[i])] = bandwidth[i];
    fmt::print("{}\n", Json{{"scene", scene->name},
                            {"codec", options.codec},
                            {"frames", options.frames},
                            {"memory_bytes_per_s", memory},
                            {"rows", printed},
                            {"slopes", slopes}}
                           .dump());
  }
  return 0;
}

}  // namespace

void add_scale(commandline::Command app, Run& run) {
  commandline::Command command = app.add_subcommand(
      "scale", "Measures each stage of a frame by number of bodies, over DDS on loopback with one client.");
  const auto options = std::make_shared<ScaleOptions>();
  command
      .add_option("--scene", options->scene,
                  "Scene by name or file; field, hopper and landslide hold millions")
      .show_default();
  add_bodies_option(command, options->bodies);
  command.add_option("--threads", options->threads, "Threads of engine and codec, separated by commas")
      .separated_by(',')
      .range(1U, kMaxThreads)
      .show_default();
  command.add_option("--predictor", options->predictors, "Predicted steps, separated by commas")
      .separated_by(',')
      .one_of(predictor_choices())
      .show_default();
  command
      .add_option("--state", options->states,
                  "settled (nobody acts), moving (the scene's users act), stirred (they act after it has "
                  "settled), separated by commas")
      .separated_by(',')
      .one_of({"settled", "moving", "stirred"})
      .show_default();
  command.add_option("--codec", options->codec, "Codec").show_default();
  command.add_option("--frames", options->frames, "Frames of each row").range(1, 100000).show_default();
  command
      .add_option(
          "--settled-after", options->settled_after,
          "Steps of the engine before a settled or stirred row begins; it begins earlier if all bodies stand still")
      .range(0, 100000)
      .show_default();
  command
      .add_option("--moving-after", options->moving_after, "Steps of the engine before a moving row begins")
      .range(0, 100000)
      .show_default();
  command.add_flag(
      "--pipeline", options->pipeline,
      "Compute the next step while a frame is encoded, as tandemd --pipeline on; a frame's time then "
      "includes what it waits for the other");
  add_seed_option(command, options->seed, "Seed of the start block and the scripted inputs");
  command.add_option("--domain", options->domain, "DDS domain, on loopback")
      .range(0U, transport::kMaxDomain)
      .show_default();
  command.add_option("--svg", options->chart, "File for a chart of all stages, both axes logarithmic");
  add_overwrite_option(command, options->overwrite);
  command.add_flag(
      "--peers", options->peers,
      "Measure the engine alone with a pile, beside LAMMPS (gran/hooke) and Bullet where they are installed");
  command.add_option("--play", options->play, "Session: be the client; the bench starts itself so");
  command.add_flag(
      "--json", options->json,
      "Print one JSON object: memory_bytes_per_s by threads; rows[state, predictor, threads, bodies, "
      "STAGE_ms{p50, p99}, STAGE_ns_a_body, frame_ms, steps_before, standing (share of the bodies that stood "
      "still then), mbit_per_s, frames_per_s, corrected_per_frame, "
      "colliding_per_frame (null if a step was always under way), engine|server|client_bytes_a_body]; slopes");
  command.footer(
      "STAGE is step (the engine), quantise, predict, encode, apply (the hash), publish (writing to DDS),\n"
      "client_predict, client_decode, client_apply. Times are wall clock; the client is a process beside the\n"
      "server, on the same cores. Bytes are those of the heap; a client's include its DDS.");
  command.on_chosen([options, &run] { run = [options] { return run_scale(*options); }; });
}

}  // namespace tandem::lab
