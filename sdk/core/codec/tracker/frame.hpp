#pragma once
// A frame of the tracker while its delta is coded: the common part of encoder and decoder. Both read the
// memory, list the model of every decision, and fill in a TrackerDelta.

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/codec/codec.hpp"
#include "sdk/core/codec/selection.hpp"
#include "sdk/core/codec/tracker/memory.hpp"
#include "sdk/core/codec/tracker/models.hpp"

namespace tandem {

/// Blocks that a thread codes side by side. In the browser one, without a code of its own, because the module
/// must stay small, and few sessions have several blocks.
#if defined(__wasm__)
inline constexpr std::uint32_t kLanes = 1;
#else
inline constexpr std::uint32_t kLanes = 2;
#endif

/// The models of the flags "is this body corrected" of a block, from its first slot on.
using TrackerFlags = std::array<std::uint16_t, kBlockSlots>;

/// Scratch memory: the models of the current decisions, slot by slot.
struct TrackerScratch {
  /// The flags of a block in a delta without corrections, by model.
  struct Zeros {
    std::uint64_t predicted = 0, memory = 0;  // numbers of what they were counted from
    std::array<std::uint32_t, TrackerModelIndex::kRest> of{};
  };

  explicit TrackerScratch(std::uint32_t capacity) : contexts(capacity), zeros(block_count(capacity)) {}
  TrackerContexts contexts;
  std::vector<Zeros> zeros;  ///< by block
};

/// The data of one frame. Blocks are coded in parallel; each touches only its own part of scratch memory and
/// delta.
struct TrackerFrame {
  const TrackerMemory& memory;  ///< as the previous delta left it
  const CodecFrame& at;
  TrackerScratch& scratch;
  TrackerDelta& delta;  ///< to be filled
  const RunBlocks& run_blocks;

  [[nodiscard]] bool is_renewed(Slot slot) const {
    return !at.renewed.empty() && std::binary_search(at.renewed.begin(), at.renewed.end(), slot);
  }
  /// The model of one slot's flag, without scratch memory.
  [[nodiscard]] std::uint32_t flag_of(Slot slot) const {
    return is_renewed(slot) ? flag_model(0, 0, false) : memory.flag_of(slot, at.predicted.rest()[slot] != 0);
  }
  /// Fills the flags of a block, and counts them all as zeros in its part of the delta. Dead slots get a
  /// model that is never a one and takes no bits, so that loops need no test.
  void list_flags(const Block& block, TrackerFlags& flags) const;
  /// The context of a slot, in a stream with orientations.
  [[nodiscard]] TrackerTurnContext turn_context_of(Slot slot) const;
  /// Codes a correction, as code_correction(); `turn` of it is used in a stream with orientations alone.
  template <class Coder>
  bool code(Coder& coder, Slot slot, TrackerTurningCorrection& correction) const {
    const TrackerContext context = scratch.contexts.of(slot);
    return memory.turns() ? code_correction(coder, context, turn_context_of(slot), correction)
                          : code_correction(coder, context, correction);
  }
  /// Fills the contexts of a block, at least those of `slots`.
  void list_contexts(const Block& block, std::span<const Slot> slots) const;
  /// Counts the flags of a block into scratch.zeros, unless they are those counted before.
  void count_zeros(const Block& block) const;
  /// Call when all blocks are coded: completes the delta. Returns the corrected slots, ascending.
  std::span<const Slot> join() const;

  /// How many of these blocks a thread codes side by side: several only if all threads then have work.
  [[nodiscard]] std::uint32_t lanes_for(std::uint32_t blocks) const {
    constexpr std::uint32_t kFewestShared = 8;
    return !run_blocks || blocks >= kFewestShared ? kLanes : 1;
  }

  /// Calls job(block) for all blocks, perhaps on several threads.
  template <class Job>
  void for_each_block(const Job& job) const {
    for_each_tracker_block(memory.capacity(), run_blocks, job);
  }
};

}  // namespace tandem
