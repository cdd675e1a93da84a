#include "sdk/core/codec/tracker_models.hpp"

#include <algorithm>
#include <cmath>

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

TrackerModels::TrackerModels() {
  std::fill(p1.begin(), p1.begin() + TrackerModelIndex::kZero, kRare);
  std::fill(p1.begin() + TrackerModelIndex::kZero, p1.end(), std::uint16_t{32768});
  p1[TrackerModelIndex::kDead] = 0;
}

void TrackerModels::learn(const TrackerCounts& counts) {
  for (std::size_t i = 0; i < TrackerModelIndex::kCount; ++i) {
    const std::uint32_t ones = counts[i][1];
    const std::uint32_t seen = counts[i][0] + ones;
    if (seen == 0) continue;
    const std::uint32_t before = weight[i] + 1U;
    const std::uint64_t sum = std::uint64_t{before} * p1[i] + (std::uint64_t{ones} << 16U);
    // Two divisions, because the short one takes a third of the time and nearly always does.
    const std::uint64_t mean =
        sum >> 32U == 0 ? static_cast<std::uint32_t>(sum) / (before + seen) : sum / (before + seen);
    p1[i] = static_cast<std::uint16_t>(std::clamp<std::uint64_t>(mean, kLeast, kMost));
    weight[i] = static_cast<std::uint8_t>(std::min(before - 1 + seen, 255U));
  }
}

void TrackerModels::account(const TrackerCounts& counts, CodeAccount& account) const {
  account.decisions.resize(TrackerModelIndex::kDead);
  for (std::size_t i = 0; i < TrackerModelIndex::kDead; ++i) {
    const double p = p1[i] / 65536.0;
    account.ideal_bits -= counts[i][0] * std::log2(1 - p) + counts[i][1] * std::log2(p);
    for (std::size_t bit = 0; bit < 2; ++bit) account.decisions[i][bit] += counts[i][bit];
  }
}

}  // namespace tandem
