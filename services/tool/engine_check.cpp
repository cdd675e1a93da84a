// tandem engine-check: plays the server of an engine in another process, and says what it does wrong.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "sdk/wire/clock.hpp"
#include "services/engines/door/door.hpp"
#include "services/engines/door/process.hpp"
#include "services/host/news/simulation_news.hpp"
#include "services/tool/commands.hpp"
#include "services/tool/print_error.hpp"

namespace tandem::tool {
namespace {

using engine::Bodies;
using engine::door::Door;
using engine::door::Hello;

struct EngineCheckOptions {
  std::vector<std::string> command;
  std::uint32_t frames = 60;
  bool network = false;
};

/// What was found, each kind of it once.
class Findings {
 public:
  void add(const char* severity, const std::string& kind, const std::string& text) {
    if (std::ranges::find(kinds_, kind) != kinds_.end()) return;
    kinds_.push_back(kind);
    wrong_ = wrong_ || severity == std::string("wrong");
    fmt::print("{}: {}\n", severity, text);
  }
  [[nodiscard]] bool wrong() const { return wrong_; }

 private:
  std::vector<std::string> kinds_;
  bool wrong_ = false;
};

std::string command_of(const std::vector<std::string>& words) {
  if (words.size() == 1) return words[0];
  std::string text = "exec";
  for (const std::string& word : words) text += " " + engine::door::quoted(word);
  return text;
}

void check_bodies(const Door& door, std::uint64_t frame, Findings& findings) {
  const Bodies bodies = door.bodies();
  const std::size_t types = door.hello().types.size();
  std::size_t alive = 0;
  const auto say = [&](const char* kind, std::size_t slot, const std::string& what) {
    findings.add("wrong", kind, fmt::format("frame {}, slot {}: {}", frame, slot, what));
  };
  for (std::size_t s = 0; s < bodies.alive.size(); ++s) {
    if (bodies.alive[s] == 0) continue;
    ++alive;
    for (std::size_t i = 0; i < 3; ++i) {
      if (!std::isfinite(bodies.position[i][s]))
        say("position", s, fmt::format("position {} is not a number", "xyz"[i]));
      if (!std::isfinite(bodies.velocity[i][s]))
        say("velocity", s, fmt::format("velocity {} is not a number", "xyz"[i]));
    }
    if (bodies.type[s] >= types)
      say("type", s, fmt::format("type {}, but HELLO lists {}", bodies.type[s], types));
    if (bodies.orientation[0].empty()) continue;
    double norm = 0, spin = 0;
    for (const auto& column : bodies.orientation) norm += double{column[s]} * double{column[s]};
    for (const auto& column : bodies.angular_velocity) spin += double{column[s]} * double{column[s]};
    if (!(std::abs(norm - 1) < 0.01))
      say("orientation", s, fmt::format("orientation has norm {:.3g}", std::sqrt(norm)));
    if (!(std::sqrt(spin) * door.dt_s() <= engine::kMaxTurn))
      say("angular_velocity", s, fmt::format("turns by {:.3g} rad in a step", std::sqrt(spin) * door.dt_s()));
  }
  if (alive == 0)
    findings.add("note", "alive", fmt::format("frame {}: nobody lives: is alive written?", frame));
}

/// Velocities per step, or with the wrong sign, are the usual mistake: clients predict with them.
void check_motion(const Door& door, const std::vector<float>& before, Findings& findings) {
  const Bodies bodies = door.bodies();
  double along = 0, moved = 0, speed = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t s = 0; s < bodies.alive.size(); ++s) {
      if (bodies.alive[s] == 0) continue;
      const double d =
          (double{bodies.position[i][s]} - double{before[i * bodies.alive.size() + s]}) / door.dt_s();
      const double v = double{bodies.velocity[i][s]};
      if (!std::isfinite(d) || !std::isfinite(v)) continue;
      along += d * v;
      moved += d * d;
      speed += v * v;
    }
  }
  if (moved == 0 || std::sqrt(moved) < 1e-3 * std::sqrt(speed)) return;
  if (speed == 0)
    return findings.add("note", "motion", "bodies move, but their velocities are 0: clients predict badly");
  const double ratio = along / moved;
  if (ratio < 0.5 || ratio > 2)
    findings.add(
        "note", "motion",
        fmt::format("velocities are {:.3g} times the motion: are they in scene units a second?", ratio));
}

/// Each step has a desk of its own: how much fits into how many frames depends on what else a session tells.
void check_news(Door& door, std::uint64_t frame, Findings& findings) {
  host::NewsDesk desk({.keys = door.tells().keys, .events = door.tells().events}, door.capacity());
  host::SimulationNews news;
  news.ask(door, desk, frame);
  if (const auto line = news.take_warning(0)) findings.add("wrong", "news", *line);
}

std::vector<float> positions(const Door& door) {
  std::vector<float> all;
  for (const auto& column : door.bodies().position) all.insert(all.end(), column.begin(), column.end());
  return all;
}

void send_inputs(Door& door) {
  const Hello& hello = door.hello();
  if (hello.most_gravity) door.apply({.kind = 1, .values = {*hello.most_gravity / 2, 0, 0}});
  if (hello.most_gravity)
    door.apply({.kind = 1, .values = {hello.gravity[0], hello.gravity[1], hello.gravity[2]}});
  if (hello.most_push) {
    const Bodies bodies = door.bodies();
    door.apply({.kind = 2,
                .values = {double{bodies.position[0][0]}, double{bodies.position[1][0]},
                           double{bodies.position[2][0]}, 1, 0, *hello.most_push / 100, 0}});
  }
  if (hello.most_bytes)
    door.apply(
        {.kind = 16, .bytes = std::vector<std::byte>(std::min(*hello.most_bytes, 16U), std::byte{'x'})});
}

void check_saving(Door& door, Findings& findings) {
  constexpr int kFrames = 5;
  std::vector<std::byte> saved;
  door.save(saved);
  if (saved.empty()) return findings.add("wrong", "save", "HELLO says save 1, but SAVE brought nothing");
  const auto go_on = [&door] {
    for (int i = 0; i < kFrames; ++i) door.step();
    return positions(door);
  };
  const std::vector<float> first = go_on();
  if (!door.load(saved)) return findings.add("wrong", "load", "it does not LOAD what it saved");
  const std::vector<float> second = go_on();
  double largest = 0;
  for (std::size_t i = 0; i < first.size(); ++i)
    largest = std::max(largest, std::abs(double{first[i]} - double{second[i]}));
  fmt::print("saves {} bytes; {} frames after LOAD are {}\n", saved.size(), kFrames,
             largest == 0 ? "the same to the bit" : fmt::format("up to {:.3g} apart", largest));
}

int run_check(const EngineCheckOptions& options) {
  Findings findings;
  engine::door::DoorOptions way;
  way.way.command = command_of(options.command);
  if (options.network) way.way.host = "127.0.0.1";
  way.log = [](const std::string& line, bool) { fmt::print("{}\n", line); };
  auto opened = Door::open(std::move(way));
  if (!opened) {
    fmt::print("wrong: {}\n", opened.error().message);
    return 1;
  }
  Door& door = **opened;
  const Hello& hello = door.hello();
  fmt::print("{}: {} slots, {:g} s a step, {}-bit floats{}{}, {} types, memory {}\n", hello.name,
             hello.capacity, hello.dt_s, hello.doubles ? 64 : 32, hello.turns ? ", bodies turn" : "",
             hello.saves ? ", saves" : "", hello.types.size(), hello.in_line ? "inline" : "shared");
  check_bodies(door, 0, findings);
  std::vector<double> took_ms;
  for (std::uint64_t frame = 1; frame <= options.frames && door.failure().empty(); ++frame) {
    if (frame == options.frames / 2) send_inputs(door);
    const std::vector<float> before = positions(door);
    const std::int64_t start_ns = transport::steady_ns();
    door.step();
    took_ms.push_back(static_cast<double>(transport::steady_ns() - start_ns) * 1e-6);
    if (!door.failure().empty()) break;
    check_bodies(door, frame, findings);
    check_news(door, frame, findings);
    if (frame < options.frames / 2) check_motion(door, before, findings);
  }
  if (door.failure().empty() && hello.saves) check_saving(door, findings);
  if (const std::string why = door.failure(); !why.empty()) findings.add("wrong", "failure", why);
  std::ranges::sort(took_ms);
  if (!took_ms.empty()) {
    const double median = took_ms[took_ms.size() / 2];
    fmt::print("a step takes {:.3g} ms (longest {:.3g}) of {:.3g}\n", median, took_ms.back(),
               1e3 * hello.dt_s);
    if (median > 1e3 * hello.dt_s) findings.add("note", "slow", "it is slower than real time");
  }
  fmt::print("{}\n", findings.wrong() ? "this engine has to be mended" : "this engine keeps the rules");
  return findings.wrong() ? 1 : 0;
}

}  // namespace

void add_engine_check(commandline::Command app, Run& run) {
  commandline::Command command = app.add_subcommand(
      "engine-check",
      "Plays the server of an engine in another process, and says what the engine does wrong.");
  const auto options = std::make_shared<EngineCheckOptions>();
  command
      .add_option("COMMAND", options->command,
                  "The engine and its arguments, after --; one word is a line for sh")
      .required();
  command.add_option("--frames", options->frames, "Frames to ask for").range(2U, 1'000'000U).show_default();
  command.add_flag("--network", options->network,
                   "Have the engine connect over TCP, as one on another machine does");
  command.footer("Exits with 1 if the engine breaks a rule of idl/ENGINE.md.");
  command.on_chosen([options, &run] { run = [options] { return run_check(*options); }; });
}

}  // namespace tandem::tool
