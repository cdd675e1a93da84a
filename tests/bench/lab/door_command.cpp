// `bench_lab door`: what it costs that an engine is another process.

#include "tandem/engine.h"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "services/engines/door/door.hpp"
#include "services/engines/sessions/session_plan.hpp"
#include "services/host/frames/live_source.hpp"
#include "services/lab/commands/bench.hpp"
#include "services/lab/measures/scene_source.hpp"
#include "services/program/json/json.hpp"
#include "tests/bench/lab/commands.hpp"

namespace tandem::lab {
namespace {

using engine::door::Door;

struct DoorOptions {
  std::vector<std::uint32_t> bodies{10'000, 100'000, 1'000'000};
  std::uint32_t frames = 200;
  std::string python = "/usr/bin/python3", scene = "half_pipe", play;
  std::uint32_t scene_bodies = 10'000;
  bool json = false;
};

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
}

double ms_since(std::int64_t start_ns) { return static_cast<double>(steady_ns() - start_ns) * 1e-6; }

// --- The engine's side: what the bench starts ---

template <class T>
void put(const tandem_engine& door, const char* column, std::uint32_t axis, std::span<const T> values) {
  std::memcpy(tandem_engine_column(&door, column, axis), values.data(), values.size_bytes());
}

void put(const tandem_engine& door, const engine::Bodies& bodies) {
  for (std::uint32_t axis = 0; axis < 3; ++axis) {
    put(door, "position", axis, bodies.position[axis]);
    put(door, "velocity", axis, bodies.velocity[axis]);
    if (!bodies.orientation[0].empty()) put(door, "angular_velocity", axis, bodies.angular_velocity[axis]);
  }
  for (std::uint32_t axis = 0; axis < 4 && !bodies.orientation[0].empty(); ++axis)
    put(door, "orientation", axis, bodies.orientation[axis]);
  put(door, "alive", 0, bodies.alive);
  put(door, "type", 0, bodies.type);
}

/// Serves the frames of `write` until the server ends. Returns an exit code.
int serve_door(const std::string& hello, const std::function<void(tandem_engine&)>& write,
               const std::function<void()>& step) {
  static tandem_engine door;
  if (tandem_engine_open(&door, hello.c_str()) != 0) return tandem_engine_close(&door);
  write(door);
  tandem_engine_start(&door);
  for (;;) {
    const int what = tandem_engine_next(&door);
    if (what == TANDEM_ENGINE_BYE || what < 0) return tandem_engine_close(&door);
    if (what != TANDEM_ENGINE_STEP) continue;
    step();
    write(door);
    tandem_engine_done(&door, 0);
  }
}

/// Columns that stand still: only the hand-over costs.
int play_columns(std::uint32_t bodies) {
  std::vector<float> zero(bodies), one(bodies, 1.0F);
  std::vector<std::uint8_t> alive(bodies, 1);
  std::vector<std::uint16_t> type(bodies);
  std::vector<std::vector<float>> own(13, zero);
  own[9] = one;
  engine::Bodies columns;
  for (std::size_t i = 0; i < 3; ++i) columns.position[i] = own[i];
  for (std::size_t i = 0; i < 3; ++i) columns.velocity[i] = own[3 + i];
  for (std::size_t i = 0; i < 4; ++i) columns.orientation[i] = own[6 + i];
  for (std::size_t i = 0; i < 3; ++i) columns.angular_velocity[i] = own[10 + i];
  columns.alive = alive;
  columns.type = type;
  return serve_door(
      fmt::format("name columns\ncapacity {}\ndt 0.033\nturns 1\n", bodies),
      [&columns](tandem_engine& door) { put(door, columns); }, [] {});
}

int play_scene(const std::string& name, std::uint32_t bodies) {
  const auto scene = scenes::load_scene(name);
  if (!scene) return refuse("door", scene.error());
  auto simulation = scenes::make_simulation(*scene, bodies, 1, 1);
  if (!simulation) return refuse("door", simulation.error());
  // With what clients predict with: otherwise the frames would have other corrections, and so other costs.
  const engine::Vec3 g = (*simulation)->gravity();
  std::string hello =
      fmt::format("name {}\ncapacity {}\ndt {}\nturns {:d}\ngravity {} {} {}\ndamping {}\n", name, bodies,
                  scene->dt_s, scene->turns, g[0], g[1], g[2], (*simulation)->damping_per_s());
  for (const scenes::BodyType& type : scene->types)
    hello += fmt::format("type {} {}\n", type.name, type.bounding_radius_m);
  return serve_door(
      hello, [&](tandem_engine& door) { put(door, (*simulation)->bodies()); },
      [&] { (*simulation)->step(); });
}

int play(const std::string& what) {
  const std::size_t colon = what.find(':');
  const auto bodies = static_cast<std::uint32_t>(std::strtoul(what.c_str() + colon + 1, nullptr, 10));
  const std::string name = what.substr(0, colon);
  return name == "columns" ? play_columns(bodies) : play_scene(name, bodies);
}

// --- The server's side ---

Result<std::unique_ptr<Door>> open(const std::string& command) {
  engine::door::DoorOptions options;
  options.way.command = command;
  return Door::open(std::move(options));
}

struct Trip {
  std::vector<double> done_ms, read_ms;
};

Result<Trip> measure(Door& door, std::uint32_t frames) {
  Trip trip;
  constexpr std::uint32_t kWarm = 5;
  for (std::uint32_t i = 0; i < frames + kWarm; ++i) {
    const std::int64_t start_ns = steady_ns();
    door.begin_step();
    pollfd answer{.fd = door.step_descriptor(), .events = POLLIN, .revents = 0};
    ::poll(&answer, 1, 10'000);
    const double done_ms = ms_since(start_ns);
    while (!door.step_ready()) ::poll(&answer, 1, 10);
    if (std::string why = door.failure(); !why.empty()) return fail(ErrorCode::kIo, std::move(why));
    if (i < kWarm) continue;
    trip.done_ms.push_back(done_ms);
    trip.read_ms.push_back(ms_since(start_ns) - done_ms);
  }
  return trip;
}

std::string numpy_command(const std::string& python, std::uint32_t bodies) {
  return fmt::format(
      "exec {} -B -c 'import numpy as np, tandem\n"
      "n = {}\n"
      "p, v, w = (np.zeros((n, 3), np.float32) for _ in range(3))\n"
      "q = np.zeros((n, 4), np.float32); q[:, 3] = 1; t = np.zeros(n, np.uint16)\n"
      "with tandem.Server(n, 0.033, turns=True) as server:\n"
      "    server.start(position=p, velocity=v, orientation=q, angular_velocity=w, type=t)\n"
      "    for frame in server.frames():\n"
      "        frame.write(position=p, velocity=v, orientation=q, angular_velocity=w, type=t)'",
      python, bodies);
}

/// Milliseconds of whole frames, as a server makes them: the step until its bodies are there; and the rest,
/// which is rounding, prediction and encoding. The fastest tenth is what other programs did not disturb.
struct Frames {
  std::vector<double> whole_ms, step_ms, rest_ms;
  std::vector<double> processor_ms;  // of a frame, of server and engine together; means of 20
  std::vector<std::uint64_t> hashes;
};

// Of this thread, and of the engine's process if there is one.
double processor_ms(int engine) {
  const auto ms_of = [](clockid_t clock) {
    timespec used{};
    if (::clock_gettime(clock, &used) != 0) return 0.0;
    return 1e3 * static_cast<double>(used.tv_sec) + 1e-6 * static_cast<double>(used.tv_nsec);
  };
  clockid_t theirs{};
  const bool known = engine > 0 && ::clock_getcpuclockid(engine, &theirs) == 0;
  return ms_of(CLOCK_THREAD_CPUTIME_ID) + (known ? ms_of(theirs) : 0);
}

Result<void> make_frames(host::LiveSource& source, int engine, std::uint32_t frames, Frames& into) {
  host::Outbox outbox({});
  const double began_ms = processor_ms(engine);
  for (std::uint32_t i = 0; i < frames; ++i) {
    const std::int64_t start_ns = steady_ns();
    source.begin_next();
    while (!source.next_ready()) {
      pollfd answer{.fd = source.next_descriptor(), .events = POLLIN, .revents = 0};
      ::poll(&answer, 1, 10);
    }
    const double step_ms = ms_since(start_ns);
    const auto made = source.next({}, outbox);
    if (!made) return tl::unexpected(*source.error());
    into.whole_ms.push_back(ms_since(start_ns));
    into.step_ms.push_back(step_ms);
    into.rest_ms.push_back(into.whole_ms.back() - step_ms);
    for (const host::MadeDelta& delta : made->deltas) into.hashes.push_back(delta.hash);
  }
  into.processor_ms.push_back((processor_ms(engine) - began_ms) / frames);
  return {};
}

std::string text_of(const Frames& frames) {
  return fmt::format("{:.3f} ms (fastest tenth {:.3f}; step {:.3f}, rest {:.3f}; processors {:.3f})",
                     quantile(frames.whole_ms, 0.5), quantile(frames.whole_ms, 0.1),
                     quantile(frames.step_ms, 0.5), quantile(frames.rest_ms, 0.5),
                     quantile(frames.processor_ms, 0.5));
}

Json json_of(const Frames& frames) {
  return {{"whole_ms", quantile(frames.whole_ms, 0.5)},
          {"fastest_tenth_ms", quantile(frames.whole_ms, 0.1)},
          {"step_ms", quantile(frames.step_ms, 0.5)},
          {"rest_ms", quantile(frames.rest_ms, 0.5)},
          {"processor_ms", quantile(frames.processor_ms, 0.5)}};
}

int run_door(const DoorOptions& options) {
  if (!options.play.empty()) return play(options.play);
  const std::string self = fmt::format("exec /proc/{}/exe door --play ", ::getpid());
  Json rows = Json::array();
  const auto line = [&options](const std::string& text) {
    if (!options.json) fmt::print("{}\n", text);
  };
  line("STEP sent to DONE received, and the server's copies after it; ms, median (p99)");
  for (const std::uint32_t bodies : options.bodies) {
    for (const bool numpy : {false, true}) {
      const std::string name = numpy ? "numpy" : "C";
      auto door =
          open(numpy ? numpy_command(options.python, bodies) : fmt::format("{}columns:{}", self, bodies));
      auto trip = door ? measure(**door, options.frames) : Result<Trip>(tl::unexpected(door.error()));
      if (!trip) {
        line(fmt::format("{:>9} {:5}  not measured: {}", bodies, name, trip.error().message));
        rows.push_back({{"bodies", bodies}, {"engine", name}, {"error", trip.error().message}});
        continue;
      }
      const double p50 = quantile(trip->done_ms, 0.5), p99 = quantile(trip->done_ms, 0.99);
      const double read = quantile(trip->read_ms, 0.5);
      line(fmt::format("{:>9} {:5}  {:.3f} ({:.3f})  {:.3f}", bodies, name, p50, p99, read));
      rows.push_back(
          {{"bodies", bodies}, {"engine", name}, {"done_ms", p50}, {"done_ms_p99", p99}, {"read_ms", read}});
    }
  }
  const auto scene = scenes::load_scene(options.scene);
  if (!scene) return refuse("door", scene.error());
  auto linked = scenes::make_simulation(*scene, options.scene_bodies, 1, 1);
  if (!linked) return refuse("door", linked.error());
  auto door = open(fmt::format("{}{}:{}", self, options.scene, options.scene_bodies));
  if (!door) return refuse("door", door.error());
  sessions::SessionChoice choice;
  choice.bodies = options.scene_bodies;
  const auto config = sessions::plan_session(*scene, choice);
  if (!config) return refuse("door", config.error());
  auto linked_frames = host::LiveSource::create(*config, **linked),
       door_frames = host::LiveSource::create(*config, **door);
  if (!linked_frames || !door_frames)
    return refuse("door", linked_frames ? door_frames.error() : linked_frames.error());
  // In turns, so that both see the same machine.
  Frames here, there;
  for (std::uint32_t done = 0; done < options.frames; done += 20) {
    const auto a = make_frames(**linked_frames, 0, 20, here);
    const auto b = make_frames(**door_frames, (*door)->engine_process(), 20, there);
    if (!a || !b) return refuse("door", a ? b.error() : a.error());
  }
  if (here.hashes != there.hashes)
    return refuse("door", {ErrorCode::kMismatch, "the engine behind the door makes other frames"});
  const double ratio = quantile(there.whole_ms, 0.5) / quantile(here.whole_ms, 0.5);
  line(fmt::format("{} with {} bodies, whole frames: linked in {}, behind the door {}: {:+.1f} %",
                   options.scene, options.scene_bodies, text_of(here), text_of(there), 100 * (ratio - 1)));
  if (options.json)
    fmt::print("{}\n", Json{{"hand_over", rows}, {"linked", json_of(here)}, {"door", json_of(there)}}.dump());
  return 0;
}

}  // namespace

void add_door(commandline::Command app, Run& run) {
  commandline::Command command =
      app.add_subcommand("door", "Measures what it costs that an engine is another process (idl/ENGINE.md).");
  const auto options = std::make_shared<DoorOptions>();
  add_bodies_option(command, options->bodies);
  command.add_option("--frames", options->frames, "Frames of each row").range(20U, 100'000U).show_default();
  command.add_option("--python", options->python, "Interpreter with numpy and the package tandem")
      .show_default();
  command.add_option("--scene", options->scene, "Scene that is also linked in").show_default();
  command.add_option("--scene-bodies", options->scene_bodies, "Its bodies")
      .range(1U, engine::kMaxBodies)
      .show_default();
  command.add_option("--play", options->play,
                     "columns:N or SCENE:N: be the engine; the bench starts itself so");
  command.add_flag("--json", options->json, "Print one JSON object");
  command.on_chosen([options, &run] { run = [options] { return run_door(*options); }; });
}

}  // namespace tandem::lab
