// Only this file converts the engine's floats to integers. It is separate so that it can be compiled for
// vector units. It does nothing but conversions, so results do not depend on that.
#include "services/host/streams/quantise.hpp"

#include <algorithm>
#include <array>
#include <cstring>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/lattice/vector_clones.hpp"

namespace tandem::host {

namespace {

// Values at a time, which stay in the innermost cache.
constexpr std::size_t kBlock = 512;

TANDEM_VECTOR_CLONES void quantise_block(const float* __restrict x, std::size_t count, double scale,
                                         std::int32_t limit, float off_bound, std::int32_t* __restrict to,
                                         std::int32_t* __restrict bad) {
  const auto bound = static_cast<float>(limit / scale);
  for (std::size_t i = 0; i < count; ++i) {
    const float magnitude = x[i] < 0 ? -x[i] : x[i];
    bad[i] |= magnitude <= off_bound ? 0 : 1;  // NaN fails the comparison
  }
  for (std::size_t i = 0; i < count; ++i) {
    // NaN becomes -bound here: converting it to an integer would be undefined.
    const float low = x[i] >= -bound ? x[i] : -bound;
    const float value = low <= bound ? low : bound;
    const double scaled = double{value} * scale;
    to[i] = static_cast<std::int32_t>(scaled + (scaled < 0 ? -0.5 : 0.5));
  }
  for (std::size_t i = 0; i < count; ++i) {
    const std::int32_t high = to[i] > limit ? limit : to[i];  // the last bit of a float may lie beyond
    to[i] = high < -limit ? -limit : high;
  }
}

}  // namespace

// Each value is loaded once, into a block: an engine in another process may write while this reads, and a
// value that changes between its check and its use would be converted unchecked.
void quantise_column(std::span<const float> in, double scale, std::int32_t limit, float off_bound,
                     std::span<std::int32_t> out, std::span<std::int32_t> off) {
  TANDEM_ASSERT(in.size() == out.size() && in.size() == off.size());
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): written before it is read
  std::array<float, kBlock> block;
  for (std::size_t first = 0; first < in.size(); first += kBlock) {
    const std::size_t count = std::min(kBlock, in.size() - first);
    std::memcpy(block.data(), in.data() + first, count * sizeof(float));
    // The compiler must not read the source again instead of the block.
    asm volatile("" : : "r"(block.data()) : "memory");
    quantise_block(block.data(), count, scale, limit, off_bound, out.data() + first, off.data() + first);
  }
}

TANDEM_VECTOR_CLONES SlotNews look_at_slots(const SlotColumns& slots, std::uint32_t count, TypeId type_count,
                                            std::uint8_t* __restrict shown, std::int32_t* __restrict told) {
  // Copies, because the compiler must assume that a store to a byte changes the struct.
  const auto [alive, type, was_alive, had_type, expelled, marks, off] = slots;
  std::uint8_t restless = 0;
  std::uint32_t hidden = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto shows = static_cast<std::uint8_t>((alive[i] != 0) & (off[i] == 0) & (type[i] < type_count));
    shown[i] = shows;
    const auto hides = static_cast<std::uint8_t>((alive[i] != 0) & (shows == 0));
    hidden += hides;
    const auto other =
        static_cast<std::uint8_t>((was_alive[i] != shows) | ((shows != 0) & (type[i] != had_type[i])));
    restless |= static_cast<std::uint8_t>(marks[i] | (expelled[i] ^ hides) | other);
    told[i] = -static_cast<std::int32_t>(shows);
  }
  return {restless != 0, hidden};
}

TANDEM_VECTOR_CLONES bool replace(std::int32_t* __restrict values, const std::int32_t* __restrict told,
                                  std::uint32_t count, std::int32_t* __restrict column) {
  std::int32_t differs = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    values[i] &= told[i];
    differs |= values[i] ^ column[i];
  }
  if (differs != 0) std::memcpy(column, values, count * sizeof *values);
  return differs != 0;
}

}  // namespace tandem::host
