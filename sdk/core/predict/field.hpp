#pragma once
// The tier `field`: contacts in 16 bits, one or two passes a frame. idl/PROTOCOL.md, "Predicted step", has
// the formulas.

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "sdk/core/predict/contact_constants.hpp"
#include "sdk/core/predict/field_pairs.hpp"
#include "sdk/core/predict/predictor.hpp"

namespace tandem {

/// Ballistic motion plus coarse forces between bodies that overlap and those of the static geometry.
/// O(capacity) a step whatever the state: at most FieldGrid::kMostInCell bodies of a grid cell meet others.
class Field final : public Predictor {
 public:
  /// Errors: kMalformed for constants that do not describe a world.
  static Result<std::unique_ptr<Predictor>> create(std::uint32_t capacity,
                                                   std::span<const std::int32_t> constants);
  Field(std::uint32_t capacity, ContactConstants constants);

  [[nodiscard]] std::string_view name() const override { return "field"; }
  void step(const State& from, State& to, const Drive& drive) override;
  /// Steps all bodies: each depends on the others.
  void step_slots(const State& from, State& to, const Drive& drive, std::span<const Slot> slots) override;
  [[nodiscard]] bool interacts() const override { return true; }

 private:
  [[nodiscard]] const ContactConstants::Type& type_of(const State& state, Slot slot) const {
    return constants_.types[std::min<std::size_t>(state.type()[slot], constants_.types.size() - 1)];
  }
  void sort(const State& state);
  void put_into_lanes(const State& state);
  void add_walls(const State& state);
  template <class Shape>
  void add_wall(const State& state, const Shape& shape, std::uint32_t place);
  void integrate(State& state, const Drive& drive, bool first) const;

  ContactConstants constants_;
  std::int32_t passes_ = 1;
  FieldLaw law_;
  ContactMaterial wall_;           // gains of a pass, K in 1/16384, others in 1/8192
  std::int32_t diameter_ = 2;      // of the largest bodies
  std::uint32_t shift_ = 0;        // lattice units of 2^shift_
  std::int64_t per_diameter_ = 0;  // 1/8192 of a diameter to that, in 2^-16
  std::int64_t cells_per_ = 0;     // cells to 1/8192 of a diameter, in 2^-32
  std::int32_t move_ = 65536;      // share of v that a pass moves a body by, in 1/65536
  std::uint32_t side_bits_ = 2;

  std::uint32_t count_ = 0;                              // alive bodies
  std::vector<std::uint32_t> cell_;                      // by slot
  std::vector<std::uint32_t> rank_;                      // by slot: in its cell
  std::vector<std::uint32_t> begin_;                     // by cell, and one more
  std::vector<Slot> slot_;                               // by place
  std::array<std::vector<std::int16_t>, 3> p_, v_, f_;   // by place, eight more
  std::array<std::vector<std::int64_t>, 3> wall_force_;  // by place
};

}  // namespace tandem
