#include "services/host/streams/residual_statistics.hpp"

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
  if (!turns()) return;
  const Spin turn = turn_between(predicted.quaternion(slot), target.quaternion(slot));
  for (std::size_t i = 0; i < kSpinChannels; ++i) {
    largest_turn = std::max(largest_turn, magnitude(turn[i], 0));
    largest_spin = std::max(largest_spin, magnitude(predicted.w(i)[slot], target.w(i)[slot]));
    ++turn_counts[static_cast<std::uint8_t>(q[i + 6])];
    ++spin_counts[static_cast<std::uint8_t>(q[i + 9])];
  }
}

void ResidualStatistics::frame(const State& predicted, const State& target,
                               const CodecParameters& parameters) {
  ++frames;
  marks_.resize(kBlockSlots);
  const auto found = [&](Slot slot, std::uint64_t) { add(predicted, target, slot, parameters); };
  for (std::uint32_t b = 0; b < block_count(predicted.capacity()); ++b) {
    const Block block = block_at(b, predicted.capacity());
    if (turns()) {
      for_each_surface_beyond(predicted, target, block, parameters.threshold, radii_, found);
    } else {
      for_each_beyond(predicted, target, block, parameters.threshold,
                      std::span<std::uint8_t, kBlockSlots>(marks_.data(), kBlockSlots), found);
    }
  }
}

CodecParameters trained_parameters(const ResidualStatistics& statistics, std::int32_t threshold) {
  CodecParameters parameters{threshold, step_for(statistics.largest_position),
                             step_for(statistics.largest_velocity)};
  if (!statistics.turns()) return parameters;
  parameters.turn_step = step_for(statistics.largest_turn);
  parameters.spin_step = step_for(statistics.largest_spin);
  return parameters;
}

std::vector<std::byte> trained_tables(const ResidualStatistics& statistics) {
  std::vector<SymbolCounts> counts{statistics.position_counts, statistics.velocity_counts};
  if (statistics.turns()) counts.insert(counts.end(), {statistics.turn_counts, statistics.spin_counts});
  return code_tables(counts);
}

}  // namespace tandem::host
