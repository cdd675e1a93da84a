#pragma once
// Finds the contacts of a frame, for the predictor `hard`, and puts them into waves.

#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/predict/contact/constants.hpp"
#include "sdk/core/predict/contact/order.hpp"
#include "sdk/core/predict/hard/meet.hpp"
#include "sdk/core/predict/hard/solver.hpp"

namespace tandem {

/// The kernels of a machine, all of which give the same bits.
struct HardMachine {
  ContactKernels pairs = fastest_contact_kernels();
  HardMeet meet = fastest_hard_meet();
  HardKernels solver = fastest_hard_kernels();
};

/// Allocates at creation only.
class HardContacts {
 public:
  /// The box around some consecutive bodies, and the maximum of how near to geometry they have a contact.
  struct Block {
    Vec3i low{}, high{};
    std::int32_t longest = 0;
  };

  /// `grid_shift`: a grid unit is 2^grid_shift lattice units.
  HardContacts(std::uint32_t capacity, std::uint32_t grid_shift, const HardMachine& machine);

  [[nodiscard]] const HardKernels& kernels() const { return kernels_; }

  /// Finds all contacts of `bodies`, which `order` has put in order; `mobility` by place, of type 0 as 65536,
  /// 0 for bodies that contacts do not change.
  void find(const ContactConstants& constants, const HardReach& reach, const ContactOrder& order,
            std::span<const ContactBody> bodies, std::span<const std::int32_t> mobility);

  /// In the order in which they were found. The number of bodies stands for b where that is the geometry.
  [[nodiscard]] std::span<const HardContact> all() const { return std::span(contacts_).first(count_); }
  /// The same by runs. A wave has two: contacts that are likely to push, and behind them those that are not,
  /// so that passes leave whole groups out. The last group of a wave may be filled with contacts of the
  /// geometry with itself.
  [[nodiscard]] std::span<HardGroup> groups() { return std::span(groups_).first(group_count_); }

 private:
  void find_pairs(const HardReach& reach, const ContactOrder& order, std::span<const ContactBody> bodies,
                  std::span<const std::int32_t> mobility);
  void add_pairs(std::uint32_t count, std::span<const std::int32_t> mobility);
  template <class Shape>
  void find_walls(const Shape& shape, const HardReach& reach, std::span<const ContactBody> bodies,
                  std::span<const std::int32_t> mobility);
  void enclose_blocks(const HardReach& reach, std::span<const ContactBody> bodies);
  void group(std::uint32_t nobody);

  std::uint32_t grid_shift_;
  ContactKernels pair_kernels_;
  HardMeet meet_;
  HardKernels kernels_;
  std::vector<std::uint32_t> near_xy_, later_xy_, near_z_;  // by place
  std::vector<std::uint32_t> first_, second_;               // pairs of places
  std::vector<std::uint32_t> used_;                         // by place: the waves in which it has a contact
  std::vector<std::int32_t> longest_;                       // by place: how near to geometry it has a contact
  std::vector<Block> blocks_;
  std::vector<HardContact> contacts_;  // and room for pairs that are none
  std::vector<std::uint32_t> by_run_;  // of contacts_, with gaps filled, for groups_
  std::uint32_t count_ = 0, group_count_ = 0;
  std::vector<HardGroup> groups_;
};

}  // namespace tandem
