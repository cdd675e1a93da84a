#include "sdk/core/predict/contact/order.hpp"

#include <algorithm>
#include <array>
#include <cstring>

#include "sdk/core/lattice/vector_clones.hpp"

namespace tandem {
namespace {

// Every grid needs four cells per side; otherwise the cells before and behind one would be the same.
std::uint32_t side_bits_for(std::uint32_t capacity) {
  std::uint32_t bits = 2;
  while ((1U << (3 * bits)) < 2 * capacity) ++bits;
  return bits;
}

struct CellNumbers {
  std::uint32_t shift, side_bits;
  std::int32_t cells_per;
};

TANDEM_VECTOR_CLONES void number_cells(const CellNumbers& how, const std::int32_t* __restrict x,
                                       const std::int32_t* __restrict y, const std::int32_t* __restrict z,
                                       std::uint32_t* __restrict cell, std::size_t count) {
  const std::uint32_t last = (1U << (3 * how.side_bits)) - 1;
  const auto along = [shift = how.shift, cells_per = how.cells_per](std::int32_t p) {
    return static_cast<std::uint32_t>(std::int64_t{p >> shift} * cells_per >> 32);
  };
  for (std::size_t s = 0; s < count; ++s) {
    cell[s] = (along(x[s]) + (along(y[s]) << how.side_bits) + (along(z[s]) << (2 * how.side_bits))) & last;
  }
}

// Computes the rank of each body among those of its cell, by slot; from kMostInCell on all have the same
// rank.
void rank_in_cells(std::span<const std::uint32_t> cells, std::span<const std::uint8_t> alive,
                   std::span<std::uint8_t> in_cell, std::span<std::uint32_t> ranks) {
  for (std::size_t s = 0; s < cells.size(); ++s) {
    std::uint8_t& count = in_cell[cells[s]];
    ranks[s] = count;
    count = static_cast<std::uint8_t>(count +
                                      (alive[s] & static_cast<unsigned>(count < ContactGrid::kMostInCell)));
  }
}

// The places of the cells' first bodies, and how many there are, eight cells at a time: the product has in
// each byte the sum of the bytes up to it.
TANDEM_VECTOR_CLONES std::uint32_t begin_cells(std::span<const std::uint8_t> in_cell,
                                               std::span<std::uint32_t> begin) {
  static_assert(8 * ContactGrid::kMostInCell < 256);
  std::uint32_t sum = 0;
  for (std::size_t cell = 0; cell < in_cell.size(); cell += 8) {
    std::uint64_t counts = 0;
    std::memcpy(&counts, &in_cell[cell], sizeof counts);
    const std::uint64_t sums = counts * 0x0101010101010101U;
    std::array<std::uint8_t, 8> before{};
    const std::uint64_t shifted = sums << 8U;
    std::memcpy(before.data(), &shifted, sizeof shifted);
    for (std::size_t i = 0; i < 8; ++i) begin[cell + i] = sum + before[i];
    sum += static_cast<std::uint32_t>(sums >> 56U);
  }
  begin[in_cell.size()] = sum;
  return sum;
}

}  // namespace

ContactOrder::ContactOrder(std::uint32_t capacity)
    : side_bits_(side_bits_for(capacity)),
      cell_(capacity),
      place_(capacity + kBeyond),
      in_cell_(std::size_t{1} << (3 * side_bits_)),
      begin_(in_cell_.size() + 1),
      bodies_(capacity),
      place_cell_(capacity) {}

std::span<ContactBody> ContactOrder::sort(const State& state, std::span<const ContactConstants::Type> types,
                                          const Cells& cells) {
  number_cells({cells.shift, side_bits_, cells.cells_per}, state.p(0).data(), state.p(1).data(),
               state.p(2).data(), cell_.data(), state.capacity());
  std::fill(in_cell_.begin(), in_cell_.end(), std::uint8_t{0});
  rank_in_cells(cell_, state.alive(), in_cell_, place_);
  count_ = begin_cells(in_cell_, begin_);
  scatter(state, types);
  return std::span(bodies_).first(count_);
}

// The loop reads nothing of this object, because the compiler would read it again after every write.
void ContactOrder::scatter(const State& state, std::span<const ContactConstants::Type> types) {
  const std::array<const std::int32_t*, 3> p{state.p(0).data(), state.p(1).data(), state.p(2).data()};
  const std::array<const std::int32_t*, 3> v{state.v(0).data(), state.v(1).data(), state.v(2).data()};
  const std::uint8_t* const alive = state.alive().data();
  const TypeId* const type = state.type().data();
  const std::uint32_t* const begin = begin_.data();
  const std::uint32_t* const cells = cell_.data();
  std::uint32_t* const places = place_.data();
  std::uint32_t* const place_cell = place_cell_.data();
  ContactBody* const bodies = bodies_.data();
  const auto last_type = static_cast<TypeId>(types.size() - 1);
  std::uint32_t count = count_;
  for (Slot s = 0, end = state.capacity(); s < end; ++s) {
    if (alive[s] == 0) {
      places[s] = 0;
      continue;
    }
    const std::uint32_t cell = cells[s];
    const std::uint32_t place = places[s] < ContactGrid::kMostInCell ? begin[cell] + places[s] : count++;
    const std::int32_t radius = types[std::min(type[s], last_type)].radius;
    places[s] = place;
    place_cell[place] = cell;
    bodies[place] = {{p[0][s], p[1][s], p[2][s]}, radius, {v[0][s], v[1][s], v[2][s]}, s};
  }
  count_ = count;
}

}  // namespace tandem
