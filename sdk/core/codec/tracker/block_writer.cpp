#include "sdk/core/codec/tracker/block_writer.hpp"

#include <algorithm>
#include <array>
#include <optional>

#include "sdk/core/codec/tracker/decision_list.hpp"
#include "sdk/core/lattice/assert.hpp"

namespace tandem {
namespace {

// A block that is being written.
class WritingLane {
 public:
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): flags_ are written before they are read
  WritingLane(const TrackerFrame& frame, const Block& block, std::span<std::byte> room)
      : frame_(frame),
        delta_(frame.delta.blocks[block.index]),
        first_(block.first),
        coder_(room),
        counts_{delta_.counts, {}} {
    frame.list_flags(block, flags_);
    // A model becomes a decision: 2 * model + bit.
    const std::span<std::uint16_t> flags = std::span(flags_).first(block.slots);
    for (std::uint16_t& flag : flags) flag = static_cast<std::uint16_t>(2 * flag);
    for (const Slot slot : std::span(frame.delta.slots).subspan(block.first, delta_.corrected)) {
      std::uint16_t& flag = flags[slot - block.first];
      delta_.count_one(flag / 2U);
      ++flag;
    }
    left_ = flags;
  }

  /// The decisions that come next; empty at the end.
  std::span<const std::uint16_t> next() {
    if (left_.empty()) list_more();
    return left_;
  }
  void skip(std::size_t count) { left_ = left_.subspan(count); }
  RangeEncoder& coder() { return coder_; }
  std::size_t finish() {
    counts_.sizes.add_to(delta_.counts);
    return coder_.finish();
  }

 private:
  void list_more() {
    list_.clear();
    for (; corrected_ < delta_.corrected && !list_.is_full(); ++corrected_) {
      const std::uint32_t at = first_ + corrected_;
      const Slot slot = frame_.delta.slots[at];
      if (frame_.memory.turns()) {
        TrackerTurningCorrection correction = frame_.delta.turning(at);
        frame_.code(list_, slot, correction);
      } else {
        list_.add(frame_.scratch.contexts.of(slot), frame_.delta.corrections[at], counts_);
      }
    }
    left_ = list_.decisions();
    if (!frame_.memory.turns()) return;
    for (const std::uint32_t decision : left_) ++delta_.counts[decision / 2][decision % 2];
  }

  const TrackerFrame& frame_;
  TrackerDelta::Part& delta_;
  Slot first_;
  RangeEncoder coder_;
  ListedCounts counts_;
  std::uint32_t corrected_ = 0;          // of them in list_, or coded
  std::span<const std::uint16_t> left_;  // of flags_ or of list_
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): written before it is read
  TrackerFlags flags_;
  DecisionList list_;
};

}  // namespace

void write_streams(const TrackerFrame& frame, std::span<const Block> blocks, BlockStream* streams) {
  TANDEM_ASSERT(blocks.size() <= kLanes);
  const std::uint16_t* const p1 = frame.memory.models().p1.data();
  std::array<std::optional<WritingLane>, kLanes> lanes;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    streams[i].size_bytes = 0;
    streams[i].fits = true;
    if (frame.delta.blocks[blocks[i].index].corrected != 0)
      lanes[i].emplace(frame, blocks[i], streams[i].bytes);
  }
  if constexpr (kLanes == 2) {
    while (lanes[0] && lanes[1]) {
      const std::size_t count = std::min(lanes[0]->next().size(), lanes[1]->next().size());
      if (count == 0) break;
      RangeEncoder::put_all_of_two(lanes[0]->coder(), lanes[0]->next().data(), lanes[1]->coder(),
                                   lanes[1]->next().data(), count, p1);
      for (auto& lane : lanes) lane->skip(count);
    }
  }
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (!lanes[i]) continue;
    for (auto some = lanes[i]->next(); !some.empty(); some = lanes[i]->next()) {
      lanes[i]->coder().put_all(some, p1);
      lanes[i]->skip(some.size());
    }
    BlockStream& stream = streams[i];
    stream.size_bytes = lanes[i]->finish();
    stream.fits = !lanes[i]->coder().overflow();
    if (stream.fits || stream.bytes.size() >= stream.most_bytes) continue;
    stream.bytes.resize(std::min(2 * stream.bytes.size(), stream.most_bytes));
    write_streams(frame, blocks.subspan(i, 1), &stream);
  }
}

}  // namespace tandem
