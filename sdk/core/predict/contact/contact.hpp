#pragma once
// The step of the predictors `contact` and `field`: the engine's penalty contacts in integers. They differ in
// their constants alone. idl/PROTOCOL.md, "Contact", has the formulas.

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "sdk/core/predict/contact/constants.hpp"
#include "sdk/core/predict/contact/order.hpp"
#include "sdk/core/predict/contact/pairs.hpp"
#include "sdk/core/predict/contact/walls.hpp"
#include "sdk/core/predict/predictor.hpp"

namespace tandem {

/// Ballistic motion, plus forces between overlapping bodies and from the static geometry. O(capacity) per
/// step in any state: at most ContactGrid::kMostInCell bodies of a cell take part in pairs.
class Contact final : public Predictor {
 public:
  Contact(std::uint32_t capacity, ContactConstants constants);

  void step(const State& from, State& to, const StepInput& input) override;
  /// Leaves out the whole step if all blocks are at rest, as contact wakes nobody.
  void step_blocks(const State& from, State& to, const StepInput& input, const StepLedgers& ledgers) override;
  /// Steps all bodies, because each depends on the others.
  void step_slots(const State& from, State& to, const StepInput& input, std::span<const Slot> slots) override;
  [[nodiscard]] bool interacts() const override { return true; }

 private:
  void add_pairs(bool first);
  void copy(const State& from, State& to) const;

  ContactConstants constants_;
  std::int32_t largest_radius_;
  std::uint32_t shift_;  // a grid unit is 2^shift lattice units
  ContactLaw pair_law_;
  ContactKernels kernels_;
  ContactWalls walls_;
  std::int32_t cells_per_ = 0;    // cells per grid unit, in 2^-32
  std::uint32_t near_ = 0;        // in 2^5 grid units
  std::int32_t later_share_ = 0;  // share of v, in 1/32768, by which the sub-steps before the last move a
                                  // body
  bool one_mobility_ = false;     // all bodies have the mobility of type 0
  ContactOrder order_;
  // By place.
  std::vector<ContactView> views_;
  std::vector<ContactForce> forces_;
  std::vector<std::uint32_t> near_xy_, later_xy_, near_z_;
  std::vector<std::uint32_t> first_, second_;
  std::vector<std::uint32_t> inverse_root_;  // 2^30 / r by r^2 >> 16
  bool all_kept_ = false;                    // first_ and second_ hold all pairs of the frame
  std::uint32_t kept_ = 0;
};

}  // namespace tandem
