#pragma once
// Which slots of a block a corrections section is about: index list, bit mask, or all alive ones.

#include <cstddef>
#include <cstdint>
#include <span>

#include "sdk/core/lattice/bytes.hpp"
#include "sdk/core/lattice/state.hpp"
#include "tandem/result.hpp"

namespace tandem {

enum class SelectionForm : std::uint8_t {
  kList = 0,  ///< u16 count, count x u16 local indices, ascending
  kMask = 1,  ///< one bit a slot of the block, least significant first
  kAll = 2,   ///< nothing: every alive slot of the block
};

/// A run of slots that is coded on its own.
struct Block {
  std::uint32_t index = 0;
  Slot first = 0;
  std::uint32_t slots = 0;
};
[[nodiscard]] Block block_at(std::uint32_t index, std::uint32_t capacity);
/// Those of ascending slots that are in the block.
[[nodiscard]] std::span<const Slot> within(std::span<const Slot> slots, const Block& block);

/// Form with the fewest bytes; `chosen` of the block's `alive` slots are selected.
[[nodiscard]] SelectionForm smallest_form(std::uint32_t slots, std::uint32_t chosen, std::uint32_t alive);
[[nodiscard]] std::size_t selection_bytes(SelectionForm form, std::uint32_t slots, std::uint32_t chosen);
/// `chosen` are slots of the block, ascending.
void write_selection(SelectionForm form, const Block& block, std::span<const Slot> chosen, ByteWriter& out);

/// Reads a selection into `chosen`, which holds at least block.slots; returns how many. All are alive, at
/// least one, ascending. Errors: kMalformed.
[[nodiscard]] Result<std::uint32_t> parse_selection(SelectionForm form, const Block& block,
                                                    std::span<const std::uint8_t> alive, ByteReader& in,
                                                    std::span<Slot> chosen);

}  // namespace tandem
