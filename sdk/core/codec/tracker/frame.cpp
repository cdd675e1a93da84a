#include "sdk/core/codec/tracker/frame.hpp"

#include <utility>

namespace tandem {

void TrackerFrame::list_flags(const Block& block, TrackerFlags& flags) const {
  TrackerCounts& counts = delta.blocks[block.index].counts;
  list_flag_models(memory.flag_ages() + block.first, memory.histories() + block.first,
                   at.predicted.rest().data() + block.first, at.alive.data() + block.first,
                   std::span(flags).first(block.slots));
  // Counts alternately in the places of zeros and ones, because neighbours often have the same model, and an
  // addition would wait for the previous one.
  counts = {};
  for (std::uint32_t i = 0; i < block.slots; ++i) ++counts[flags[i]][i & 1U];
  for (auto& [zeros, ones] : std::span(counts).first(TrackerModelIndex::kRest))
    zeros += std::exchange(ones, 0);
  for (const Slot slot : within(at.renewed, block)) {
    if (at.alive[slot] == 0) continue;
    std::uint16_t& flag = flags[slot - block.first];
    --counts[flag][0];
    flag = static_cast<std::uint16_t>(flag_model(0, 0, false));
    ++counts[flag][0];
  }
}

void TrackerFrame::list_contexts(const Block& block, std::span<const Slot> slots) const {
  std::array<const std::uint8_t*, TrackerMemory::kColumns> columns{};
  for (std::size_t i = 0; i < columns.size(); ++i) columns[i] = memory.column(i);
  TrackerContexts& contexts = scratch.contexts;
  const std::int32_t threshold = at.parameters.threshold;
  // Computing one context alone takes as long as about twenty in the loop.
  if (slots.size() < block.slots / 20) {
    for (const Slot slot : slots) contexts.fill({block.index, slot, 1}, at.predicted, columns, threshold);
  } else {
    contexts.fill(block, at.predicted, columns, threshold);
  }
  for (const Slot slot : within(at.renewed, block)) contexts.renew(slot);
}

TrackerTurnContext TrackerFrame::turn_context_of(Slot slot) const {
  if (is_renewed(slot)) return turn_context({}, {}, {});
  const State& predicted = at.predicted;
  return turn_context(memory.body(slot), memory.turn(slot),
                      {predicted.w(0)[slot], predicted.w(1)[slot], predicted.w(2)[slot]});
}

void TrackerFrame::count_zeros(const Block& block) const {
  TrackerScratch::Zeros& zeros = scratch.zeros[block.index];
  const std::uint64_t predicted = number_of(at.known.predicted, block.index);
  const std::uint64_t remembered = memory.numbers()[block.index];
  const bool known = predicted != 0 && within(at.renewed, block).empty();
  if (known && zeros.predicted == predicted && zeros.memory == remembered) return;
  zeros.predicted = known ? predicted : 0;
  zeros.memory = remembered;
  TrackerFlags all;  // NOLINT(cppcoreguidelines-pro-type-member-init): written before it is read
  const std::span<std::uint16_t> flags = std::span(all).first(block.slots);
  list_flag_models(memory.flag_ages() + block.first, memory.histories() + block.first,
                   at.predicted.rest().data() + block.first, at.alive.data() + block.first, flags);
  for (const Slot slot : within(at.renewed, block)) {
    std::uint16_t& flag = flags[slot - block.first];
    if (at.alive[slot] != 0) flag = static_cast<std::uint16_t>(flag_model(0, 0, false));
  }
  zeros.of.fill(0);
  // Neighbours at rest mostly have one age, so most runs have one model. Counts beyond those of flags are of
  // no body.
  constexpr std::size_t kRun = 64;
  const auto add = [&zeros](std::uint16_t model, std::uint32_t count) {
    if (model < zeros.of.size()) zeros.of[model] += count;
  };
  for (std::size_t first = 0; first < flags.size(); first += kRun) {
    const std::span<const std::uint16_t> run = flags.subspan(first, std::min(kRun, flags.size() - first));
    unsigned differs = 0;
    for (const std::uint16_t flag : run) differs |= unsigned{flag} ^ run.front();
    if (differs == 0) {
      add(run.front(), static_cast<std::uint32_t>(run.size()));
    } else {
      for (const std::uint16_t flag : run) add(flag, 1);
    }
  }
}

std::span<const Slot> TrackerFrame::join() const {
  const bool is_empty = std::all_of(delta.blocks.begin(), delta.blocks.end(),
                                    [](const TrackerDelta::Part& part) { return part.corrected == 0; });
  if (!is_empty) return delta.join(memory.capacity());
  // A delta without corrections teaches that corrections are rare. Otherwise a budget that no body fits,
  // because flags seem likely, would never be met.
  for_each_block([this](const Block& block) { count_zeros(block); });
  TrackerCounts& sum = delta.blocks.front().counts;
  sum = {};
  for (const TrackerScratch::Zeros& zeros : scratch.zeros) {
    for (std::size_t model = 0; model < zeros.of.size(); ++model) sum[model][0] += zeros.of[model];
  }
  delta.seen = &sum;
  return std::span<const Slot>(delta.slots).first(0);
}

}  // namespace tandem
