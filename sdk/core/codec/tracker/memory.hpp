#pragma once
// What the tracker remembers from frame to frame, the same on both sides, bit by bit. It is read before a
// delta is applied, and only TrackerMemory::apply() changes it.

#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/codec/codec.hpp"
#include "sdk/core/codec/selection.hpp"
#include "sdk/core/codec/tracker/models.hpp"

namespace tandem {

/// The content of a delta, and the decisions counted in coding it. Its memory is allocated once and used for
/// every frame.
struct TrackerDelta {
  /// `turning`: in a stream with orientations.
  TrackerDelta(std::uint32_t capacity, bool turning)
      : slots(capacity),
        corrections(capacity),
        turns(turning ? capacity : 0),
        blocks(block_count(capacity)) {}

  /// The part of one block; blocks are coded in parallel. Its corrections begin at the index of the block's
  /// first slot. So do its corrected slots, ascending, until join(); afterwards they begin at `first`.
  struct Part {
    std::uint32_t corrected = 0;
    std::uint32_t first = 0;
    TrackerCounts counts{};
    /// Corrects the counts: a decision that was counted as a zero is a one.
    void count_one(std::uint32_t model) {
      --counts[model][0];
      ++counts[model][1];
    }
  };
  /// The correction at an index, in a stream with orientations.
  [[nodiscard]] TrackerTurningCorrection turning(std::size_t i) const { return {corrections[i], turns[i]}; }
  void set(std::size_t i, const TrackerTurningCorrection& correction) {
    corrections[i] = static_cast<const TrackerCorrection&>(correction);
    turns[i] = correction.turn;
  }
  /// Makes one list of the slots of all blocks. Sums the decisions of the blocks with corrections. Returns
  /// the corrected slots.
  std::span<const Slot> join(std::uint32_t capacity);

  std::vector<Slot> slots;
  std::vector<TrackerCorrection> corrections;
  std::vector<TrackerSteps> turns;  ///< their `turn`; empty in a stream without orientations
  std::vector<Part> blocks;
  const TrackerCounts* seen = nullptr;  ///< all decisions of the delta; set by join() to the counts of one of
                                        ///< the blocks
};

/// Calls job(block) for all blocks of `capacity` slots, perhaps on several threads.
template <class Job>
void for_each_tracker_block(std::uint32_t capacity, const RunBlocks& run_blocks, const Job& job) {
  const std::uint32_t blocks = block_count(capacity);
  const auto run = [&](std::uint32_t b) { job(block_at(b, capacity)); };
  if (run_blocks && blocks > 1) {
    run_blocks(blocks, run);
  } else {
    for (std::uint32_t b = 0; b < blocks; ++b) run(b);
  }
}

class TrackerMemory {
 public:
  static constexpr std::size_t kColumns = 5;  ///< columns of a group: age, interval, steps x, y, z

  explicit TrackerMemory(const CodecSetup& setup);

  [[nodiscard]] std::uint32_t capacity() const { return capacity_; }
  /// All columns, one after another; part of the state hash.
  [[nodiscard]] std::span<const std::byte> columns() const { return columns_; }
  /// The numbers of their contents.
  [[nodiscard]] BlockNumbers numbers() const { return numbers_; }
  /// Neighbours often came to rest together, so that they have one age and interval.
  [[nodiscard]] static Guess guess(std::size_t column) {
    return column % kColumns < 2 ? Guess::kSame : Guess::kZero;
  }
  [[nodiscard]] const std::uint8_t* column(std::size_t i) const {
    return reinterpret_cast<const std::uint8_t*>(columns_.data()) + i * capacity_;
  }
  /// True with orientations: then turn() remembers them, and the models of turns are used.
  [[nodiscard]] bool turns() const { return !radii_.empty(); }
  [[nodiscard]] std::uint32_t models_in_use() const {
    return turns() ? TrackerModelIndex::kCount : TrackerModelIndex::kOfPositions;
  }
  [[nodiscard]] std::span<const std::int32_t> radii() const { return radii_; }
  [[nodiscard]] TrackerBody body(Slot slot) const { return read(0, slot); }
  [[nodiscard]] TrackerBody turn(Slot slot) const { return read(kColumns, slot); }
  /// The values that flags depend on, by slot.
  [[nodiscard]] const std::uint8_t* flag_ages() const { return turns() ? youngest_.data() : column(0); }
  [[nodiscard]] const std::uint8_t* histories() const { return history_.data(); }
  [[nodiscard]] std::uint32_t flag_of(Slot slot, bool rest) const {
    return flag_model(flag_ages()[slot], history_[slot], rest);
  }
  [[nodiscard]] const TrackerModels& models() const { return models_; }
  [[nodiscard]] const TrackerGains& gains() const { return gains_; }

  /// Applies a delta: forgets the renewed bodies, corrects the others in `state`, lets the models learn, and
  /// lets every body age by a frame. `state` has the delta's lifecycle records applied.
  void apply(const TrackerDelta& delta, const Corrections& corrections, const RunBlocks& run_blocks,
             State& state);

  /// The functions of Codec.
  void save_models(NumberEncoder& out) const;
  [[nodiscard]] std::size_t models_bits_bound() const;
  [[nodiscard]] Result<void> load(std::span<const std::byte> columns, NumberDecoder& models);

 private:
  [[nodiscard]] TrackerBody read(std::size_t column, Slot slot) const;
  void write(std::size_t column, Slot slot, const TrackerBody& body);
  // For a stream without orientations.
  void correct_position(const TrackerFilter& filter, const TrackerCorrection& correction, Slot slot,
                        State& state);
  // The same for all corrections of a block.
  void correct_positions(const TrackerFilter& filter, const TrackerDelta& delta, const Block& block,
                         State& state);
  // For a stream with orientations.
  void correct_position_and_turn(const TrackerFilter& filter, const TrackerTurningCorrection& correction,
                                 Slot slot, State& state);
  void grow_older(std::size_t column, const Block& block, std::span<const Slot> renewed, const State& state);
  // Begins to change a block's columns in this frame. Returns false if nothing of them changes: nobody is
  // corrected or renewed, and all ages are at their maximum.
  [[nodiscard]] bool begin(const Block& block, bool is_silent);
  // Recomputes what follows from the columns of a slot.
  void derive(Slot slot);
  void apply(const TrackerDelta& delta, const Corrections& corrections, const Block& block, State& state);

  std::uint32_t capacity_;
  std::vector<std::int32_t> radii_;
  std::vector<std::byte> columns_;  // columns of positions, then of orientations
  // By block: the number of its content, and the frames since a body of it was corrected or renewed, up to
  // kMaxAge.
  std::vector<std::uint64_t> numbers_;
  std::vector<std::uint8_t> silent_;
  // Derived from the columns: flag_history() of each body, and its younger age if it has two.
  std::vector<std::uint8_t> history_, youngest_;
  TrackerModels models_;
  TrackerGains gains_;  // derived from the parameters in force
};

inline TrackerBody TrackerMemory::read(std::size_t column, Slot slot) const {
  const std::byte* at = columns_.data() + column * capacity_ + slot;
  TrackerBody body;
  body.age = std::to_integer<std::uint32_t>(*at);
  body.interval = std::to_integer<std::uint32_t>(*(at += capacity_));
  for (std::int32_t& step : body.steps) step = std::int32_t{static_cast<std::int8_t>(*(at += capacity_))};
  return body;
}

}  // namespace tandem
