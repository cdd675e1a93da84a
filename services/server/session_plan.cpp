#include "services/server/session_plan.hpp"

#include "sdk/core/codec/training.hpp"

namespace tandem::server {
namespace {

std::vector<std::byte> codec_tables(const std::string& codec, const scenes::TrainedTable& table) {
  std::vector<std::byte> bytes;
  if (codec != "entropy" && codec != "limited") return bytes;
  for (const auto* lengths : {&table.position_code_lengths, &table.velocity_code_lengths}) {
    for (const std::uint8_t length : *lengths) bytes.push_back(std::byte{length});
  }
  return bytes.empty() ? default_code_tables() : bytes;
}

}  // namespace

Result<HostConfig> plan_session(const scenes::Scene& scene, const SessionChoice& choice) {
  const double threshold_m = choice.threshold_m.value_or(scene.threshold_m * choice.threshold_scale);
  const auto lattice = choose_lattice(threshold_m, scene.extent_m, scene.dt_s);
  if (!lattice) return tl::unexpected(lattice.error());
  const scenes::TrainedTable* trained = scenes::nearest_table(scene.trained, choice.bodies, threshold_m);
  const scenes::TrainedTable table = trained == nullptr ? scenes::TrainedTable{} : *trained;
  const auto parameters =
      codec_parameters(*lattice, threshold_m, table.position_range_m, table.velocity_range_m_per_s);
  if (!parameters) return tl::unexpected(parameters.error());

  HostConfig config;
  config.lattice = *lattice;
  config.parameters = *parameters;
  config.frame_rate_hz = 1 / scene.dt_s;
  config.codec = choice.codec;
  config.codec_tables = codec_tables(choice.codec, table);
  config.budget = choice.codec == "limited" ? choice.budget_bytes : kNoBudget;
  config.predictor = choice.predictor;
  config.decay = recommended_decay(choice.codec);
  config.scene = scene.name;
  config.scene_description = scene.text;
  config.types.clear();
  for (const scenes::BodyType& type : scene.types) {
    config.types.push_back(
        {.name = type.name, .radius = static_cast<float>(type.radius_m), .colour_rgba = type.colour_rgba});
  }
  return config;
}

Result<std::size_t> largest_delta_bytes(const HostConfig& config, std::uint32_t capacity) {
  return ServerTimeline::create(timeline_config(config, capacity), config.epoch)
      .map([](const ServerTimeline& timeline) { return timeline.payload_bound(); });
}

}  // namespace tandem::server
