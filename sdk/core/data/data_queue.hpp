#pragma once
// A server's choice of the data that a frame tells.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/data/body_data.hpp"

namespace tandem {

/// Tells all that changed. What a budget does not permit waits: the oldest change is told first, with the
/// newest record of its body; ties by slot. Not thread-safe.
class DataQueue {
 public:
  explicit DataQueue(std::uint32_t capacity) : capacity_(capacity) {}

  /// Returns the body of the next frame's section, empty if there is none, and leaves its changes in `data`,
  /// to be applied. `target`: records by slot. `most_bytes`: of the body.
  std::span<const std::byte> next(BodyData& data, std::span<const std::byte> target,
                                  const BodyData::Lives& lives, std::size_t most_bytes);
  /// Bodies whose newest data were not told by the last call.
  [[nodiscard]] std::size_t waiting() const { return waiting_; }

 private:
  std::span<const std::byte> oldest(BodyData& data, std::span<const std::byte> target,
                                    const BodyData::Lives& lives, std::size_t most_bytes, std::size_t of_all);

  std::uint32_t capacity_;
  std::uint64_t frame_ = 0;
  std::size_t waiting_ = 0;
  std::vector<Slot> changed_, chosen_;
  std::vector<std::uint64_t>
      since_;  ///< by slot: the frame from which on it waits, or 0; empty: none ever did
};

}  // namespace tandem
