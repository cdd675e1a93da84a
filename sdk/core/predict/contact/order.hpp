#pragma once
// The order of bodies for the search of pairs: by cells of a grid, which is a torus.

#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/predict/contact/constants.hpp"
#include "sdk/core/predict/contact/pairs.hpp"

namespace tandem {

/// Puts the bodies of a state into the order of their cells. Allocates at creation only.
class ContactOrder {
 public:
  /// Number of places that a vector may read behind the last body.
  static constexpr std::uint32_t kBeyond = 8;
  /// A body's cell: of p >> shift the part in cells, which are 1 / cells_per wide.
  struct Cells {
    std::uint32_t shift;
    std::int32_t cells_per;  ///< cells per grid unit, in 2^-32
  };

  explicit ContactOrder(std::uint32_t capacity);

  /// Returns all bodies by place: first those that take part in pairs, ordered by cell and then by slot (of a
  /// cell, the first ContactGrid::kMostInCell), then the others. `types` gives their radii; a body of a
  /// higher type has that of the last one.
  std::span<ContactBody> sort(const State& state, std::span<const ContactConstants::Type> types,
                              const Cells& cells);

  [[nodiscard]] std::uint32_t side_bits() const { return side_bits_; }
  /// By cell, and one more: the place of its first body.
  [[nodiscard]] std::span<const std::uint32_t> begin() const { return begin_; }
  [[nodiscard]] std::span<const std::uint32_t> place_cell() const { return place_cell_; }
  /// By slot; 0 for dead ones. kBeyond more elements than slots.
  [[nodiscard]] std::span<const std::uint32_t> place() const { return place_; }

 private:
  void scatter(const State& state, std::span<const ContactConstants::Type> types);

  std::uint32_t side_bits_;                  // 2^side_bits cells per side
  std::vector<std::uint32_t> cell_, place_;  // by slot: at first the rank in the cell, later the place
  std::vector<std::uint8_t> in_cell_;        // by cell: number of bodies
  std::vector<std::uint32_t> begin_;
  std::uint32_t count_ = 0;
  std::vector<ContactBody> bodies_;  // by place
  std::vector<std::uint32_t> place_cell_;
};

}  // namespace tandem
