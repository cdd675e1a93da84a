#pragma once
// The tracker's decoder: reads sections of untrusted bytes into a TrackerDelta.

#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/codec/tracker/frame.hpp"

namespace tandem {

class TrackerDecoder {
 public:
  explicit TrackerDecoder(std::uint32_t capacity) : parts_(block_count(capacity)) {}

  /// Fills in frame.delta and returns the corrected slots, ascending. Changes nothing else. Errors:
  /// kMalformed with the reason.
  Result<std::span<const Slot>> decode(const TrackerFrame& frame, std::span<const Section> sections);

 private:
  struct Part {
    std::span<const std::byte> stream;  // of the block's section; empty: it has none
    const char* broken = nullptr;       // why the stream is invalid
  };
  std::vector<Part> parts_;  // by block
};

}  // namespace tandem
