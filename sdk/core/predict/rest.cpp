#include "sdk/core/predict/rest.hpp"

#include <algorithm>

#include "sdk/core/lattice/vector_clones.hpp"

namespace tandem {
namespace {

TANDEM_VECTOR_CLONES bool any_of(const std::uint8_t* rest, std::size_t count) {
  std::uint8_t all = 0;
  for (std::size_t s = 0; s < count; ++s) all |= rest[s];
  return all != 0;
}

// `stays` may be `rest`.
TANDEM_VECTOR_CLONES bool keep(const std::uint8_t* rest, const std::int32_t* x, const std::int32_t* y,
                               const std::int32_t* z, const Vec3i& gravity, std::size_t count,
                               std::uint8_t* stays) {
  const std::int32_t gx = gravity[0], gy = gravity[1], gz = gravity[2];
  std::uint8_t any = 0;
  for (std::size_t s = 0; s < count; ++s) {
    const std::int32_t off = (x[s] + gx) | (y[s] + gy) | (z[s] + gz);
    const auto still = static_cast<std::uint8_t>(rest[s] & (off == 0 ? 1 : 0));
    stays[s] = still;
    any |= still;
  }
  return any != 0;
}

TANDEM_VECTOR_CLONES bool any_moves(const std::uint8_t* alive, const std::uint8_t* rest, std::size_t count) {
  std::uint8_t all = 0;
  for (std::size_t s = 0; s < count; ++s) all |= static_cast<std::uint8_t>(alive[s] & ~rest[s]);
  return all != 0;
}

}  // namespace

bool keep_at_rest(const State& from, State& to, const Drive& drive) {
  return keep_at_rest(from, to, drive, 0, from.capacity());
}

bool keep_at_rest(const State& from, State& to, const Drive& drive, Slot first, std::uint32_t count) {
  const std::uint8_t* const rest = from.rest().data() + first;
  std::uint8_t* const stays = to.rest().data() + first;
  if (!any_of(rest, count)) {
    if (&from != &to) std::fill_n(stays, count, std::uint8_t{0});
    return false;
  }
  return keep(rest, from.c(0).data() + first, from.c(1).data() + first, from.c(2).data() + first,
              drive.gravity, count, stays);
}

bool all_at_rest(const State& state, Slot first, std::uint32_t count) {
  return !any_moves(state.alive().data() + first, state.rest().data() + first, count);
}

}  // namespace tandem
