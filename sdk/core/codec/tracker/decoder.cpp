#include "sdk/core/codec/tracker/decoder.hpp"

#include "sdk/core/layout/sections.hpp"

namespace tandem {
namespace {

// Returns null, or why the stream is invalid.
const char* decode_block(const TrackerFrame& frame, const Block& block, std::span<const std::byte> stream) {
  TrackerDelta::Part& part = frame.delta.blocks[block.index];
  const TrackerModels& models = frame.memory.models();
  frame.list_flags(block);
  Slot* const corrected = frame.delta.slots.data() + block.first;
  const std::uint16_t* const flags = frame.scratch.flags.data();
  const std::uint16_t* const p1 = models.p1.data();
  std::uint32_t count = 0;
  RangeDecoder range(stream);
  const Slot end = block.first + block.slots;
  // Branches on bits pay if few bodies are corrected: here, if they have less than 0.8 bits each.
  if (stream.size() * 10 < block.slots) {
    for (Slot slot = block.first; slot < end; ++slot) {
      if (range.get(p1[flags[slot]])) corrected[count++] = slot;
    }
  } else {
    for (Slot slot = block.first; slot < end; ++slot) {
      corrected[count] = slot;
      count += static_cast<std::uint32_t>(range.get_masked(p1[flags[slot]]));
    }
  }
  for (std::uint32_t i = 0; i < count; ++i) part.count_one(flags[corrected[i]]);
  if (count == 0) return "corrections section without a body";
  frame.list_contexts(block, std::span(corrected, count));
  DecisionDecoder coder{range, &models, &part.counts};
  TrackerCorrection* const corrections = frame.delta.corrections.data() + block.first;
  for (std::uint32_t i = 0; i < count; ++i) {
    if (!frame.code(coder, corrected[i], corrections[i])) return "correction beyond any lattice";
  }
  if (!coder.range.at_end()) return "bytes after the code stream";
  part.corrected = count;
  return nullptr;
}

}  // namespace

Result<std::span<const Slot>> TrackerDecoder::decode(const TrackerFrame& frame,
                                                     std::span<const Section> sections) {
  for (Part& part : parts_) part = {};
  for (const Section& section : sections) {
    if (section.body.empty()) return fail(ErrorCode::kMalformed, "corrections section without a body");
    parts_[section.block].stream = section.body;
  }
  frame.for_each_block([&](const Block& block) {
    Part& part = parts_[block.index];
    frame.delta.blocks[block.index].corrected = 0;
    if (!part.stream.empty()) part.broken = decode_block(frame, block, part.stream);
  });
  for (const Part& part : parts_) {
    if (part.broken != nullptr) return fail(ErrorCode::kMalformed, part.broken);
  }
  return frame.join();
}

}  // namespace tandem
