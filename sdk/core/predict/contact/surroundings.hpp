#pragma once
// Where bodies move, and which blocks of slots have bodies there.

#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/predict/contact/pairs.hpp"

namespace tandem {

/// The surroundings of the bodies that move, in regions of 4 x 4 x 4 cells. A body that touches another one
/// is in one of the 27 cells around its cell.
class ContactSurroundings {
 public:
  /// The grid has 2^all_bits cells, with at least four along each axis.
  ContactSurroundings(std::uint32_t all_bits, std::uint32_t blocks);

  /// Forgets where bodies move. `bits`: how cells are numbered from now on. `by_cell`: add_cells() is called,
  /// too.
  void begin(const ContactCellBits& bits, bool by_cell);
  /// A body moves in this cell.
  void add(std::uint32_t cell);
  /// The same for is_next_to().
  void add_cells(std::uint32_t cell);
  /// The same as is_near() for fewer bodies: those in the 27 cells around one that moves.
  [[nodiscard]] bool is_next_to(std::uint32_t cell) const {
    return ((next_to_[cell / 64] >> (cell % 64)) & 1U) != 0;
  }
  /// True if a body in this cell may touch one that moves.
  [[nodiscard]] bool is_near(std::uint32_t cell) const {
    const std::uint32_t region = region_of(cell);
    return ((near_[region / 64] >> (region % 64)) & 1U) != 0;
  }

  /// True if the regions of a block's bodies are known. `number`: as in BlockLedger.
  [[nodiscard]] bool knows(std::uint32_t block, std::uint64_t number) const;
  /// Learns them. `cells`: by slot of the block; those beyond the grid are of no body. Threads may learn
  /// other blocks at the same time.
  void learn(std::uint32_t block, std::uint64_t number, std::span<const std::uint32_t> cells);
  /// True if a body of a block that is known may touch one that moves.
  [[nodiscard]] bool meets(std::uint32_t block) const;

 private:
  [[nodiscard]] std::uint32_t region_of(std::uint32_t cell) const;

  ContactCellBits bits_;
  std::vector<std::uint64_t> near_;     // by region, 64 in a word
  std::vector<std::uint64_t> next_to_;  // by cell, likewise; empty for one block
  std::vector<std::uint64_t> covered_;  // by block, regions as in near_
  std::vector<std::uint64_t> numbers_;  // by block; 0: unknown
};

}  // namespace tandem
