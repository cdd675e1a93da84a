#include "sdk/core/codec/paper/training.hpp"

#include <algorithm>

#include "sdk/core/codec/paper/residual.hpp"

namespace tandem {
namespace {

std::int32_t step_for(std::uint32_t largest) {
  // ceil(1.1 * largest / 127)
  const std::uint64_t step = (std::uint64_t{largest} * 11 + 1269) / 1270;
  return static_cast<std::int32_t>(std::clamp<std::uint64_t>(step, 1, kMaxStep));
}

void append_lengths(std::vector<std::byte>& tables, const SymbolCounts& counts) {
  for (const std::uint8_t length : build_code_lengths(counts))
    tables.push_back(static_cast<std::byte>(length));
}

}  // namespace

void CodecStatistics::observe(const State& predicted, const State& target,
                              const CodecParameters& parameters) {
  std::vector<std::uint8_t> marks(kBlockSlots);
  ++frames;
  for (std::uint32_t b = 0; b < block_count(predicted.capacity()); ++b) {
    for_each_beyond(predicted, target, block_at(b, predicted.capacity()), parameters.threshold,
                    std::span<std::uint8_t, kBlockSlots>(marks.data(), kBlockSlots),
                    [&](Slot slot, std::uint64_t) {
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
                    });
  }
}

CodecParameters trained_parameters(const CodecStatistics& statistics, std::int32_t threshold) {
  return {threshold, step_for(statistics.largest_position), step_for(statistics.largest_velocity)};
}

std::vector<std::byte> trained_tables(const CodecStatistics& statistics) {
  std::vector<std::byte> tables;
  append_lengths(tables, statistics.position_counts);
  append_lengths(tables, statistics.velocity_counts);
  return tables;
}

std::vector<std::byte> default_code_tables() {
  CodecStatistics typical;
  for (std::int64_t q = -128; q < 128; ++q) {
    const auto count = static_cast<std::uint64_t>((1 << 20) / (4 + q * q));
    typical.position_counts[static_cast<std::uint8_t>(q)] = count;
    typical.velocity_counts[static_cast<std::uint8_t>(q)] = count;
  }
  return trained_tables(typical);
}

}  // namespace tandem
