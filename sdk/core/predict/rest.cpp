#include "sdk/core/predict/rest.hpp"

#include <algorithm>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/lattice/vector_clones.hpp"

namespace tandem {
namespace {

TANDEM_VECTOR_CLONES bool any_of(const std::uint8_t* rest, std::size_t count) {
  std::uint8_t all = 0;
  for (std::size_t s = 0; s < count; ++s) all |= rest[s];
  return all != 0;
}

// Writes which bodies with this `rest` hold still, and returns their number.
TANDEM_VECTOR_CLONES std::uint32_t hold(const Drive& drive, const std::uint8_t* rest, const std::int32_t* x,
                                        const std::int32_t* y, const std::int32_t* z, std::uint8_t* still,
                                        std::size_t count) {
  const Vec3i g = drive.gravity;
  std::uint32_t sum = 0;
  for (std::size_t s = 0; s < count; ++s) {
    const std::int32_t moved = (x[s] ^ -g[0]) | (y[s] ^ -g[1]) | (z[s] ^ -g[2]);
    const auto holds = static_cast<std::uint8_t>(static_cast<unsigned>(moved == 0) & rest[s]);
    still[s] = holds;
    sum += holds;
  }
  return sum;
}

TANDEM_VECTOR_CLONES bool any_moves(const std::uint8_t* alive, const std::uint8_t* rest, std::size_t count) {
  std::uint8_t all = 0;
  for (std::size_t s = 0; s < count; ++s) all |= static_cast<std::uint8_t>(alive[s] & ~rest[s]);
  return all != 0;
}

}  // namespace

bool keep_at_rest(const State& from, State& to, const Drive& drive) {
  return keep_at_rest(from, to, drive, 0, from.capacity()) > 0;
}

std::uint32_t keep_at_rest(const State& from, State& to, const Drive& drive, Slot first,
                           std::uint32_t count) {
  TANDEM_ASSERT(from.capacity() == to.capacity() && first + count <= from.capacity());
  const std::uint8_t* const rest = &from.rest()[first];
  std::uint8_t* const still = &to.rest()[first];
  if (!any_of(rest, count)) {
    if (&from != &to) std::fill_n(still, count, std::uint8_t{0});
    return 0;
  }
  return hold(drive, rest, &from.c(0)[first], &from.c(1)[first], &from.c(2)[first], still, count);
}

bool all_at_rest(const State& state, Slot first, std::uint32_t count) {
  return !any_moves(state.alive().data() + first, state.rest().data() + first, count);
}

}  // namespace tandem
