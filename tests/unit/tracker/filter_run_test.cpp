// The vector filter must give what its scalar twin gives: state hashes depend on it.
#include "sdk/core/codec/tracker/filter_run.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "sdk/core/codec/tracker/models.hpp"
#include "tests/property/synthetic.hpp"

namespace tandem {
namespace {

using synthetic::Random;
constexpr std::uint32_t kSlots = FilterRun::kSlots;
constexpr std::uint8_t kYoungest = 0xFF;

// What the codec remembers, one entry a slot.
struct Memory {
  std::vector<std::uint8_t> age, interval, history;
  std::array<std::vector<std::int8_t>, 3> steps;

  explicit Memory(Random& random) : age(kSlots), interval(kSlots), history(kSlots) {
    for (auto& column : steps) column.resize(kSlots);
    for (std::uint32_t s = 0; s < kSlots; ++s) {
      age[s] = static_cast<std::uint8_t>(random.below(kMaxAge));
      interval[s] = static_cast<std::uint8_t>(random.below(256));
      for (auto& column : steps) column[s] = static_cast<std::int8_t>(random.value(127));
      history[s] = flag_history(body(s));
    }
  }
  [[nodiscard]] TrackerBody body(std::uint32_t s) const {
    return {age[s], interval[s], {steps[0][s], steps[1][s], steps[2][s]}};
  }
  void set(std::uint32_t s, const TrackerBody& body) {
    age[s] = kYoungest;
    interval[s] = static_cast<std::uint8_t>(body.interval);
    for (std::size_t i = 0; i < 3; ++i) steps[i][s] = static_cast<std::int8_t>(body.steps[i]);
    history[s] = flag_history(body);
  }
  [[nodiscard]] FilterColumns columns() {
    return {age.data(), interval.data(), {steps[0].data(), steps[1].data(), steps[2].data()}, history.data()};
  }
  bool operator==(const Memory&) const = default;
};

State random_state(Random& random) {
  State state(kSlots);
  for (Slot slot = 0; slot < kSlots; ++slot) {
    for (std::size_t i = 0; i < 3; ++i) {
      state.p(i)[slot] = random.value(kPositionLimit);
      state.v(i)[slot] = random.value(kVelocityLimit);
      state.c(i)[slot] = random.value(kVelocityLimit);
    }
    state.rest()[slot] = static_cast<std::uint8_t>(random.below(2));
  }
  return state;
}

TEST(TrackerFilterRun, GivesWhatOneBodyAfterTheOtherGets) {
  Random random(11);
  for (int round = 0; round < 60; ++round) {
    CodecParameters parameters;
    parameters.threshold = 1 + static_cast<std::int32_t>(random.below(17000));
    TrackerGains gains(TrackerKind{});
    gains.set(static_cast<std::uint16_t>(random.below(65536)),
              static_cast<std::uint16_t>(random.below(65536)));
    const TrackerFilter filter(parameters, {random.value(9999), random.value(9999), random.value(9999)},
                               static_cast<unsigned>(random.below(6)), gains);
    const FilterRun run(filter, gains);
    ASSERT_TRUE(run.fits());
    State one_by_one = random_state(random);
    State together = one_by_one;
    Memory expected(random);
    Memory memory = expected;
    std::vector<Slot> slots;
    std::vector<TrackerCorrection> corrections;
    for (Slot slot = 0; slot < kSlots; ++slot) {
      if (!random.one_in(2)) continue;
      TrackerCorrection correction;
      for (std::int32_t& steps : correction.steps) steps = random.value(70);
      if (!is_some(correction.steps)) correction.steps[1] = -1;
      correction.rest = random.one_in(5);
      slots.push_back(slot);
      corrections.push_back(correction);
      if (!FilterRun::fits(correction)) continue;
      TrackerBody body = expected.body(slot);
      filter.move(one_by_one, slot, correction, body);
      filter.settle(one_by_one, slot, correction.rest);
      expected.set(slot, body);
    }
    run.apply(slots, corrections.data(), 0, kSlots, memory.columns(), kYoungest, together);
    ASSERT_EQ(together, one_by_one) << round;
    ASSERT_EQ(memory, expected) << round;
  }
}

TEST(TrackerFilterRun, LeavesWhatDoesNotFit32Bits) {
  CodecParameters parameters;
  parameters.threshold = 1 << 20;
  const TrackerGains gains(TrackerKind{});
  EXPECT_FALSE(FilterRun(TrackerFilter(parameters, {}, 0, gains), gains).fits());
  EXPECT_TRUE(FilterRun::fits({{63, -63, 0}}));
  EXPECT_FALSE(FilterRun::fits({{0, -64, 0}}));
}

}  // namespace
}  // namespace tandem
