// SPDX-License-Identifier: MIT
#pragma once
// Which atom is in which slot.

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

namespace tandem_lammps {

/// Gives atoms slots by their ids: an atom keeps its slot while it is there, whatever rank or order it comes
/// from. A new atom gets slot id - 1 if that is free, else the lowest free one; of several the smallest id is
/// first. So the slots depend only on which atoms there were. Not thread-safe.
class Slots {
 public:
  static constexpr std::uint32_t kNone = UINT32_MAX;

  explicit Slots(std::uint32_t capacity);

  /// The atoms of a frame, in any order, each id once. Gives the slot of each, or kNone where there is no
  /// room; valid until the next call.
  std::span<const std::uint32_t> assign(std::span<const std::int64_t> ids);
  /// The column `alive` after that: 0, or a number that is another one whenever another atom is in the slot.
  [[nodiscard]] std::span<const std::uint8_t> alive() const { return alive_; }
  /// Makes `alive` of this slot another number: what is there now did not get there by moving.
  void renew(std::uint32_t slot);

  /// Of the last assign(): atoms that vanished, and atoms without room.
  [[nodiscard]] std::size_t gone() const { return gone_; }
  [[nodiscard]] std::size_t left_out() const { return left_out_; }
  [[nodiscard]] std::uint32_t capacity() const { return static_cast<std::uint32_t>(ids_.size()); }

  /// For a file: capacity times an id (0: free), then a number of the last atom in the slot.
  [[nodiscard]] std::vector<std::uint8_t> save() const;
  /// False, and nothing changed, if these are not the bytes of so many slots.
  [[nodiscard]] bool load(std::span<const std::uint8_t> bytes);

 private:
  [[nodiscard]] std::uint32_t find(std::int64_t id) const;
  void enter(std::int64_t id, std::uint32_t slot);
  void forget(std::int64_t id);
  std::uint32_t place_for(std::int64_t id);

  std::vector<std::int64_t> ids_;     // of each slot; 0: free
  std::vector<std::uint8_t> births_;  // of each slot, also of a free one
  std::vector<std::uint8_t> alive_;
  std::vector<std::uint32_t> seen_;  // in which call
  std::uint32_t call_ = 0;
  std::vector<std::uint32_t> near_;                           // slots by id, for small ids
  std::unordered_map<std::int64_t, std::uint32_t> far_ = {};  // and for large ones
  std::uint32_t lowest_free_ = 0;                             // none below it is free
  std::vector<std::uint32_t> slots_;
  std::vector<std::size_t> new_;
  std::size_t gone_ = 0, left_out_ = 0;
};

}  // namespace tandem_lammps
