#include "sdk/core/predict/sleep.hpp"

#include <algorithm>
#include <array>
#include <cstddef>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/lattice/vector_clones.hpp"
#include "sdk/core/predict/still_step.hpp"

namespace tandem {
namespace {

// Writes who holds still if nobody moves: who is at rest, and who sleeps, if `may_sleep` is 1. Returns the
// number of sleepers.
TANDEM_VECTOR_CLONES std::uint32_t hold(const std::uint8_t* __restrict calm,
                                        const std::uint8_t* __restrict at_rest,
                                        const std::array<const std::int32_t*, 6>& motion,
                                        std::uint32_t may_sleep, std::uint8_t* __restrict held,
                                        std::size_t count) {
  const auto [x, y, z, turn_x, turn_y, turn_z] = motion;
  std::uint32_t sum = 0;
  for (std::size_t s = 0; s < count; ++s) {
    const auto sleeps = static_cast<std::uint8_t>(
        static_cast<unsigned>((x[s] | y[s] | z[s] | turn_x[s] | turn_y[s] | turn_z[s]) == 0) &
        static_cast<unsigned>(calm[s] == kCalmFrames) & (at_rest[s] ^ 1U) & may_sleep);
    held[s] = sleeps | at_rest[s];
    sum += sleeps;
  }
  return sum;
}

void mark(std::vector<std::uint64_t>& marks, std::uint32_t cell) {
  marks[cell / 64] |= std::uint64_t{1} << (cell % 64);
}
bool is_marked(const std::vector<std::uint64_t>& marks, std::uint32_t cell) {
  return (marks[cell / 64] >> (cell % 64) & 1U) != 0;
}

// Adds what `marks`, which are a ring, have so many cells before.
void add_turned(const std::vector<std::uint64_t>& marks, std::size_t by, std::vector<std::uint64_t>& sum) {
  const std::size_t words = marks.size();
  const std::size_t part = by % 64;
  std::size_t at = (words - by / 64) % words;
  for (std::uint64_t& to : sum) {
    const std::uint64_t before = marks[at == 0 ? words - 1 : at - 1];
    to |= part == 0 ? marks[at] : marks[at] << part | before >> (64 - part);
    if (++at == words) at = 0;
  }
}

}  // namespace

Sleep::Sleep(std::uint32_t capacity, const SleepCells& bits)
    : bits_(bits),
      held_(capacity),
      left_out_(capacity),
      moving_((std::size_t{1} << bits.all) / 64),
      near_(moving_.size()),
      next_(moving_.size()) {
  TANDEM_ASSERT(bits.row < bits.layer && bits.layer < bits.all && bits.all >= 6);  // words of 64 cells
}

void Sleep::spread(std::uint32_t cells) {
  next_ = near_;
  add_turned(near_, cells, next_);
  add_turned(near_, near_.size() * 64 - cells, next_);
  near_.swap(next_);
}

// Marks each of these cells and the 26 around it as near.
void Sleep::mark_around(const Marks& marks) {
  near_ = marks;
  spread(1);
  spread(1U << bits_.row);
  spread(1U << bits_.layer);
}

// Those who would sleep, but have somebody near who rouses them, do not.
void Sleep::rouse(std::span<const std::uint8_t> at_rest, std::span<const std::uint32_t> cells) {
  mark_around(moving_);
  for (std::size_t s = 0; s < cells.size(); ++s)
    if (held_[s] != at_rest[s] && is_marked(near_, cells[s])) held_[s] = 0;
}

bool Sleep::find(const State& from, const StepInput& input, std::span<const std::uint8_t> at_rest,
                 std::span<const std::uint32_t> cells, std::span<const std::uint8_t> slow) {
  const std::size_t count = cells.size();
  TANDEM_ASSERT(count == held_.size() && at_rest.size() == count && from.own().size() == count);
  TANDEM_ASSERT(slow.empty() || slow.size() == count);
  // Any change of gravity may move a heap.
  const bool may_sleep = input.gravity_before == input.drive.gravity;
  const auto spin = [&from, slow](std::size_t i) {
    return slow.empty() || from.w(i).empty() ? from.v(i).data() : from.w(i).data();
  };
  const std::uint32_t sleepers =
      hold(from.own().data(), at_rest.data(),
           {from.v(0).data(), from.v(1).data(), from.v(2).data(), spin(0), spin(1), spin(2)},
           may_sleep ? 1U : 0U, held_.data(), count);
  if (sleepers == 0 && std::find(held_.begin(), held_.end(), 1) == held_.end()) return false;
  const std::uint32_t last = (1U << bits_.all) - 1;
  const auto mark_moving = [&](std::span<const std::uint8_t> but) {
    std::fill(moving_.begin(), moving_.end(), 0U);
    for (std::size_t s = 0; s < count; ++s)
      if (held_[s] == 0 && (but.empty() || but[s] == 0) && cells[s] <= last) mark(moving_, cells[s]);
  };
  if (sleepers != 0) {
    mark_moving(slow);
    rouse(at_rest, cells);
  }
  mark_moving({});
  mark_around(moving_);
  for (std::size_t s = 0; s < count; ++s)
    left_out_[s] = static_cast<std::uint8_t>(held_[s] != 0 && !is_marked(near_, cells[s] & last));
  return true;
}

}  // namespace tandem
