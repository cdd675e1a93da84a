#pragma once
// The engine's bodies on the lattice, frame by frame, and what happened to the slots. All streams encode
// towards this state.

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sdk/core/codec/delta.hpp"
#include "sdk/core/lattice/block_ledger.hpp"
#include "sdk/core/lattice/run_blocks.hpp"
#include "sdk/core/lattice/state.hpp"
#include "services/host/streams/lattice_choice.hpp"
#include "tandem/result.hpp"
#include "tandem/simulation.hpp"

namespace tandem::host {

/// Follows a simulation. A body is shown to clients while it is alive, finite, within extent and lattice, and
/// of a listed type. A body that stops being so is despawned; when it is so again, another body is in its
/// slot. Velocities saturate, and a body that turns by more than kMaxTurn in a step is slowed. If
/// the groups include orientations, a body whose quaternion is not finite or far from norm 1 is hidden too.
/// Nothing is allocated after construction except the text of last_hidden(), and room for more records than
/// a frame ever had. Not thread-safe.
class Mirror {
 public:
  static constexpr double kNoExtent = std::numeric_limits<double>::infinity();

  /// `type_count`: types that the session lists, 1 or more. `groups`: the groups of all its streams together.
  /// `extent`: a body beyond it, scene units, or beyond the lattice is not shown.
  Mirror(const Lattice& lattice, std::uint32_t capacity, TypeId type_count, const Groups& groups = {},
         double extent = kNoExtent);

  /// Before start(): the bodies have records of so many bytes in Bodies::data. 0: none.
  void carry_data(std::size_t record_bytes);
  /// Checks that the mirror can take these bodies. Errors: kInvalidArgument (columns not as long as the
  /// capacity).
  [[nodiscard]] Result<void> check(const engine::Bodies& bodies) const;
  /// Sets the start state: everything shown is in generation 0, without records.
  void start(const engine::Bodies& bodies);
  /// Writes what the bodies do not tell, by slot: the `reuse` of the next body, and 1 for a body that the
  /// engine has and clients must not see. Replaces the content, and keeps the memory.
  void save(std::vector<std::uint8_t>& next_reuse, std::vector<std::uint8_t>& withheld) const;
  /// Call after start(), with what save() wrote when the engine had these bodies: slots keep their `reuse`.
  /// Precondition: both have an element for each slot.
  void restore(std::span<const std::uint8_t> next_reuse, std::span<const std::uint8_t> withheld);
  /// Call after a step, with bodies that check() accepts. `events` may be incomplete: births, deaths and
  /// types are read from the bodies themselves. Only teleports and the reuse of a slot within the step need
  /// their event. Events out of range are ignored.
  /// `moved`: Simulation::moved() of that step, which must be the first since the last call; may be empty.
  /// Blocks are read side by side by `run`; the result is the same to the bit.
  void update(const engine::Bodies& bodies, std::span<const engine::Event> events,
              std::span<const std::uint8_t> moved = {}, const RunBlocks& run = {});

  [[nodiscard]] const State& target() const { return target_; }
  /// The numbers of the contents of target(): a block keeps its number as long as nothing of it changes.
  [[nodiscard]] BlockNumbers numbers() const { return numbers_; }
  /// The bodies' own data by slot, without meaning for dead ones; empty if none are carried.
  [[nodiscard]] std::span<const std::byte> data() const { return data_; }
  /// The records of the last update(): ascending by slot, despawn before spawn.
  [[nodiscard]] std::span<const LifecycleRecord> lifecycle() const { return lifecycle_; }
  /// The `reuse` of the body that is in the slot, or was last; 0 if there was none.
  [[nodiscard]] std::uint8_t last_reuse(Slot slot) const {
    if (target_.alive()[slot] != 0 || generations_[slot] == 0) return target_.reuse()[slot];
    return static_cast<std::uint8_t>(generations_[slot] - 1);
  }
  /// A body beyond it, or beyond the lattice, is hidden; scene units.
  [[nodiscard]] double extent() const { return extent_; }
  /// Bodies that the engine has and clients do not see, now.
  [[nodiscard]] std::uint32_t hidden() const { return hidden_; }
  /// The body that was hidden last and the reason, such as "slot 3 (its x is not a number)"; empty if there
  /// is none.
  [[nodiscard]] const std::string& last_hidden() const { return last_hidden_; }
  /// The body whose turn was slowed last; empty if there is none.
  [[nodiscard]] std::optional<Slot> last_slowed() const { return last_slowed_; }
  /// Repairs since the start: bodies that had to be hidden, and turns slowed, each counted once a frame.
  [[nodiscard]] const engine::Mishaps& mishaps() const { return mishaps_; }

 private:
  struct Run;
  /// What the last look at a block found.
  struct BlockNews {
    bool changed = false;   // a value differs
    bool restless = false;  // some slot may need a record
    bool told_of = false;   // it had a record, or has an event: it is looked at in any case
    std::uint32_t hidden = 0;
    std::uint32_t slowed = 0;
    Slot last_slowed = 0;
  };
  void list_all_blocks();
  void quantise(const engine::Bodies& bodies, const RunBlocks& run);
  void quantise_block(const engine::Bodies& bodies, std::uint32_t block);
  void quantise_turns(const engine::Bodies& bodies, Run& run, BlockNews& news) const;
  void hide(Slot slot);
  /// Says why the slot that was hidden last cannot be shown, if it was in this update.
  void explain(const engine::Bodies& bodies);
  void record_block(const engine::Bodies& bodies, std::uint32_t block);
  void record(Slot slot, const engine::Bodies& bodies, std::uint8_t marks);
  void spawn(Slot slot, TypeId type);

  Lattice lattice_;
  double extent_;  // scene units
  TypeId type_count_;
  State target_;                           // p and v are written completely, the other columns by records
  std::vector<std::byte> data_;            // a copy, as the next step may be under way
  std::vector<std::uint8_t> shown_;        // 1: clients see it in this frame
  std::vector<std::uint8_t> expelled_;     // 1: the engine has it, clients do not
  std::vector<std::uint8_t> marks_;        // bits of Event::Kind in this frame
  std::vector<std::uint8_t> generations_;  // generation of the next spawn in the slot
  std::vector<LifecycleRecord> lifecycle_;
  std::vector<BlockNews> blocks_;
  std::vector<std::uint64_t> numbers_;  // by block
  std::vector<std::uint32_t> busy_;     // blocks that are looked at in this frame
  engine::Mishaps mishaps_;
  std::uint32_t hidden_ = 0;
  std::optional<Slot> unexplained_;
  std::string last_hidden_;
  std::optional<Slot> last_slowed_;
};

}  // namespace tandem::host
