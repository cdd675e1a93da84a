#pragma once
// Writes the code streams of the tracker's blocks, two side by side: on one thread their chains of decisions
// overlap.

#include <cstddef>
#include <span>
#include <vector>

#include "sdk/core/codec/tracker/frame.hpp"

namespace tandem {

/// A block's code stream, and memory for it.
struct BlockStream {
  [[nodiscard]] std::span<const std::byte> written() const { return std::span(bytes).first(size_bytes); }

  std::vector<std::byte> bytes;  ///< grows up to `most_bytes`, which few blocks ever need
  std::size_t most_bytes = 0;
  std::size_t size_bytes = 0;
  bool fits = true;
};

/// Writes one block or two: their corrections in frame.delta, `corrected` of them. Counts the decisions in
/// the block's part of the delta. A block without corrections gets no bytes. Allocates only for a stream that
/// is longer than all before.
void write_streams(const TrackerFrame& frame, std::span<const Block> blocks, BlockStream* streams);

}  // namespace tandem
