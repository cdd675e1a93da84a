#pragma once
// Finds the contacts of a frame, for the predictor `hard`, and puts them into waves.

#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/predict/contact/constants.hpp"
#include "sdk/core/predict/contact/order.hpp"
#include "sdk/core/predict/hard/solver.hpp"

namespace tandem {

/// What contacts depend on besides bodies.
struct HardReach {
  std::uint32_t shift;  ///< a unit of the solver is 2^shift / 64 lattice units
  std::int32_t reach;   ///< lattice units: nearer bodies, and those about to come nearer, touch
  std::int32_t wall;    ///< lattice units, added to radii towards the static geometry
  std::int32_t largest_radius;
};

/// Allocates at creation only.
class HardContacts {
 public:
  /// `grid_shift`: a grid unit is 2^grid_shift lattice units.
  HardContacts(std::uint32_t capacity, std::uint32_t grid_shift);

  /// Finds all contacts of `bodies`, which `order` has put in order; `mobility` by place, of type 0 as 65536,
  /// 0 for bodies that contacts do not change.
  void find(const ContactConstants& constants, const HardReach& reach, const ContactOrder& order,
            std::span<const ContactBody> bodies, std::span<const std::int32_t> mobility);

  /// In the order in which they were found. The number of bodies stands for b where that is the geometry.
  [[nodiscard]] std::span<const HardContact> all() const { return std::span(contacts_).first(count_); }
  /// The same by waves.
  [[nodiscard]] std::span<HardGroup> groups() { return std::span(groups_).first(group_count_); }

 private:
  void find_pairs(const HardReach& reach, const ContactOrder& order, std::span<const ContactBody> bodies,
                  std::span<const std::int32_t> mobility);
  template <class Shape>
  void find_walls(const Shape& shape, const HardReach& reach, std::span<const ContactBody> bodies,
                  std::span<const std::int32_t> mobility);
  void add(HardContact contact, std::uint32_t least_wave, std::uint32_t most_wave,
           std::span<const std::int32_t> mobility);
  void group(std::uint32_t nobody);

  std::uint32_t grid_shift_;
  ContactKernels kernels_;
  std::vector<std::uint32_t> near_xy_, later_xy_, near_z_;  // by place
  std::vector<std::uint32_t> first_, second_;               // pairs of places
  std::vector<std::uint32_t> used_;                         // by place: the waves in which it has a contact
  std::vector<HardContact> contacts_;
  std::uint32_t count_ = 0, group_count_ = 0;
  std::vector<HardGroup> groups_;
};

}  // namespace tandem
