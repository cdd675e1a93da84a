#pragma once
// The tracker's encoder: finds the bodies of the full simulation that stand still. Nothing here is on the
// wire.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/codec/codec.hpp"
#include "sdk/core/lattice/state.hpp"

namespace tandem {

/// Remembers where bodies were, because bodies tremble in engines that put none to sleep.
class Stillness {
 public:
  /// `radii`: those of the stream, with orientations.
  Stillness(std::uint32_t capacity, std::span<const std::int32_t> radii);

  /// Takes the full simulation of the next frame.
  void follow(const CodecFrame& frame, const State& target);
  /// True if a body may be put to rest: it hardly moved in the last frame, and something holds it up (a body
  /// at the top of its throw is slow too).
  [[nodiscard]] bool is_still(const CodecFrame& frame, const State& target, Slot slot) const;

 private:
  std::array<std::vector<std::int32_t>, 3> p_, moved_, moved_before_;  // lattice units
  std::array<std::vector<std::int32_t>, kQuaternionChannels> q_, q_before_;
  std::span<const std::int32_t> radii_;
  std::vector<std::uint8_t> frames_;  // frames seen since the body was renewed, 0 .. 2
};

}  // namespace tandem
