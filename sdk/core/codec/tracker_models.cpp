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

// 0: below -limit, 1: between, 2: above.
std::uint32_t side(std::int32_t value, std::int32_t limit) {
  return value < -limit ? 0U : (value > limit ? 2U : 1U);
}

std::uint32_t bucket(std::uint32_t count, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  return static_cast<std::uint32_t>(count > a) + static_cast<std::uint32_t>(count > b) +
         static_cast<std::uint32_t>(count > c);
}

}  // namespace

const std::array<std::uint8_t, 256> kTrackerAgeBuckets = make_age_buckets();

TrackerContext value_context(const TrackerBody& body, const Vec3i& v, const Vec3i& c,
                             std::int32_t threshold) {
  TrackerContext context;
  const std::uint32_t k = body.age + 1U;
  const std::uint32_t short_age = bucket(k, 2, 4, 8) + static_cast<std::uint32_t>(k > 20);
  context.zero = short_age * TrackerModels::kIntervals + bucket(body.interval, 2, 6, 20);
  context.magnitude = bucket(k, 1, 4, 20);
  const std::uint32_t sign_age = bucket(k, 2, 6, 20);
  // Below 1/51 of the threshold a frame, and 1/2048 of it a frame squared, a sign says nothing.
  const std::int32_t slow = threshold + threshold / 4;
  const std::int32_t faint = threshold / 32;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::uint32_t last = side(body.steps[axis], 0);
    context.moved_last[axis] = static_cast<std::uint32_t>(body.steps[axis] != 0);
    const std::uint32_t seen = (last * 3 + side(c[axis], faint)) * 3 + side(v[axis], slow);
    context.sign[axis] =
        (static_cast<std::uint32_t>(axis) * 27 + seen) * TrackerModels::kIntervals + sign_age;
  }
  return context;
}

}  // namespace tandem
