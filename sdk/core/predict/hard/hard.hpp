#pragma once
// The step of the predictor `hard`: bodies that do not give way. idl/PROTOCOL.md, "Hard", has the formulas.

#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/predict/contact/constants.hpp"
#include "sdk/core/predict/contact/order.hpp"
#include "sdk/core/predict/hard/contacts.hpp"
#include "sdk/core/predict/predictor.hpp"
#include "sdk/core/predict/sleep.hpp"
#include "sdk/core/predict/still_step.hpp"

namespace tandem {

/// Three components and padding.
struct alignas(16) HardVector {
  std::array<std::int32_t, 4> of{};
};

/// A body after the step.
struct HardNext {
  HardVector p, v;
};

/// Ballistic motion in four sub-steps, with impulses that keep bodies from moving into each other and into
/// the static geometry, and friction. O(capacity) per step in any state, but bodies that sleep, with nobody
/// near who moves, cost hardly more than to see that. A state has one byte of its own per body: for how many
/// frames it has been calm.
class Hard final : public Predictor {
 public:
  /// Of `constants`, it reads types and shapes.
  Hard(std::uint32_t capacity, ContactConstants constants, const HardMachine& machine = {});

  void step(const State& from, State& to, const StepInput& input) override;
  /// Steps all bodies, because each depends on the others.
  void step_slots(const State& from, State& to, const StepInput& input, std::span<const Slot> slots) override;
  [[nodiscard]] bool interacts() const override { return true; }
  [[nodiscard]] std::uint32_t own_bytes() const override { return 1; }
  [[nodiscard]] std::uint32_t crowded() const override { return crowded_; }
  void watch_pushes() override { pushes_.resize(mobility_.size()); }
  /// The pushes of the last sub-step, in half a unit of the solver: the threshold a frame is 2^10 to 2^11
  /// - 1.
  [[nodiscard]] std::span<const Push> pushes() const override { return pushes_; }

 private:
  void set_radii(const StepInput& input);
  void load(const State& from, const State& to, const StepInput& input);
  void move(const StepInput& input);
  void look_around();
  void write(const State& from, State& to, const StepInput& input);
  void sum_pushes();

  ContactConstants constants_;
  std::vector<ContactConstants::Type> types_;  // with the radii of this frame
  std::uint32_t grid_shift_;
  HardReach reach_{};
  ContactOrder order_;
  HardContacts contacts_;
  Sleep sleep_;
  bool any_held_ = false;
  std::uint32_t crowded_ = 0;
  std::span<const ContactBody> bodies_;         // by place, as all below
  std::vector<HardRow> w_, base_, way_, fall_;  // see HardMotions
  std::vector<std::int32_t> moved_xz_, moved_y_;
  std::vector<HardVector> change_;  // of v in this frame, without contacts
  std::vector<HardNext> next_;
  std::vector<std::int32_t> mobility_;  // 0: contacts do not change it
  std::vector<std::uint8_t> signs_;     // of calm; see hard.cpp
  std::vector<Push> pushes_;            // by slot
  StillStep still_;
};

}  // namespace tandem
