#include "services/host/residual_statistics.hpp"

#include <algorithm>

#include "sdk/core/codec/paper/code_tables.hpp"
#include "sdk/core/codec/paper/residual.hpp"

namespace tandem::host {
namespace {

std::int32_t step_for(std::uint32_t largest) {
  // ceil(1.1 * largest / 127)
  const std::uint64_t step = (std::uint64_t{largest} * 11 + 1269) / 1270;
  return static_cast<std::int32_t>(std::clamp<std::uint64_t>(step, 1, kMaxStep));
}

}  // namespace

void ResidualStatistics::add(const State& predicted, const State& target, Slot slot,
                             const CodecParameters& parameters) {
  ++bodies;
  const Residual q = quantise(predicted, target, slot, parameters);
  for (std::size_t i = 0; i < 3; ++i) {
    const std::uint32_t p = magnitude(predicted.p(i)[slot], target.p(i)[slot]);
    const std::uint32_t v = magnitude(predicted.v(i)[slot], target.v(i)[slot]);
    largest_position = std::max(largest_position, p);
    largest_velocity = std::max(largest_velocity, v);
    ++position_counts[static_cast<std::uint8_t>(q[i])];
    ++velocity_counts[static_cast<std::uint8_t>(q[i + 3])];
  }
}

void ResidualStatistics::frame(const State& predicted, const State& target,
                               const CodecParameters& parameters) {
  ++frames;
  if (!radii_.empty()) {
    for (Slot slot = 0; slot < predicted.capacity(); ++slot) {
      if (predicted.alive()[slot] == 0) continue;
      const std::int32_t radius = radii_[predicted.type()[slot]];
      const std::uint64_t error = surface_error(predicted.body(slot), target.body(slot), radius);
      if (error > static_cast<std::uint32_t>(parameters.threshold)) add(predicted, target, slot, parameters);
    }
    return;
  }
  marks_.resize(kBlockSlots);
  for (std::uint32_t b = 0; b < block_count(predicted.capacity()); ++b) {
    for_each_beyond(predicted, target, block_at(b, predicted.capacity()), parameters.threshold,
                    std::span<std::uint8_t, kBlockSlots>(marks_.data(), kBlockSlots),
                    [&](Slot slot, std::uint64_t) { add(predicted, target, slot, parameters); });
  }
}

CodecParameters trained_parameters(const ResidualStatistics& statistics, std::int32_t threshold) {
  return {threshold, step_for(statistics.largest_position), step_for(statistics.largest_velocity)};
}

std::vector<std::byte> trained_tables(const ResidualStatistics& statistics) {
  return code_tables(statistics.position_counts, statistics.velocity_counts);
}

}  // namespace tandem::host
