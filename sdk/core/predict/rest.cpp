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

}  // namespace

bool keep_at_rest(const State& from, State& to, const Drive& drive) {
  const std::uint32_t capacity = from.capacity();
  const std::span<const std::uint8_t> rest = from.rest();
  if (!any_of(rest.data(), capacity)) {
    if (&from != &to) std::fill(to.rest().begin(), to.rest().end(), std::uint8_t{0});
    return false;
  }
  bool any = false;
  for (Slot s = 0; s < capacity; ++s) {
    const bool still = rest[s] != 0 && holds_still({from.c(0)[s], from.c(1)[s], from.c(2)[s]}, drive);
    to.rest()[s] = static_cast<std::uint8_t>(still);
    any |= still;
  }
  return any;
}

}  // namespace tandem
