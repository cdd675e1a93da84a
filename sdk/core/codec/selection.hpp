#pragma once
// Selects the slots of a block that a corrections section corrects: as an index list, a bit mask, or all
// alive slots.

#include <cstddef>
#include <cstdint>
#include <span>

#include "sdk/core/lattice/bytes.hpp"
#include "sdk/core/lattice/state.hpp"
#include "tandem/result.hpp"

namespace tandem {

enum class SelectionForm : std::uint8_t {
  kList = 0,  ///< u16 count, count x u16 local indices, ascending
  kMask = 1,  ///< one bit for each slot of the block, least significant first
  kAll = 2,   ///< no bytes: every alive slot of the block
};

/// A run of slots that is coded on its own.
struct Block {
  std::uint32_t index = 0;
  Slot first = 0;
  std::uint32_t slots = 0;
};
[[nodiscard]] Block block_at(std::uint32_t index, std::uint32_t capacity);
/// The part of the ascending `slots` that is in the block.
[[nodiscard]] std::span<const Slot> within(std::span<const Slot> slots, const Block& block);

/// The form with the fewest bytes if `chosen` of the block's `alive` slots are selected.
[[nodiscard]] SelectionForm smallest_form(std::uint32_t slots, std::uint32_t chosen, std::uint32_t alive);
[[nodiscard]] std::size_t selection_bytes(SelectionForm form, std::uint32_t slots, std::uint32_t chosen);
/// `chosen` are slots of the block, ascending.
void write_selection(SelectionForm form, const Block& block, std::span<const Slot> chosen, ByteWriter& out);

/// Reads a selection into `chosen`, which holds at least block.slots. Returns the number of slots. They are
/// alive, ascending and at least one. Errors: kMalformed.
[[nodiscard]] Result<std::uint32_t> parse_selection(SelectionForm form, const Block& block,
                                                    std::span<const std::uint8_t> alive, ByteReader& in,
                                                    std::span<Slot> chosen);

}  // namespace tandem
