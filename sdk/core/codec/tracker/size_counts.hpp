#pragma once
// Counts the sizes of steps while a block is coded: one count a size instead of one a decision.

#include <array>
#include <cstdint>

#include "sdk/core/codec/tracker/models.hpp"

namespace tandem {

/// Sizes of positions by the row of their models and by how far their classes went. At the end they become
/// the decisions that were coded.
class SizeCounts {
 public:
  static constexpr std::uint32_t kRows =
      TrackerModelIndex::kLasts * TrackerModelIndex::kRecents * TrackerModelIndex::kLargest;
  static constexpr std::uint32_t kNone = kRows;  ///< the row of axes that do not move

  void add(std::uint32_t row, std::uint32_t size_class) { ++ended_[row][size_class]; }
  void add_to(TrackerCounts& counts) const {
    using Index = TrackerModelIndex;
    for (std::uint32_t row = 0; row < kRows; ++row) {
      std::uint32_t longer = ended_[row][Index::kClasses];
      for (std::uint32_t size_class = Index::kClasses; size_class-- > 0;) {
        auto& [zeros, ones] = counts[Index::kSteps + Index::kMagnitude + row * Index::kClasses + size_class];
        zeros += ended_[row][size_class];
        ones += longer;
        longer += ended_[row][size_class];
      }
    }
  }

 private:
  std::array<std::array<std::uint32_t, TrackerModelIndex::kClasses + 1>, kRows + 1> ended_{};
};

}  // namespace tandem
