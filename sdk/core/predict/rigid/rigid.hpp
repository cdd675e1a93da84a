#pragma once
// The step of the predictor `rigid`: bodies that turn and do not give way. idl/PROTOCOL.md, "Rigid", has the
// formulas.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/predict/contact/walls.hpp"
#include "sdk/core/predict/predictor.hpp"
#include "sdk/core/predict/rigid/boxes.hpp"
#include "sdk/core/predict/rigid/constants.hpp"
#include "sdk/core/predict/rigid/near.hpp"
#include "sdk/core/predict/rigid/solver.hpp"
#include "sdk/core/predict/rigid/touch.hpp"
#include "sdk/core/predict/sleep.hpp"
#include "sdk/core/predict/still_step.hpp"
#include "sdk/core/predict/words/four.hpp"

namespace tandem {

/// The kernels of a machine, all of which give the same bits.
struct RigidMachine {
  RigidPairKernels pairs = fastest_rigid_pair_kernels();
  RigidKernels solver = fastest_rigid_kernels();
};

/// Boxes and round bodies whose impulses keep them from moving into each other and into the static geometry,
/// in sub-steps, with friction and spins. One thread; work is O(capacity) in any state, but bodies that hold
/// still, with nobody near who moves, cost hardly more than to see that. A state has one byte of its own per
/// body: for how many frames it has been calm. Where nothing has changed since the last step, a step costs no
/// more than to see that. For streams of positions bodies do not turn.
class Rigid final : public Predictor {
 public:
  Rigid(std::uint32_t capacity, RigidConstants constants, const RigidMachine& machine = {});

  void step(const State& from, State& to, const StepInput& input) override;
  /// Steps all bodies, because each depends on the others.
  void step_slots(const State& from, State& to, const StepInput& input, std::span<const Slot> slots) override;
  [[nodiscard]] bool interacts() const override { return true; }
  [[nodiscard]] std::uint32_t own_bytes() const override { return 1; }
  [[nodiscard]] std::uint32_t crowded() const override { return crowded_; }
  void watch_pushes() override { pushes_.resize(capacity_); }
  /// The pushes of the last sub-step, in the unit of `hard`.
  [[nodiscard]] std::span<const Push> pushes() const override { return pushes_; }

 private:
  // A body in this frame, by place.
  struct Body {
    PlacedSolid solid;
    std::int64_t per_length = 0;  // 2^40 over the radius of the sphere around it
    Slot slot = 0;
    std::int64_t way = 0;  // lattice units: no point of it moves by more, about
    Vec3i v{}, change{};   // 1/64 lattice unit a frame
    Quaternion q{};
    Spin w{};
    RigidRow start;  // of the motion
    Vec3i next_p{}, next_v{};
    Spin next_w{};
  };

  // What pairs and walls are looked at by, in little memory. Lattice units.
  struct alignas(32) Ball {
    Vec3i p{};
    std::int32_t radius = 0;       // of the sphere around the body, and its way
    std::int32_t way = 0;          // as far as pairs look
    std::int32_t wall_radius = 0;  // the same with all of its way, and the reach
    std::int32_t mobility = 0;
    bool is_box = false;
    bool is_placed = false;  // its solid is; later for bodies that nothing moves, if at all
  };

  // Two bodies that may touch.
  struct Near {
    std::uint32_t a, b;
    bool boxes;
    std::int32_t margin;  // lattice units, as d, which is b's centre minus a's
    Vec3i d;
  };

  // A shape of the static geometry, of any kind.
  struct Wall {
    const void* of;
    WallTouch (*touch)(const void* of, const Vec3i& p, std::int32_t radius);
  };

  void set_sizes(const StepInput& input);
  void load(const State& from, const State& to, const StepInput& input);
  void load(const State& from, std::uint32_t place);
  void set_in_motion(const State& from, const StepInput& input, std::uint32_t place);
  void place_ball(std::uint32_t place, std::int32_t mobility);
  void place_solid(std::uint32_t place);
  void find_slow(const State& from, const StepInput& input);
  void find_pairs();
  void find_walls(const StepInput& input);
  void find_wall(const Wall& shape, std::uint32_t place, std::int64_t wall);
  // A length in lattice units in the unit of pairs.
  [[nodiscard]] std::int16_t word_of(std::int64_t length) const {
    const std::int64_t half = std::int64_t{1} << pair_shift_ >> 1;
    const std::int64_t x = ((length << RigidLaw::kLengthBits) + half) >> pair_shift_;
    constexpr std::int64_t kMax = RigidSolverLaw::kMaxWord;
    return static_cast<std::int16_t>(x > kMax ? kMax : x < -kMax ? -kMax : x);
  }
  [[nodiscard]] Four in_words(Four lengths) const;
  void put_in_words(const Body& body, RigidSolidWords& words) const;
  std::size_t touch_boxes();
  void look_at(std::uint32_t place_a, std::uint32_t place_b);
  void touch_near();
  void find_points(const Near& near, const RigidBoxPoints& points, std::size_t lane);
  void find_points(std::uint32_t a, std::uint32_t b, const Vec3l& to_b);
  bool add(std::uint32_t a, std::uint32_t b, std::uint32_t wave, std::size_t first);
  void put_in_order();
  void move(bool turns, const StepInput& input);
  void turn();
  void look_around();
  void write(const State& from, State& to, const StepInput& input);
  void write(const State& from, State& to, std::uint32_t place, int calm_frames);
  void sum_pushes();

  std::uint32_t capacity_;
  RigidConstants constants_;
  std::vector<SizedSolid> solids_;  // of this frame
  std::uint32_t grid_shift_, substep_bits_;
  std::uint32_t shift_ = 0;       // a unit of the solver is 2^shift_ / 64 lattice units
  std::uint32_t ball_shift_ = 0;  // a unit of balls in words is 2^ball_shift_ lattice units
  std::uint32_t pair_shift_ = 0;  // the same of pairs of boxes
  std::int64_t reach_ = 0;        // lattice units
  std::int32_t slop_ = 0;         // solver's units
  std::int64_t largest_radius_ = 1;
  RigidOrder order_;
  Sleep sleep_;
  bool any_held_ = false;
  std::uint32_t crowded_ = 0;
  std::vector<Body> bodies_;
  std::vector<Ball> balls_;                              // by place
  std::vector<std::int32_t> balls_xy_, balls_z_radius_;  // RigidBalls
  std::vector<std::uint32_t> maybe_near_;                // places
  std::vector<RigidSolidWords> solids_in_words_;         // by place; of boxes
  std::vector<std::uint8_t> slow_;                       // by slot, at the start
  std::vector<std::uint8_t> held_;                       // by place, see Sleep
  std::vector<std::uint8_t> signs_;                      // by place, of calm; see rigid.cpp
  std::uint32_t count_ = 0;
  std::vector<RigidMass> masses_;  // by place, and one for the geometry, as all below
  std::vector<RigidRow> now_, base_, way_, fall_;
  std::vector<RigidMoved> moved_;
  std::vector<std::uint64_t> used_;  // by place: the waves in which it has a contact
  std::size_t most_found_;           // contacts that a frame may have
  std::vector<RigidFound> found_;
  std::vector<RigidTouch> touches_;
  static constexpr std::size_t kBlock = 256;  // near pairs compared at a time
  std::array<Near, kBlock> near_;
  std::size_t near_count_ = 0, box_count_ = 0;
  std::array<RigidBoxPair, kBlock> box_pairs_;
  std::array<RigidBoxPoints, kBlock / RigidBoxPoints::kPairs> box_points_;
  RigidPairKernels pair_kernels_;
  RigidTouch nobody_{};
  RigidKernels kernels_;
  std::vector<const RigidTouch*> by_wave_;  // padded with `nobody_` to whole groups
  std::vector<RigidGroup> groups_;          // in the order in which they are solved
  std::size_t group_count_ = 0;
  std::vector<RigidContact> contacts_;
  RigidPoints points_;
  std::array<std::vector<std::int32_t>, kSpinChannels> turns_;  // by place, of this frame
  std::array<std::vector<std::int32_t>, kQuaternionChannels> turned_;
  std::vector<Push> pushes_;  // by slot
  bool moved_any_ = true;     // whether the last step changed anything
  StillStep still_;
};

}  // namespace tandem
