// The tracker on states that are chosen to hurt it.

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "sdk/core/codec/paper/residual.hpp"
#include "tests/property/synthetic.hpp"

namespace tandem {
namespace {

using synthetic::Random;
using Bytes = std::vector<std::byte>;

enum class Mood { kStill, kAllAtOnce, kFarJumps, kSaturated, kCoincident, kOneCell, kBackAndForth, kFew };

State target_of(Random& random, const State& state, Mood mood, std::int32_t threshold, int frame) {
  if (mood == Mood::kFew) return synthetic::random_target(random, state, 20);
  State target = state;
  const BodyState meeting_point = synthetic::random_body(random);
  for (Slot slot = 0; slot < state.capacity(); ++slot) {
    if (state.alive()[slot] == 0) continue;
    BodyState body = state.body(slot);
    for (std::int32_t& p : body.p) {
      const auto moved = [&p](std::int64_t by) {
        return static_cast<std::int32_t>(
            std::clamp<std::int64_t>(p + by, -std::int64_t{kPositionLimit}, kPositionLimit));
      };
      const std::int32_t nearby = random.even(4 * threshold);
      if (mood == Mood::kAllAtOnce) p = moved(nearby);
      if (mood == Mood::kFarJumps) p = random.even(kPositionLimit);
      if (mood == Mood::kSaturated) p = random.one_in(2) ? kPositionLimit : -kPositionLimit;
      if (mood == Mood::kBackAndForth) p = moved((frame % 2 == 0 ? 2 : -2) * std::int64_t{threshold});
    }
    if (mood == Mood::kCoincident) body.p = meeting_point.p;
    if (mood == Mood::kOneCell) {
      for (std::int32_t& p : body.p) p = static_cast<std::int32_t>(random.below(64));
    }
    target.set_body(slot, body);
  }
  return target;
}

bool is_rounded(const State& state, const Rounding& rounding) {
  const auto is_multiple = [](std::span<const std::int32_t> column, unsigned bits) {
    return std::ranges::all_of(column, [bits](std::int32_t x) { return (x >> bits) << bits == x; });
  };
  for (std::size_t i = 0; i < kPositionChannels; ++i) {
    if (!is_multiple(state.p(i), rounding.p) || !is_multiple(state.v(i), rounding.v) ||
        !is_multiple(state.c(i), rounding.c))
      return false;
  }
  return true;
}

Bytes saved(const DeltaCodec& codec) { return synthetic::coder_state(codec.codec()); }

// Rounded or not, no body is further off than the threshold.
// Also that a decoder which loads the coder state in mid-stream goes on like one that was there from the
// start.
RC_GTEST_PROP(Tracker, FollowsStatesThatAreChosenToHurtIt, ()) {
  const auto capacity = *rc::gen::inRange(1U, 300U);
  // Below 3 a step is one unit, and a jump across the whole lattice takes one step more than a delta holds.
  const auto threshold = *rc::gen::element<std::int32_t>(3, 4, 200, 4096, 1 << 20);
  const auto moods = *rc::gen::container<std::vector<int>>(8, rc::gen::inRange(0, 8));
  const auto joins_at = *rc::gen::inRange(1, 8);
  const auto seed = *rc::gen::arbitrary<std::uint64_t>();
  Random random(seed);
  Random roundings(~seed);
  StreamParameters parameters{{threshold, 1, 1}};
  DeltaCodec server = synthetic::make_delta("tracker", capacity, parameters);
  DeltaCodec client = synthetic::make_delta("tracker", capacity, parameters);
  DeltaCodec late = synthetic::make_delta("tracker", capacity, parameters);
  Bytes out(server.bound());
  State agreed = synthetic::random_state(random, capacity);
  State held = agreed;
  State joined = agreed;
  for (int frame = 0; frame < static_cast<int>(moods.size()); ++frame) {
    if (frame == joins_at) {
      RC_ASSERT(synthetic::load_coder_state(late.codec(), saved(client), held.alive()).has_value());
      late.restore_parameters(client.parameters());
      joined = held;
    }
    const auto mood = static_cast<Mood>(moods[static_cast<std::size_t>(frame)]);
    const State target = target_of(random, agreed, mood, threshold, frame);
    if (random.one_in(3)) {
      parameters.codec.velocity_gain = static_cast<std::uint16_t>(random.below(65536));
      parameters.codec.acceleration_gain = static_cast<std::uint16_t>(random.below(65536));
      server.set_parameters(parameters);
    }
    const bool rounds = roundings.one_in(3);
    if (rounds) server.round_next();
    const std::size_t budget = random.one_in(3) ? random.below(4 * capacity + 20) : kNoBudget;
    const auto encoded = server.encode(agreed, target, {}, budget, out);
    RC_ASSERT(encoded.correction_bytes <= budget);
    if (mood == Mood::kStill) RC_ASSERT(encoded.corrected == 0U);
    if (budget == kNoBudget) {
      const auto limit = static_cast<std::uint64_t>(threshold) + 1;
      for (Slot slot = 0; slot < capacity; ++slot) {
        RC_ASSERT(agreed.alive()[slot] == 0 || error_squared(agreed, target, slot) <= limit * limit);
      }
    }
    if (rounds) RC_ASSERT(is_rounded(agreed, rounding_for(threshold)));
    const auto payload = std::span(out).first(encoded.size_bytes);
    RC_ASSERT(synthetic::receive(client, held, payload).has_value());
    RC_ASSERT(held == agreed);
    RC_ASSERT(synthetic::broken_invariant(held) == nullptr);
    RC_ASSERT(saved(client) == saved(server));
    if (frame < joins_at) continue;
    RC_ASSERT(synthetic::receive(late, joined, payload).has_value());
    RC_ASSERT(joined == agreed);
    RC_ASSERT(saved(late) == saved(server));
  }
}

}  // namespace
}  // namespace tandem
