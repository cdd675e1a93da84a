#include "sdk/core/predict/hard/sleep.hpp"

#include <algorithm>
#include <array>
#include <cstddef>

#include "sdk/core/lattice/vector_clones.hpp"
#include "sdk/core/predict/still_step.hpp"

namespace tandem {
namespace {

// Writes who would sleep if nobody moved. Returns their number.
TANDEM_VECTOR_CLONES std::uint32_t find_calm(const std::uint8_t* __restrict calm,
                                             const std::uint8_t* __restrict still,
                                             const std::array<const std::int32_t*, 3>& v,
                                             std::uint8_t* __restrict asleep, std::size_t count) {
  const std::int32_t* const x = v[0];
  const std::int32_t* const y = v[1];
  const std::int32_t* const z = v[2];
  std::uint32_t sum = 0;
  for (std::size_t s = 0; s < count; ++s) {
    const auto is =
        static_cast<std::uint8_t>(static_cast<unsigned>((x[s] | y[s] | z[s]) == 0) &
                                  static_cast<unsigned>(calm[s] == kCalmFrames) & (still[s] ^ 1U));
    asleep[s] = is;
    sum += is;
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

HardSleep::HardSleep(std::uint32_t capacity, const ContactCellBits& bits)
    : bits_(bits),
      asleep_(capacity),
      left_out_(capacity),
      moving_((std::size_t{1} << bits.all) / 64),
      near_(moving_.size()),
      next_(moving_.size()) {}

void HardSleep::spread(std::uint32_t cells) {
  next_ = near_;
  add_turned(near_, cells, next_);
  add_turned(near_, near_.size() * 64 - cells, next_);
  near_.swap(next_);
}

// Marks each of these cells and the 26 around it as near.
void HardSleep::mark_around(const Marks& marks) {
  near_ = marks;
  spread(1);
  spread(1U << bits_.row);
  spread(1U << bits_.layer);
}

bool HardSleep::find(const State& from, std::span<const std::uint8_t> still,
                     std::span<const std::uint32_t> cells) {
  const std::size_t count = cells.size();
  if (find_calm(from.own().data(), still.data(), {from.v(0).data(), from.v(1).data(), from.v(2).data()},
                asleep_.data(), count) == 0)
    return false;
  const std::uint32_t last = (1U << bits_.all) - 1;
  std::fill(moving_.begin(), moving_.end(), 0U);
  for (std::size_t s = 0; s < count; ++s) {
    if ((asleep_[s] | still[s]) == 0 && cells[s] <= last) mark(moving_, cells[s]);
  }
  mark_around(moving_);
  for (std::size_t s = 0; s < count; ++s) {
    if (asleep_[s] == 0 || !is_marked(near_, cells[s])) continue;
    asleep_[s] = 0;
    mark(moving_, cells[s]);
  }
  mark_around(moving_);
  for (std::size_t s = 0; s < count; ++s)
    left_out_[s] =
        static_cast<std::uint8_t>((asleep_[s] | still[s]) != 0 && !is_marked(near_, cells[s] & last));
  return true;
}

}  // namespace tandem
