#pragma once
// The parts of a timeline of either side.

#include <array>
#include <memory>
#include <optional>

#include "sdk/core/data/body_data.hpp"
#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/news/session_world.hpp"
#include "sdk/core/timeline/snapshot.hpp"
#include "sdk/core/timeline/timeline.hpp"

namespace tandem {

struct TimelineParts {
  std::unique_ptr<Predictor> predictor;
  DeltaCodec delta;
  RunBlocks run_blocks;
  StateHasher hasher;
  WorldFeatures features;
  std::optional<SessionWorld> world;  ///< if the session has features
  std::optional<BodyData> data;       ///< if the stream has data
  std::uint64_t last_number = 0;

  /// The hash of a state right after the delta codec has applied to it.
  [[nodiscard]] std::uint64_t hash(const State& state, const BlockLedger& ledger) {
    return hash(state, ledger, world, data);
  }
  [[nodiscard]] std::uint64_t hash(const State& state, const BlockLedger& ledger,
                                   const std::optional<SessionWorld>& with,
                                   std::optional<BodyData>& with_data) {
    const std::uint64_t of_bodies =
        hasher.hash(state, {.codec = delta.codec().columns(), .predictor = std::as_bytes(state.own())},
                    run_blocks, {.state = ledger.numbers, .codec = delta.codec().column_numbers()});
    if (!with && !with_data) return of_bodies;
    std::array<std::uint64_t, 3> hashes{hasher.leaves_hash()};
    std::size_t count = 1;
    if (with) hashes.at(count++) = with->hash();
    if (with_data) hashes.at(count++) = with_data->hash();
    return hash_bytes(std::as_bytes(std::span(hashes).first(count)));
  }
  /// What a snapshot has beside bodies.
  [[nodiscard]] SnapshotExtras extras() const { return {world ? &*world : nullptr, data ? &*data : nullptr}; }
  /// A number for blocks that a step, a delta or a snapshot changes.
  [[nodiscard]] std::uint64_t new_number() { return ++last_number; }
  /// A predicted step of this timeline's states.
  void step(const State& from, const BlockLedger& from_ledger, State& to, BlockLedger& to_ledger,
            const StepInput& input) {
    TANDEM_ASSERT(from.capacity() == to.capacity() && from.groups() == to.groups());
    TANDEM_ASSERT(from.own().size() == std::size_t{predictor->own_bytes()} * from.capacity());
    TANDEM_ASSERT(to.own().size() == from.own().size());
    predictor->step_blocks(from, to, input, {from_ledger, to_ledger, new_number(), run_blocks});
  }
  /// The input of the next step.
  [[nodiscard]] StepInput step_input(const Drive& drive, const Vec3i& gravity_before) const {
    const StreamParameters& in_force = delta.parameters();
    return {drive, in_force.step, in_force.codec.threshold, gravity_before};
  }
};

/// Checks `layout` and makes its codec. Errors: kUnsupported, kMalformed, kInvalidArgument.
[[nodiscard]] Result<TimelineParts> make_parts(const Layout& layout, const LocalOptions& local,
                                               std::unique_ptr<Predictor> predictor);

}  // namespace tandem
