// `tandem bench memory`: bytes a slot costs a server and a client.

#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "services/tool/bench.hpp"
#include "services/tool/memory.hpp"
#include "services/tool/scene_source.hpp"

namespace tandem::tool {
namespace {

struct MemoryOptions {
  std::string scene = "half_pipe";
  std::uint32_t bodies = 10000;
  std::string codec = "entropy";
  std::uint64_t frames = 60;
  bool json = false;
};

Result<HostedSimulation> host_scene(const scenes::Scene& scene, const MemoryOptions& options,
                                    std::uint32_t bodies) {
  server::SessionChoice choice;
  choice.bodies = bodies;
  choice.codec = options.codec;
  auto session = server::plan_session(scene, choice);
  if (!session) return tl::unexpected(session.error());
  SceneRun run;
  run.bodies = bodies;
  return make_source(scene, run).map([&](Source&& source) {
    return HostedSimulation{std::move(source.simulation), std::move(*session)};
  });
}

int run_memory(const MemoryOptions& options) {
  const auto scene = scenes::load_scene(options.scene);
  if (!scene) return report("bench memory", scene.error());
  const std::uint32_t sizes[2] = {options.bodies, 2 * options.bodies};
  MemoryUse uses[2];
  for (std::size_t i = 0; i < 2; ++i) {
    const auto use = measure_memory([&] { return host_scene(*scene, options, sizes[i]); }, options.frames);
    if (!use) return report("bench memory", use.error());
    uses[i] = *use;
  }
  const struct {
    const char* name;
    std::int64_t MemoryUse::*bytes;
  } parts[] = {{"engine", &MemoryUse::engine_bytes},
               {"server", &MemoryUse::server_bytes},
               {"client", &MemoryUse::client_bytes}};
  nlohmann::ordered_json json{{"scene", scene->name}, {"bodies", options.bodies}, {"codec", options.codec}};
  if (!options.json)
    fmt::print("{:<8} {:>14} {:>14} {:>12}\n", "", "bytes a slot", "fixed bytes", "total bytes");
  for (const auto& part : parts) {
    const PerSlot cost = per_slot(uses[0].*part.bytes, uses[1].*part.bytes, sizes[0], sizes[1]);
    json[part.name] = {{"slot_bytes", cost.slot_bytes},
                       {"fixed_bytes", cost.fixed_bytes},
                       {"total_bytes", uses[0].*part.bytes}};
    if (!options.json) {
      fmt::print("{:<8} {:>14.1f} {:>14.0f} {:>12}\n", part.name, cost.slot_bytes, cost.fixed_bytes,
                 uses[0].*part.bytes);
    }
  }
  if (options.json) fmt::print("{}\n", json.dump());
  return 0;
}

}  // namespace

void add_memory(CLI::App& bench, Run& run) {
  CLI::App* command =
      bench.add_subcommand("memory", "Heap bytes of engine, server and client while playing, DDS excluded.");
  const auto options = std::make_shared<MemoryOptions>();
  command->add_option("--scene", options->scene, "Scene by name or file")->capture_default_str();
  command
      ->add_option("--bodies", options->bodies,
                   "Number of bodies; twice as many are measured too, for the slope")
      ->check(CLI::Range(1U, scenes::kMaxBodies / 2))
      ->capture_default_str();
  std::vector<std::string> names;
  for (const std::string_view name : codec_names()) names.emplace_back(name);
  command->add_option("--codec", options->codec, "Codec")->check(CLI::IsMember(names))->capture_default_str();
  command->add_option("--frames", options->frames, "Frames to play")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  command->add_flag("--json", options->json, "One JSON object");
  command->callback([options, &run] { run = [options] { return run_memory(*options); }; });
}

}  // namespace tandem::tool
