#pragma once
// The step of the predictors `contact` and `field`: the engine's penalty contacts in integers. They differ in
// their constants alone. idl/PROTOCOL.md, "Contact", has the formulas.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/predict/contact/constants.hpp"
#include "sdk/core/predict/contact/order.hpp"
#include "sdk/core/predict/contact/pairs.hpp"
#include "sdk/core/predict/contact/slabs.hpp"
#include "sdk/core/predict/contact/walls.hpp"
#include "sdk/core/predict/predictor.hpp"

namespace tandem {

struct ContactMove;

/// Ballistic motion, plus forces between overlapping bodies and from the static geometry. O(capacity) per
/// step in any state: at most ContactGrid::kMaxInCell bodies of a cell take part in pairs. Bodies at rest
/// cost little where nobody near them moves.
class Contact final : public Predictor, private ContactTaker {
 public:
  /// `kernels`: which of the kernels, all of which give the same bits.
  Contact(std::uint32_t capacity, ContactConstants constants,
          const ContactKernels& kernels = fastest_contact_kernels());

  void step(const State& from, State& to, const StepInput& input) override { step(from, to, input, nullptr); }
  /// Leaves out the whole step if all blocks are at rest, as contact wakes nobody. Otherwise blocks in which
  /// nobody moves keep their numbers, and runs of slots that both states have in common are not copied.
  void step_blocks(const State& from, State& to, const StepInput& input, const StepLedgers& ledgers) override;
  /// Steps all bodies, because each depends on the others.
  void step_slots(const State& from, State& to, const StepInput& input, std::span<const Slot> slots) override;
  [[nodiscard]] bool interacts() const override { return true; }
  [[nodiscard]] std::uint32_t crowded() const override { return crowded_; }
  void spread_by(const RunBlocks& run) override { run_ = run; }

 private:
  /// The bodies of a block of slots.
  struct Present {
    std::uint32_t alive = 0, at_rest = 0;
    bool stays = false;  // as the ledger says: all are at rest, and this step changes nothing
  };
  /// The pairs of a slab that are kept for later sub-steps, in first_ and second_.
  struct Kept {
    std::uint32_t begin = 0, count = 0;
    bool all = false;
  };

  Present keep_at_rest_in_blocks(const State& from, State& to, const StepInput& input,
                                 const StepLedgers* ledgers);
  [[nodiscard]] ContactOrder::Input what_to_sort(const State& from, const State& to, const Present& all,
                                                 const StepLedgers* ledgers) const;
  void take(std::span<const ContactBody> bodies, const std::uint32_t* places) override;
  void move(std::uint32_t from, std::uint32_t to, std::uint32_t count) override;
  void add_all_pairs(bool first);
  void add_pairs(const ContactSlab& slab, Kept& kept, bool first);
  void move_to_next_substep(const ContactMove& move, std::span<ContactBody> bodies);
  void step(const State& from, State& to, const StepInput& input, const StepLedgers* ledgers);
  void finish(const ContactMove& move, std::span<const ContactBody> bodies, const State& from, State& to,
              const StepLedgers* ledgers);

  ContactConstants constants_;
  std::int32_t largest_radius_;
  std::uint32_t shift_;  // a grid unit is 2^shift lattice units
  ContactLaw pair_law_;
  ContactKernels kernels_;
  ContactWalls walls_;
  RunBlocks run_;
  std::int32_t cells_per_ = 0;       // cells per grid unit, in 2^-32
  std::uint32_t near_ = 0;           // in 2^5 grid units
  std::int32_t later_share_ = 0;     // share of v, in 1/32768, by which the sub-steps before the last move a
                                     // body
  bool one_mobility_ = false;        // all bodies have the mobility of type 0
  std::vector<Present> present_;     // by block of slots
  std::vector<std::uint8_t> still_;  // likewise: 1 if nobody moves
  ContactOrder order_;
  ContactSlabs slabs_;
  const State* from_ = nullptr;  // of the current step
  std::uint32_t crowded_ = 0;
  // By place.
  std::vector<ContactTouch> own_touches_;  // empty for one sub-step
  ContactTouch* touches_;
  std::vector<std::uint32_t> near_xy_, later_xy_, near_z_;
  std::vector<std::uint32_t> first_, second_;       // pairs that are kept; empty for one sub-step
  std::array<Kept, ContactSlabs::kMaxSlabs> kept_;  // by slab
  std::vector<std::uint32_t> inverse_root_;         // 2^30 / r by r^2 >> 16
};

}  // namespace tandem
