#include "services/tool/scene_source.hpp"

#include <utility>

#include "sdk/core/codec/training.hpp"

namespace tandem::tool {

Result<Source> make_source(const scenes::Scene& scene, const SceneRun& run,
                           const ThresholdChoice& threshold) {
  auto simulation = scenes::make_simulation(scene, run.bodies, run.seed, run.threads);
  if (!simulation) return tl::unexpected(simulation.error());
  Source source;
  source.simulation = std::move(*simulation);
  source.threshold = threshold.of(scene.threshold_m);
  source.type_count = static_cast<TypeId>(scene.types.size());
  for (auto& scripted : scenes::scripted_inputs(scene, run.seed, run.users, run.frames)) {
    source.script.push_back({scripted.frame, std::move(scripted.input)});
  }
  return server::choose_lattice(source.threshold, scene.extent_m, source.simulation->dt_s())
      .map([&](const server::Lattice& lattice) {
        source.lattice = lattice;
        return std::move(source);
      });
}

scenes::TrainedTable table_for(const scenes::Scene& scene, std::uint32_t bodies, double threshold) {
  const scenes::TrainedTable* table = scenes::nearest_table(scene.trained, bodies, threshold);
  return table != nullptr ? *table : scenes::TrainedTable{};
}

Result<BandwidthRun> make_run(const Source& source, const scenes::TrainedTable& table,
                              const std::string& predictor, std::uint64_t frames) {
  return server::codec_parameters(source.lattice, source.threshold, table.position_range_m,
                                  table.velocity_range_m_per_s)
      .map([&](const CodecParameters& parameters) {
        BandwidthRun run;
        run.timeline.capacity = source.simulation->capacity();
        run.timeline.type_count = source.type_count;
        run.timeline.parameters = parameters;
        run.timeline.predictor = predictor;
        run.lattice = source.lattice;
        run.frames = frames;
        return run;
      });
}

CodecSetup make_codec_setup(const std::string& name, const scenes::TrainedTable& table,
                            std::size_t limited_budget_bytes) {
  CodecSetup setup{name, {}, name == "limited" ? limited_budget_bytes : kNoBudget};
  if (name != "entropy" && name != "limited") return setup;
  for (const auto* lengths : {&table.position_code_lengths, &table.velocity_code_lengths}) {
    for (const std::uint8_t length : *lengths) setup.tables.push_back(std::byte{length});
  }
  if (setup.tables.empty()) setup.tables = default_code_tables();
  return setup;
}

}  // namespace tandem::tool
