#pragma once
// The predicted simulation: the cheap deterministic step that the server and every client run.

#include <cstdint>
#include <span>

#include "sdk/core/lattice/block_ledger.hpp"
#include "sdk/core/lattice/run_blocks.hpp"
#include "sdk/core/lattice/state.hpp"
#include "sdk/core/predict/drive.hpp"

namespace tandem {

/// The changes of a body's velocity by contacts in one step, in a unit that holds for that step.
struct Push {
  Vec3i normal{};  ///< by what keeps bodies apart; without `edge`
  Vec3i wall{};    ///< by what keeps them out of the static geometry
  Vec3i across{};  ///< by friction
  Vec3i edge{};    ///< by edges and corners of boxes, which may be round
};

/// What a timeline knows about the blocks of both states of a step.
struct StepLedgers {
  const BlockLedger& from;
  BlockLedger& to;       ///< may be `from`, if the states are one; becomes that of the state after the step
  std::uint64_t number;  ///< for the blocks that the step changes; not in use yet
  const RunBlocks& run;  ///< may be empty
};

/// A predicted step in integers only. There is one object per timeline; it may keep scratch memory between
/// calls.
class Predictor {
 public:
  virtual ~Predictor() = default;

  /// Writes into `to` the state that follows `from`. Both have the same capacity and may be the same object.
  /// Allocates nothing. Dead slots stay zero.
  virtual void step(const State& from, State& to, const StepInput& input) = 0;

  /// Does the same, to the same bits, and leaves out what cannot change: blocks whose bodies are all at rest,
  /// as long as gravity stays; a predictor may also leave out runs that both states have in common. One that
  /// does not override it leaves out nothing.
  virtual void step_blocks(const State& from, State& to, const StepInput& input, const StepLedgers& ledgers);

  /// Does the same as step() for the listed slots only; other slots of `to` do not change. Called only if
  /// `interacts()` is false, after a delta changed a few bodies of an earlier frame.
  virtual void step_slots(const State& from, State& to, const StepInput& input,
                          std::span<const Slot> slots) = 0;

  /// True if a body's next state depends on other bodies, so that a late correction re-simulates all of them.
  [[nodiscard]] virtual bool interacts() const = 0;

  /// Number of bytes a slot that it keeps in a state (State::own()).
  [[nodiscard]] virtual std::uint32_t own_bytes() const { return 0; }

  /// From the next step on, pushes() is kept. For a server that learns from it; changes no state.
  virtual void watch_pushes() {}
  /// The pushes of the last step, by slot; empty for a predictor without, or if nobody watches.
  [[nodiscard]] virtual std::span<const Push> pushes() const { return {}; }

  /// Bodies that passed through others in the last step, because their cell had more than pairs are sought
  /// of: cells are as wide as the largest body. For an operator.
  [[nodiscard]] virtual std::uint32_t crowded() const { return 0; }

  /// From the next step on, work is spread by `run`, if the predictor can do so. It changes no bit.
  virtual void spread_by(const RunBlocks& /*run*/) {}
};

}  // namespace tandem
