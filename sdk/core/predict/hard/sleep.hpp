#pragma once
// Which bodies of the predictor `hard` sleep through a frame. idl/PROTOCOL.md, "Hard", has the rule.

#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/predict/contact/order.hpp"

namespace tandem {

/// Finds out who sleeps. Allocates at creation only.
class HardSleep {
 public:
  /// `bits`: how cells are numbered.
  HardSleep(std::uint32_t capacity, const ContactCellBits& bits);

  /// Returns whether anybody sleeps. `still`: by slot, 1 for bodies at rest; `cells`: by slot, with all bits
  /// set for dead ones.
  bool find(const State& from, std::span<const std::uint8_t> still, std::span<const std::uint32_t> cells);

  // By slot, as find() left them.
  /// 1 for bodies that sleep through the frame.
  [[nodiscard]] std::span<const std::uint8_t> asleep() const { return asleep_; }
  /// 1 for those of them, and of the bodies at rest, that cannot touch a body which contacts may move.
  [[nodiscard]] std::span<const std::uint8_t> left_out() const { return left_out_; }

 private:
  using Marks = std::vector<std::uint64_t>;  // a bit for each cell

  void mark_around(const Marks& marks);
  void spread(std::uint32_t cells);

  ContactCellBits bits_;
  std::vector<std::uint8_t> asleep_, left_out_;
  Marks moving_, near_, next_;
};

}  // namespace tandem
