#include "sdk/core/codec/tracker_models.hpp"

namespace tandem {
namespace {

// Fifteen runs of counts, each about as wide as a third of its start: what the hazard of a correction needs.
constexpr std::array<std::uint8_t, 256> make_age_buckets() {
  constexpr std::array<std::uint32_t, 14> kLast{0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 40, 64, 128, 250};
  std::array<std::uint8_t, 256> buckets{};
  for (std::uint32_t count = 0; count < 256; ++count) {
    while (buckets[count] < kLast.size() && count > kLast[buckets[count]]) ++buckets[count];
  }
  return buckets;
}

}  // namespace

const std::array<std::uint8_t, 256> tracker_age_buckets = make_age_buckets();

}  // namespace tandem
