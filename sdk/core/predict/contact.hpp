#pragma once
// The tier `contact`: the engine's penalty contacts as integers. idl/PROTOCOL.md, "Predicted step", has the
// formulas.

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "sdk/core/predict/contact_constants.hpp"
#include "sdk/core/predict/predictor.hpp"

namespace tandem {

/// Ballistic motion plus forces between bodies that overlap and of the static geometry.
/// O(capacity) a step whatever the state: at most kMostInCell bodies of a grid cell take part in pairs.
class Contact final : public Predictor {
 public:
  static constexpr std::uint32_t kMostInCell = 16;

  /// Errors: kMalformed for constants that do not describe a world.
  static Result<std::unique_ptr<Predictor>> create(std::uint32_t capacity,
                                                   std::span<const std::int32_t> constants);
  Contact(std::uint32_t capacity, ContactConstants constants);

  [[nodiscard]] std::string_view name() const override { return "contact"; }
  void step(const State& from, State& to, const Drive& drive) override;
  /// Steps all bodies: each depends on the others.
  void step_slots(const State& from, State& to, const Drive& drive, std::span<const Slot> slots) override;
  [[nodiscard]] bool interacts() const override { return true; }

 private:
  /// A body in the grid. Positions in grid units, 2^shift lattice units.
  struct Record {
    Vec3i q;
    std::int32_t radius;  ///< lattice units
    Vec3i v;
    Slot slot;
  };
  using Force = std::array<std::int64_t, 3>;

  [[nodiscard]] const ContactConstants::Type& type_of(const State& state, Slot slot) const {
    return constants_.types[std::min<std::size_t>(state.type()[slot], constants_.types.size() - 1)];
  }
  void sum_forces(const State& state);
  void add_walls(const State& state);
  void sort_into_grid(const State& state);
  void add_pairs();
  void add_pairs_of(std::uint32_t place, std::uint32_t cell_end,
                    std::span<const std::array<std::uint32_t, 2>> runs);
  void add_pair(std::uint32_t first, std::uint32_t second);
  [[nodiscard]] std::uint32_t cell_of(const State& state, Slot slot) const;
  void integrate(State& state, const Drive& drive, bool first) const;

  ContactConstants constants_;
  std::uint32_t shift_ = 0;           // lattice units to grid units
  std::int64_t cells_per_ = 0;        // cells per grid unit, in 2^-32
  std::uint32_t side_bits_ = 2;       // the grid is a torus of 2^side_bits cells a side
  std::int64_t move_ = 65536;         // share of v that a sub-step moves a body by, in 1/65536
  std::vector<std::uint32_t> cell_;   // by slot
  std::vector<std::uint32_t> begin_;  // by cell, and one more
  std::vector<std::uint32_t> end_;    // by cell: behind the bodies that take part
  std::vector<Record> sorted_;
  // Of one body: 13 cells ahead and its own; one more for the write before the count.
  std::array<std::uint32_t, 14 * kMostInCell + 1> partners_{};
  std::vector<Force> force_;                 // by slot
  std::vector<std::uint32_t> inverse_root_;  // 2^30 / r by r^2 >> 16
};

}  // namespace tandem
