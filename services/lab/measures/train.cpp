#include "services/lab/measures/train.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sdk/core/tables/predictor_table.hpp"
#include "services/host/streams/residual_statistics.hpp"

namespace tandem::lab {
namespace {

constexpr double kMargin = 1.1;  // "slightly exceed the maximum error of experimental runs"

double radians(std::uint32_t on_lattice) { return std::ldexp(static_cast<double>(on_lattice), -28); }

/// Statistics of a stream's corrections in one pass over the source.
Result<host::ResidualStatistics> observe(const host::StreamConfig& config,
                                         const std::function<Result<Source>()>& make, std::uint64_t frames,
                                         const std::function<void(Frame)>& progress) {
  auto source = make();
  if (!source) return tl::unexpected(source.error());
  const engine::Simulation& simulation = *source->simulation;
  auto replay = Replay::create(*source->simulation, std::move(source->script), config.lattice);
  if (!replay) return tl::unexpected(replay.error());
  auto mirror = host::make_mirror({&config, 1}, simulation.bodies());
  if (!mirror) return tl::unexpected(mirror.error());
  auto stream = host::Stream::create(config, {.mirror = *mirror, .drive = replay->start_drive()});
  if (!stream) return tl::unexpected(stream.error());
  host::ResidualStatistics observed(config.layout.radii);
  for (Frame frame = 1; frame <= frames; ++frame) {
    if (auto stepped = replay->next(); !stepped) return tl::unexpected(stepped.error());
    for (const ScheduledDrive& input : replay->scheduled()) {
      if (auto scheduled = stream->schedule(input); !scheduled) return tl::unexpected(scheduled.error());
    }
    mirror->update(simulation.bodies(), simulation.events());
    stream->produce(*mirror, &observed);
    progress(frame);
  }
  return observed;
}

std::vector<std::uint8_t> lengths(std::span<const std::byte> tables, std::size_t first) {
  std::vector<std::uint8_t> result;
  for (const std::byte length : tables.subspan(first, kSymbols)) {
    result.push_back(std::to_integer<std::uint8_t>(length));
  }
  return result;
}

}  // namespace

Result<scenes::TrainedTable> train(scenes::Scene scene, sessions::SessionChoice choice,
                                   const std::function<Result<Source>()>& make, std::uint64_t frames,
                                   const std::function<void(Frame)>& progress) {
  scene.trained.clear();
  choice.codec = "selective";
  choice.predictor = basic_predictor().name;
  choice.automatic = false;
  const auto first = sessions::plan_stream(scene, choice);
  if (!first) return tl::unexpected(first.error());
  const auto ranges = observe(*first, make, frames, progress);
  if (!ranges) return tl::unexpected(ranges.error());
  scenes::TrainedTable table;
  table.bodies = choice.bodies;
  table.threshold_m = choice.threshold_m.value_or(scene.threshold_m * choice.threshold_scale);
  // A run without any correction still needs a range; one unit is the minimum.
  table.position_range_m = kMargin * std::max(1U, ranges->largest_position) / first->lattice.position_scale();
  table.velocity_range_m_per_s =
      kMargin * std::max(1U, ranges->largest_velocity) / first->lattice.velocity_scale();
  if (ranges->turns()) {
    table.turn_range_rad = kMargin * radians(std::max(1U, ranges->largest_turn));
    table.spin_range_rad_per_s = kMargin * radians(std::max(1U, ranges->largest_spin)) / first->lattice.dt_s;
  }

  scene.trained = {table};
  choice.codec = "quantized";
  const auto second = sessions::plan_stream(scene, choice);
  if (!second) return tl::unexpected(second.error());
  const auto counts = observe(*second, make, frames, [&](Frame frame) { progress(frames + frame); });
  if (!counts) return tl::unexpected(counts.error());
  const std::vector<std::byte> tables = host::trained_tables(*counts);
  table.position_code_lengths = lengths(tables, 0);
  table.velocity_code_lengths = lengths(tables, kSymbols);
  if (counts->turns()) {
    table.turn_code_lengths = lengths(tables, 2 * kSymbols);
    table.spin_code_lengths = lengths(tables, 3 * kSymbols);
  }
  return table;
}

}  // namespace tandem::lab
