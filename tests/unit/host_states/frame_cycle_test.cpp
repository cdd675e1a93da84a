// Tests in which order a source's frames are begun, taken over and made.
#include <gtest/gtest.h>

#include <array>
#include <optional>

#include "services/host/frames/frame_cycle.hpp"

namespace tandem::host {
namespace {

using enum FrameCycle::Stage;
using Event = FrameCycle::Event;

constexpr std::array kStages{kIdle, kStepping, kSteppingAlone, kTaken, kTakenAlone, kTakenEarly, kEnded};

TEST(FrameCycle, AllowsTheseTransitionsAndNoOthers) {
  struct Row {
    FrameCycle::Stage from;
    std::optional<FrameCycle::Stage> begin, rest, take, make, end;
  };
  constexpr auto kNever = std::nullopt;
  constexpr std::array<Row, kStages.size()> kRows{{
      {kIdle, kStepping, kIdle, kNever, kNever, kNever},
      {kStepping, kNever, kSteppingAlone, kTaken, kNever, kEnded},
      {kSteppingAlone, kNever, kSteppingAlone, kTakenAlone, kNever, kEnded},
      {kTaken, kTakenEarly, kNever, kNever, kIdle, kNever},
      {kTakenAlone, kNever, kNever, kNever, kIdle, kNever},
      {kTakenEarly, kNever, kNever, kNever, kStepping, kNever},
      {kEnded, kNever, kEnded, kNever, kNever, kNever},
  }};
  for (const Row& row : kRows) {
    SCOPED_TRACE(static_cast<int>(row.from));
    EXPECT_EQ(FrameCycle::after(row.from, Event::kBegin), row.begin);
    EXPECT_EQ(FrameCycle::after(row.from, Event::kRest), row.rest);
    EXPECT_EQ(FrameCycle::after(row.from, Event::kTake), row.take);
    EXPECT_EQ(FrameCycle::after(row.from, Event::kMake), row.make);
    EXPECT_EQ(FrameCycle::after(row.from, Event::kEnd), row.end);
  }
}

struct Told {
  FrameCycle::Stage stage;
  Frame frame, next_frame;
  bool stepping, taken, may_begin_early;
  friend bool operator==(const Told&, const Told&) = default;
};

Told told(const FrameCycle& cycle) {
  return {cycle.stage(),    cycle.frame(), cycle.next_frame(),
          cycle.stepping(), cycle.taken(), cycle.may_begin_early()};
}

TEST(FrameCycle, StepsThatOverlapGoOnAheadOfTheFramesThatAreMade) {
  FrameCycle cycle(10, true);
  EXPECT_EQ(told(cycle), (Told{kIdle, 10, 11, false, false, false}));
  cycle.begin();
  EXPECT_EQ(told(cycle), (Told{kStepping, 10, 12, true, false, false}));
  cycle.take();
  EXPECT_EQ(told(cycle), (Told{kTaken, 10, 12, false, true, true}));
  cycle.begin();
  EXPECT_EQ(told(cycle), (Told{kTakenEarly, 10, 13, true, true, false}));
  cycle.make();
  EXPECT_EQ(told(cycle), (Told{kStepping, 11, 13, true, false, false}));
  cycle.take();
  cycle.make();
  EXPECT_EQ(told(cycle), (Told{kIdle, 12, 13, false, false, false}));
}

TEST(FrameCycle, StepsThatDoNotOverlapFollowTheFrames) {
  FrameCycle cycle(0, false);
  cycle.begin();
  EXPECT_EQ(told(cycle), (Told{kSteppingAlone, 0, 2, true, false, false}));
  cycle.take();
  EXPECT_EQ(told(cycle), (Told{kTakenAlone, 0, 2, false, true, false}));
  cycle.make();
  EXPECT_EQ(told(cycle), (Told{kIdle, 1, 2, false, false, false}));
}

TEST(FrameCycle, ARestHoldsForOneFrame) {
  FrameCycle cycle(0, true);
  cycle.rest();
  cycle.begin();
  cycle.take();
  EXPECT_TRUE(cycle.may_begin_early()) << "nothing was under way that a rest could follow";
  cycle.begin();
  cycle.make();
  cycle.rest();
  cycle.take();
  EXPECT_FALSE(cycle.may_begin_early());
  cycle.make();
  EXPECT_EQ(cycle.stage(), kIdle);
  cycle.begin();
  cycle.take();
  EXPECT_TRUE(cycle.may_begin_early()) << "steps overlap again";
}

TEST(FrameCycle, AnEndLeavesTheLastFrame) {
  FrameCycle cycle(5, true);
  cycle.begin();
  cycle.end();
  EXPECT_EQ(told(cycle), (Told{kEnded, 5, 6, false, false, false}));
  cycle.rest();
  EXPECT_EQ(cycle.stage(), kEnded);
}

}  // namespace
}  // namespace tandem::host
