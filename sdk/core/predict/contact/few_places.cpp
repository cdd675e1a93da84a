// The order of bodies where few of them move, in few places: what is far from those is hardly looked at.
#include <algorithm>
#include <bit>

#include "sdk/core/predict/contact/order.hpp"

namespace tandem {

// Chooses the bodies that somebody in motion can touch. Returns false if they are so many that it is not
// worth it. Their cells are the protocol's: in another grid it would have to be counted which bodies of a
// cell take part, of all bodies, but in this one a flat world has more bodies in a cell.
bool ContactOrder::choose_few(const Input& input) {
  constexpr std::uint32_t kFew = 24;  // one in so many
  constexpr std::uint32_t kCrowdedSteps = 16;
  const std::uint32_t blocks = block_count(input.state.capacity());
  if (input.still.empty() || blocks == 1) return false;
  if (crowded_ > 0) {
    --crowded_;
    return false;
  }
  bits_ = choice_.protocol();
  surroundings_.begin(bits_, true);
  run_jobs(blocks, input.run, [&](std::uint32_t block) {
    if (input.still[block] == 0) number(input, block);
  });
  for (std::uint32_t block = 0; block < blocks; ++block) {
    if (input.still[block] != 0) continue;
    for (Slot s = block * kBlockSlots, end = end_of(input.state, block); s < end; ++s) {
      if (input.at_rest[s] != 0 || place_[s] >= kOther) continue;
      surroundings_.add(place_[s]);
      surroundings_.add_cells(place_[s]);
    }
  }
  run_jobs(blocks, input.run, [&](std::uint32_t block) {
    std::uint32_t* const counts = &starts_[block * in_pairs_.size()];
    std::fill_n(counts, in_pairs_.size(), 0U);
    if (takes_part(input, block)) {
      choose_next_to_moving(input, block);
      for_each_chosen(block, [&, bits = bucket_bits_](Slot s) { ++counts[place_[s] >> bits]; });
    } else {
      const std::size_t words = (end_of(input.state, block) - block * kBlockSlots + 63) / 64;
      std::fill_n(&chosen_[std::size_t{block} * BlockLedger::kRuns], words, 0U);
    }
  });
  std::uint64_t count = 0;
  for (const std::uint64_t word : chosen_) count += static_cast<std::uint64_t>(std::popcount(word));
  few_places_ = kFew * count <= input.state.capacity();
  if (!few_places_) crowded_ = kCrowdedSteps;
  return few_places_;
}

// Call when it is known where bodies move. Afterwards the cells of a block that takes part are known.
bool ContactOrder::takes_part(const Input& input, std::uint32_t block) {
  if (input.still[block] == 0) return true;
  const std::uint64_t number_now = number_of(input.numbers, block);
  const bool known = surroundings_.knows(block, number_now);
  if (known && !surroundings_.meets(block)) return false;
  number(input, block);
  if (known) return true;
  const Slot first = block * kBlockSlots;
  surroundings_.learn(block, number_now,
                      std::span(place_).subspan(first, end_of(input.state, block) - first));
  return surroundings_.meets(block);
}

// Chooses the bodies of a block that somebody in motion can touch.
void ContactOrder::choose_next_to_moving(const Input& input, std::uint32_t block) {
  static_assert(BlockLedger::kRunSlots == 64);
  const Slot end = end_of(input.state, block);
  const std::uint32_t last = (1U << bits_.all) - 1;
  for (Slot first = block * kBlockSlots; first < end; first += 64) {
    const std::uint32_t count = std::min(end - first, 64U);
    std::uint32_t* const cells = &place_[first];
    std::uint64_t chosen = 0;
    unsigned all_rest = 1;
    for (std::uint32_t k = 0; k < count; ++k) {
      const bool takes_part = (cells[k] <= last) & surroundings_.is_next_to(cells[k] & last);
      chosen |= std::uint64_t{takes_part} << k;
      all_rest &= input.at_rest[first + k];
    }
    chosen_[first / 64] = chosen;
    for (std::uint32_t k = 0; all_rest == 0 && k < count; ++k) {
      if ((chosen >> k & 1U) == 0) cells[k] = 0;
    }
  }
}

}  // namespace tandem
