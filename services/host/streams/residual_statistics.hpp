#pragma once
// Learns from corrections for the thesis's codecs: quantisation ranges and Huffman code lengths.

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "sdk/core/codec/observer.hpp"
#include "sdk/core/codec/paper/huffman.hpp"

namespace tandem::host {

/// Residuals of the bodies beyond the threshold, summed over the observed frames; with orientations, of
/// bodies whose surface is beyond it. Training takes two passes over the same inputs. The first, with
/// `selective`, finds the maximum residuals. The second, with `quantized` and the ranges found, counts the
/// symbols.
struct ResidualStatistics final : EncodeObserver {
  ResidualStatistics() = default;
  /// `radii`: Layout::radii of the stream.
  explicit ResidualStatistics(std::vector<std::int32_t> radii) : radii_(std::move(radii)) {}
  void frame(const State& predicted, const State& target, const CodecParameters& parameters) override;

  std::uint64_t frames = 0;
  std::uint64_t bodies = 0;            ///< corrected bodies, summed over all frames
  std::uint32_t largest_position = 0;  ///< of one component, lattice units
  std::uint32_t largest_velocity = 0;  ///< of one component, 1/64 unit per frame
  SymbolCounts position_counts{};      ///< by residual byte (two's complement), with the parameters in force
  SymbolCounts velocity_counts{};
  // Only with orientations.
  std::uint32_t largest_turn = 0;  ///< of one component of a rotation vector, 2^-28 rad
  std::uint32_t largest_spin = 0;  ///< of one component of an angular velocity, 2^-28 rad per frame
  SymbolCounts turn_counts{};
  SymbolCounts spin_counts{};
  [[nodiscard]] bool turns() const { return !radii_.empty(); }

 private:
  void add(const State& predicted, const State& target, Slot slot, const CodecParameters& parameters);

  std::vector<std::int32_t> radii_;
  std::vector<std::uint8_t> marks_;
};

/// Steps of which 127 are 1.1 x the maximum residual ("slightly exceed the maximum error of experimental
/// runs").
[[nodiscard]] CodecParameters trained_parameters(const ResidualStatistics& statistics,
                                                 std::int32_t threshold);

/// The code lengths that follow from the symbol counts: see code_tables.hpp.
[[nodiscard]] std::vector<std::byte> trained_tables(const ResidualStatistics& statistics);

}  // namespace tandem::host
