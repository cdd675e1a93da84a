#pragma once
// The tier `field`: contacts in 16 bits, one step a frame. idl/PROTOCOL.md, "Predicted step", has
// the formulas.

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "sdk/core/predict/contact_constants.hpp"
#include "sdk/core/predict/field_pairs.hpp"
#include "sdk/core/predict/field_walls.hpp"
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
  ~Field() override = default;
  Field(const Field&) = delete;
  Field& operator=(const Field&) = delete;

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
  void add_pairs(const State& state);

  ContactConstants constants_;
  FieldForces* set_forces_;
  FieldWalls walls_;
  FieldLaw law_;
  bool equal_masses_ = true;
  std::int32_t diameter_ = 2;       // of the largest bodies
  std::uint32_t shift_ = 0;         // lattice units of 2^shift_ ...
  std::uint32_t per_diameter_ = 0;  // ... to 1/8192 of a diameter, in 2^-16
  std::int32_t cells_per_ = 0;      // ... to cells, in 2^-32
  std::uint32_t side_bits_ = 2;

  std::uint32_t count_ = 0;                         // bodies in the grid
  std::vector<std::uint32_t> cell_;                 // by slot
  std::vector<std::uint32_t> rank_;                 // by slot: in its cell
  std::vector<std::uint32_t> begin_;                // by cell, and one more
  std::vector<Slot> slot_;                          // by place
  std::array<std::vector<std::int16_t>, 3> p_, v_;  // by place
  std::array<std::vector<std::int32_t>, 3> f_;      // by place
  std::array<std::vector<std::int32_t>, 3> force_;  // by slot
};

}  // namespace tandem
