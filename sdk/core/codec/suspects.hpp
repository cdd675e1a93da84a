#pragma once
// An encoder that remembers the bodies of a silent block that are near the threshold, so that the
// block need not be read again. Nothing here is on the wire.

#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/codec/codec.hpp"
#include "sdk/core/codec/selection.hpp"

namespace tandem {

class Suspects {
 public:
  explicit Suspects(std::uint32_t capacity) : blocks_(block_count(capacity)) {}

  /// Calls found(slot, error squared) for the bodies of a block whose error is above `early`: those that
  /// scan(found) finds, or the same ones from memory if neither state's block has changed since. Blocks may
  /// be searched side by side.
  template <class Scan, class Found>
  void find(const CodecFrame& frame, const Block& block, std::int32_t early, const Scan& scan,
            const Found& found) {
    Seen& seen = blocks_[block.index];
    const std::uint64_t predicted = number_of(frame.known.predicted, block.index);
    const std::uint64_t target = number_of(frame.known.target, block.index);
    const bool known = predicted != 0 && target != 0 && within(frame.renewed, block).empty();
    const bool target_stands = known && seen.target == target;
    if (target_stands && seen.is_complete && seen.predicted == predicted && seen.early == early) {
      for (const Body& body : std::span(seen.bodies).first(seen.count)) found(body.slot, body.error);
      return;
    }
    seen.predicted = predicted;
    seen.target = known ? target : 0;
    seen.early = early;
    seen.is_complete = false;
    if (!target_stands) {  // a block in which bodies move will have changed in the next frame too
      scan(found);
      return;
    }
    std::uint32_t count = 0;
    scan([&](Slot slot, std::uint64_t error) {
      if (count < kMaxBodies) seen.bodies[count] = {error, slot};
      ++count;
      found(slot, error);
    });
    seen.is_complete = count <= kMaxBodies;
    seen.count = count;
  }

 private:
  /// Maximum number for a block. A block with more suspects is read in every frame.
  static constexpr std::uint32_t kMaxBodies = 512;
  struct Body {
    std::uint64_t error = 0;
    Slot slot = 0;
  };
  struct Seen {
    std::uint64_t predicted = 0, target = 0;
    std::int32_t early = 0;
    bool is_complete = false;
    std::uint32_t count = 0;
    std::vector<Body> bodies = std::vector<Body>(kMaxBodies);
  };
  std::vector<Seen> blocks_;
};

}  // namespace tandem
