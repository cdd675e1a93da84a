#include "services/engines/particles/strays.hpp"

#include <algorithm>
#include <bit>
#include <utility>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::engine {

Strays::Strays(std::uint32_t most) : first_(std::max(kTogether, std::bit_ceil(2 * most)) + 2) {
  strays_.reserve(most);
  for (auto* column : {&x_, &y_, &z_, &radius_}) column->resize(most + kGroup);
  place_.resize(most + kGroup);
}

void Strays::clear() {
  strays_.clear();
  arrange();
}

std::uint32_t Strays::add(const Stray& stray) {
  TANDEM_ASSERT(!full());
  strays_.push_back(stray);
  return size() - 1;
}

std::uint32_t Strays::remove(std::uint32_t number) {
  TANDEM_ASSERT(number < strays_.size());
  strays_[number] = strays_.back();
  strays_.pop_back();
  return strays_.size() > number ? strays_[number].place : kNoPlace;
}

// A counting sort.
void Strays::arrange() {
  const std::uint32_t buckets = std::max(kTogether, std::bit_ceil(2 * size()));
  mask_ = buckets - kTogether;
  std::fill(first_.begin(), first_.begin() + buckets + 2, 0U);
  std::uint32_t* const next =
      first_.data() + 1;  // counts, then places; at last the ends, which are beginnings
  for (const Stray& stray : strays_) ++next[bucket(stray.cell)];
  std::uint32_t at = 0;
  for (std::uint32_t i = 0; i < buckets; ++i) at += std::exchange(next[i], at);
  for (const Stray& stray : strays_) {
    const std::uint32_t to = next[bucket(stray.cell)]++;
    x_[to] = stray.x, y_[to] = stray.y, z_[to] = stray.z, radius_[to] = stray.radius;
    place_[to] = stray.place;
  }
}

void Strays::look_around(const Rows& rows, const std::array<std::uint32_t, 3>& across, Runs& out) const {
  out.count = 0;
  const auto put = [&out](Run run) {
    if (run.begin == run.end) return;
    // Cells of two rows may share a bucket.
    for (std::uint32_t i = 0; i < out.count; ++i)
      if (out.runs[i].begin == run.begin) return;
    out.runs[out.count++] = run;
  };
  const bool together =
      across[0] < across[1] && across[1] < across[2] && across[0] / kTogether == across[2] / kTogether;
  for (const std::uint32_t row : rows.first) {
    if (together) {
      const std::uint32_t* const first = &first_[bucket(row + across[0])];
      put({first[0], first[3]});
      continue;
    }
    for (const std::uint32_t x : across) {
      const std::uint32_t* const first = &first_[bucket(row + x)];
      put({first[0], first[1]});
    }
  }
}

}  // namespace tandem::engine
