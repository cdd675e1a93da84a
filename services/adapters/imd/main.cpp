// tandem-imd: an engine that speaks IMD, unmodified, as an engine of a Tandem server (idl/ENGINE.md).
#include "tandem/engine.h"  // first: it asks the system for more

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <exception>
#include <memory>
#include <string>
#include <vector>

#include "services/adapters/imd/motion.hpp"
#include "services/adapters/imd/source.hpp"
#include "services/adapters/imd/topology.hpp"
#include "services/program/commandline/commandline.hpp"

namespace {

using namespace tandem::imd;

struct Options {
  std::string address, topology;
  std::optional<double> radius;
  double scale = 1, rate_hz = 30, force = 1, most_push = 100;
  std::uint32_t steps = 0;
};

/// HOST:PORT, or [HOST]:PORT; imd:// may stand before it.
bool split_address(std::string text, std::string& host, std::string& port) {
  if (text.starts_with("imd://")) text.erase(0, 6);
  while (text.ends_with('/')) text.pop_back();
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos || colon == 0 || colon + 1 == text.size()) return false;
  host = text.substr(0, colon);
  port = text.substr(colon + 1);
  if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
  return !host.empty() && std::ranges::all_of(port, [](char c) { return c >= '0' && c <= '9'; });
}

std::string hello_of(const Topology& topology, const Options& options) {
  std::string lines = fmt::format("name imd\nscene imd\nup z\nstep_limit 60\ncapacity {}\ndt {:.17g}\n",
                                  topology.kind_of.size(), 1 / options.rate_hz);
  if (options.force > 0) lines += fmt::format("input push {:.9g}\n", options.most_push);
  for (const Kind& kind : topology.kinds)
    lines += fmt::format("type {} {:.9g} {:08X} {:.9g} sphere\n", kind.name, kind.radius * options.scale,
                         kind.colour_rgba, kind.mass);
  // Unwrapped atoms of a liquid drift out of their box.
  if (topology.box)
    lines += fmt::format("extent {:.9g}\n", 4 * options.scale * *std::ranges::max_element(*topology.box));
  return lines;
}

/// One server and one engine of IMD.
class Bridge {
 public:
  Bridge(const Options& options, Topology topology, Source& source)
      : options_(options),
        topology_(std::move(topology)),
        source_(source),
        motion_(topology_, {options.scale, 1 / options.rate_hz}) {}

  int play() {
    if (tandem_engine_open(door_.get(), hello_of(topology_, options_).c_str()) != 0) return give_up();
    const auto session = source_.connect();
    if (!session) return give_up(session.error().message);
    std::printf("IMD version %d%s\n", session->version,
                session->version == 2 ? ": without time and velocities, which are made of differences"
                : session->velocities && session->time ? ""
                                                       : ": velocities are made of differences");
    std::fflush(stdout);
    Newest newest;
    if (!source_.wait(0, std::chrono::seconds{40}, newest))
      return give_up(why("the engine sent no frame for 40 s"));
    show(newest);
    tandem_engine_start(door_.get());
    for (;;) {
      switch (tandem_engine_next(door_.get())) {
        case TANDEM_ENGINE_INPUT:
          if (door_->kind == TANDEM_ENGINE_PUSH) push(door_->values);
          break;
        case TANDEM_ENGINE_STEP:
          if (source_.wait(shown_, std::chrono::seconds{1}, newest)) {
            show(newest);
          } else if (!source_.failure().empty()) {
            return give_up(source_.failure());
          } else {
            motion_.hold();
            write();
          }
          tandem_engine_done(door_.get(), 0);
          break;
        default:
          return give_up();
      }
    }
  }

 private:
  std::string why(const std::string& otherwise) const {
    return source_.failure().empty() ? otherwise : source_.failure();
  }

  int give_up(const std::string& line = {}) {
    if (!line.empty()) {
      tandem_engine_complain(door_.get(), line.c_str());
      std::fprintf(stderr, "tandem-imd: %s\n", line.c_str());
      tandem_engine_close(door_.get());
      return 1;
    }
    if (door_->error[0] != 0) std::fprintf(stderr, "tandem-imd: %s\n", door_->error);
    return tandem_engine_close(door_.get());
  }

  void show(const Newest& newest) {
    // A push lasts from one frame of the server to the next; the engine would go on with it for ever.
    if (!pushed_.empty() && newest.number > pushed_at_) {
      source_.send_forces(pushed_, std::vector<float>(3 * pushed_.size(), 0.0F));
      pushed_.clear();
    }
    shown_ = newest.number;
    motion_.show(newest);
    write();
  }

  void write() {
    const auto put = [this](const char* name, std::uint32_t axis, const void* from, std::size_t bytes) {
      std::memcpy(tandem_engine_column(door_.get(), name, axis), from, bytes);
    };
    const Columns& columns = motion_.columns();
    for (std::uint32_t d = 0; d < 3; ++d) {
      put("position", d, columns.position[d].data(), columns.position[d].size() * sizeof(float));
      put("velocity", d, columns.velocity[d].data(), columns.velocity[d].size() * sizeof(float));
    }
    put("alive", 0, columns.alive.data(), columns.alive.size());
    put("type", 0, topology_.kind_of.data(), topology_.kind_of.size() * sizeof(std::uint16_t));
  }

  void push(const double* values) {
    std::vector<std::int32_t> atoms = motion_.within({values[0], values[1], values[2]}, values[3]);
    const std::size_t inside = atoms.size();
    if (inside == 0) return;
    // New forces replace those of before: the others' end.
    for (const std::int32_t old : pushed_)
      if (!std::binary_search(atoms.begin(), atoms.begin() + static_cast<std::ptrdiff_t>(inside), old))
        atoms.push_back(old);
    std::vector<float> forces(3 * atoms.size(), 0.0F);
    for (std::size_t i = 0; i < inside; ++i) {
      const double mass = topology_.kinds[topology_.kind_of[static_cast<std::size_t>(atoms[i])]].mass;
      for (std::size_t d = 0; d < 3; ++d)
        forces[3 * i + d] = static_cast<float>(options_.force * mass * values[4 + d]);
    }
    source_.send_forces(atoms, forces);
    std::ranges::sort(atoms);
    pushed_ = std::move(atoms);
    pushed_at_ = shown_;
  }

  const Options& options_;
  Topology topology_;
  Source& source_;
  Motion motion_;
  std::unique_ptr<tandem_engine> door_ = std::make_unique<tandem_engine>();
  std::uint64_t shown_ = 0, pushed_at_ = 0;
  std::vector<std::int32_t> pushed_;
};

int run(const Options& options, const std::string& host, const std::string& port) {
  auto topology = read_topology(options.topology, options.radius);
  if (!topology) {
    std::fprintf(stderr, "tandem-imd: %s\n", topology.error().message.c_str());
    return 1;
  }
  if (!topology->note.empty()) std::printf("%s\n", topology->note.c_str());
  const auto atoms = static_cast<std::uint32_t>(topology->kind_of.size());
  Source source(
      {.host = host, .port = port, .atoms = atoms, .rate = static_cast<std::int32_t>(options.steps)});
  return Bridge(options, std::move(*topology), source).play();
}

}  // namespace

int main(int argc, char** argv) {
  tandem::commandline::Program app{
      "Shows a simulation that speaks IMD, such as LAMMPS, GROMACS or NAMD, to a Tandem server as its engine.",
      "tandem-imd"};
  app.version("tandem-imd " TANDEM_VERSION);
  Options options;
  app.add_option("address", options.address, "Where the simulation listens: HOST:PORT or imd://HOST:PORT")
      .required();
  app.add_option(
         "--topology", options.topology,
         "What the atoms are: a .gro, .pdb or .xyz file, a data file of LAMMPS, or lines `COUNT NAME RADIUS RRGGBBAA MASS`; also as .gz")
      .required()
      .existing_file();
  app.add_option("--radius", options.radius,
                 "Of atoms that have none in the topology (default: by element, or by their number)")
      .positive();
  app.add_option("--scale", options.scale,
                 "Scene units of a unit of the simulation, which is an Angstrom by the protocol")
      .positive()
      .show_default();
  app.add_option("--rate", options.rate_hz, "Most frames a second; the newest one is shown")
      .range(1.0, 1000.0)
      .show_default();
  app.add_option(
         "--steps", options.steps,
         "Steps of the simulation between two frames that it sends; 0: as it is set up. Small ones make good velocities")
      .range(0U, 1'000'000U)
      .show_default();
  app.add_option("--force", options.force,
                 "Force on an atom of mass 1 for a push of 1, during one frame; 0: users cannot push")
      .not_negative()
      .show_default();
  app.add_option("--most-push", options.most_push, "The largest push that users may send")
      .positive()
      .show_default();
  app.footer(
      "tandemd starts it for --engine imd://HOST:PORT --topology FILE; with more options: --engine 'tandem-imd HOST:PORT --topology "
      "FILE ...'. Exit codes: 0 the server ended, 1 failed, 2 wrong usage.");
  std::string host, port;
  app.on_chosen([&] {
    if (!split_address(options.address, host, port))
      tandem::commandline::refuse("address", "expected HOST:PORT");
  });
  if (const auto code = app.parse(argc, argv)) return *code;
  try {
    return run(options, host, port);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "tandem-imd: %s\n", error.what());
    return 1;
  }
}
