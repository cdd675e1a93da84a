#pragma once
// An encoder that finds the bodies of the full simulation that stand still. Nothing here is on the
// wire.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/codec/codec.hpp"
#include "sdk/core/codec/selection.hpp"
#include "sdk/core/lattice/state.hpp"

namespace tandem {

/// Remembers where bodies were in the last two frames, because bodies tremble in engines that put none to
/// sleep.
class Stillness {
 public:
  /// `radii`: those of the stream, with orientations.
  Stillness(std::uint32_t capacity, std::span<const std::int32_t> radii);

  /// Begins the next frame: forgets the bodies that it renews.
  void begin(const CodecFrame& frame);
  /// True if a body may be put to rest: it hardly moved in the last frame, and something holds it up (a body
  /// at the top of its throw is slow too).
  [[nodiscard]] bool is_still(const CodecFrame& frame, const State& target, Slot slot) const;
  /// Ends the frame: remembers where the full simulation has a block. Blocks may be remembered side by side.
  /// A block that has not moved for two frames costs nothing.
  void remember(const CodecFrame& frame, const State& target, const Block& block);

 private:
  using Places = std::array<std::vector<std::int32_t>, 3>;  // lattice units
  struct Past {
    std::uint8_t newest = 0;   // of places_: the last frame; the other one is the frame before
    std::uint8_t frames = 0;   // remembered since a body was renewed, 0 .. 2
    bool stood = false;        // both are the same
    std::uint64_t number = 0;  // of the target's block in the last frame
  };
  void put(const State& target, const Block& block, std::size_t places);

  std::array<Places, 2> places_;
  std::array<std::vector<std::int32_t>, kQuaternionChannels> q_;  // of the last frame
  std::span<const std::int32_t> radii_;
  std::vector<std::uint8_t> frames_;  // remembered since the body was renewed, 0 .. 2
  std::vector<Past> past_;            // by block
};

}  // namespace tandem
