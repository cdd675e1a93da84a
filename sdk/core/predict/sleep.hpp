#pragma once
// Which bodies of the predictors `hard` and `rigid` hold still through a frame. idl/PROTOCOL.md, "Hard", has
// the rule.

#include <cstdint>
#include <span>
#include <vector>

#include "sdk/core/predict/predictor.hpp"

namespace tandem {

/// The neighbours of a cell are found by adding 1, 2^row and 2^layer to its number, or taking them from it,
/// mod 2^all.
struct SleepCells {
  std::uint32_t row, layer, all;
};

/// Finds out who holds still. Allocates at creation only.
class Sleep {
 public:
  Sleep(std::uint32_t capacity, const SleepCells& bits);

  /// Returns whether anybody holds still. All by slot: `at_rest`: 1 for bodies at rest; `cells`, with all
  /// bits set for dead ones; `slow`: 1 for bodies that rouse nobody although they move. Where it is empty, as
  /// for `hard`, every mover rouses, and spins do not count.
  bool find(const State& from, const StepInput& input, std::span<const std::uint8_t> at_rest,
            std::span<const std::uint32_t> cells, std::span<const std::uint8_t> slow = {});

  // By slot, as find() left them.
  /// 1 for bodies that nothing moves, because they are at rest or sleep through the frame.
  [[nodiscard]] std::span<const std::uint8_t> held() const { return held_; }
  /// 1 for those of them that cannot touch a body which contacts may move.
  [[nodiscard]] std::span<const std::uint8_t> left_out() const { return left_out_; }

 private:
  using Marks = std::vector<std::uint64_t>;  // a bit for each cell

  void mark_around(const Marks& marks);
  void spread(std::uint32_t cells);
  void rouse(std::span<const std::uint8_t> at_rest, std::span<const std::uint32_t> cells);

  SleepCells bits_;
  std::vector<std::uint8_t> held_, left_out_;
  Marks moving_, near_, next_;
};

}  // namespace tandem
