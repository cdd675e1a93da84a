#include "sdk/core/codec/selection.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <string>

#include "sdk/core/lattice/assert.hpp"

namespace tandem {
namespace {

std::size_t mask_bytes(std::uint32_t slots) { return (slots + 7U) / 8U; }

tl::unexpected<Error> dead_slot(Slot slot) {
  return fail(ErrorCode::kMalformed, "correction of slot " + std::to_string(slot) + ", which is not alive");
}

}  // namespace

Block block_at(std::uint32_t index, std::uint32_t capacity) {
  TANDEM_ASSERT(index < block_count(capacity));
  const Slot first = index * kBlockSlots;
  return {index, first, std::min(kBlockSlots, capacity - first)};
}

std::span<const Slot> within(std::span<const Slot> slots, const Block& block) {
  const auto first = std::lower_bound(slots.begin(), slots.end(), block.first);
  return {first, std::lower_bound(first, slots.end(), block.first + block.slots)};
}

SelectionForm smallest_form(std::uint32_t slots, std::uint32_t chosen, std::uint32_t alive) {
  if (chosen == alive) return SelectionForm::kAll;
  return 2 + 2 * std::size_t{chosen} <= mask_bytes(slots) ? SelectionForm::kList : SelectionForm::kMask;
}

std::size_t selection_bytes(SelectionForm form, std::uint32_t slots, std::uint32_t chosen) {
  if (form == SelectionForm::kList) return 2 + 2 * std::size_t{chosen};
  return form == SelectionForm::kMask ? mask_bytes(slots) : 0;
}

void write_selection(SelectionForm form, const Block& block, std::span<const Slot> chosen, ByteWriter& out) {
  TANDEM_ASSERT(!chosen.empty() && chosen.size() <= block.slots);
  TANDEM_ASSERT(out.rest().size() >=
                selection_bytes(form, block.slots, static_cast<std::uint32_t>(chosen.size())));
  if (form == SelectionForm::kList) {
    out.put(static_cast<std::uint16_t>(chosen.size()));
    for (const Slot slot : chosen) out.put(static_cast<std::uint16_t>(slot - block.first));
  } else if (form == SelectionForm::kMask) {
    const std::span<std::byte> mask = out.rest().first(mask_bytes(block.slots));
    std::fill(mask.begin(), mask.end(), std::byte{0});
    for (const Slot slot : chosen) {
      const std::uint32_t local = slot - block.first;
      mask[local / 8] |= static_cast<std::byte>(1U << (local % 8U));
    }
    out.advance(mask.size());
  }
}

namespace {

Result<std::uint32_t> parse_list(const Block& block, std::span<const std::uint8_t> alive, ByteReader& in,
                                 std::span<Slot> chosen) {
  const std::uint32_t count = in.get<std::uint16_t>();
  if (count == 0 || count > block.slots)
    return fail(ErrorCode::kMalformed, "index list of impossible length");
  if (in.remaining() < 2 * std::size_t{count}) return fail(ErrorCode::kMalformed, "truncated index list");
  std::uint32_t least = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t local = in.get<std::uint16_t>();
    if (local < least) return fail(ErrorCode::kMalformed, "index list does not ascend");
    if (local >= block.slots) return fail(ErrorCode::kMalformed, "index beyond the block");
    const Slot slot = block.first + local;
    if (alive[slot] == 0) return dead_slot(slot);
    chosen[i] = slot;
    least = local + 1;
  }
  return count;
}

Result<std::uint32_t> parse_mask(const Block& block, std::span<const std::uint8_t> alive, ByteReader& in,
                                 std::span<Slot> chosen) {
  const std::span<const std::byte> mask = in.get_bytes(mask_bytes(block.slots));
  if (mask.empty()) return fail(ErrorCode::kMalformed, "truncated bit mask");
  std::uint32_t count = 0;
  for (std::size_t at = 0; at < mask.size(); at += 8) {
    // Works on 64 slots at a time: the number of rounds of the inner loop is hard to predict for a processor,
    // so there should be few such loops.
    std::uint64_t bits = 0;
    std::memcpy(&bits, mask.data() + at, std::min<std::size_t>(8, mask.size() - at));
    for (; bits != 0; bits &= bits - 1) {
      const std::uint32_t local =
          static_cast<std::uint32_t>(8 * at) + static_cast<std::uint32_t>(std::countr_zero(bits));
      if (local >= block.slots) return fail(ErrorCode::kMalformed, "bit mask names slots beyond the block");
      const Slot slot = block.first + local;
      if (alive[slot] == 0) return dead_slot(slot);
      chosen[count++] = slot;
    }
  }
  return count;
}

}  // namespace

Result<std::uint32_t> parse_selection(SelectionForm form, const Block& block,
                                      std::span<const std::uint8_t> alive, ByteReader& in,
                                      std::span<Slot> chosen) {
  TANDEM_ASSERT(chosen.size() >= block.slots && alive.size() >= block.first + block.slots);
  Result<std::uint32_t> count = 0U;
  switch (form) {
    case SelectionForm::kList:
      count = parse_list(block, alive, in, chosen);
      break;
    case SelectionForm::kMask:
      count = parse_mask(block, alive, in, chosen);
      break;
    case SelectionForm::kAll:
      for (Slot slot = block.first; slot < block.first + block.slots; ++slot) {
        if (alive[slot] != 0) chosen[(*count)++] = slot;
      }
      break;
    default:
      return fail(ErrorCode::kMalformed, "unknown form of selection");
  }
  if (count && *count == 0) return fail(ErrorCode::kMalformed, "corrections section without a body");
  return count;
}

}  // namespace tandem
