#include <gtest/gtest.h>

#include "sdk/core/predict/predictor.hpp"
#include "sdk/core/tables/predictor_table.hpp"
#include "tests/support/client/fake_server.hpp"

namespace tandem::client {
namespace {

class UncorrectedTest : public ClientTest {
 protected:
  /// Returns the picture once time stands at the last frame applied.
  const Sample& settled() {
    core->start_sampling();
    poll(500 * kMs);
    EXPECT_TRUE(core->sample(sample, SampleMode::kInterpolate, {now_ns, wall_ns()}));
    return sample;
  }
  void expect_drawn(const State& state) {
    const Sample& drawn = settled();
    EXPECT_EQ(drawn.frame, static_cast<double>(core->timeline()->applied()));
    for (Slot slot = 0; slot < state.capacity(); ++slot) {
      for (std::size_t i = 0; i < 3; ++i)
        EXPECT_FLOAT_EQ(drawn.positions[3 * slot + i],
                        static_cast<float>(state.p(i)[slot] * server.session.lattice_unit));
    }
  }
  [[nodiscard]] const State& agreed() const { return core->timeline()->state(core->timeline()->applied()); }
  Sample sample;
};

TEST_F(UncorrectedTest, IsTheStateOfTheMomentMovedOnByScheduledInputsAlone) {
  join();
  for (int i = 0; i < 3; ++i) frame();
  core->show_uncorrected(true);
  const Layout& layout = server.session.streams[0].layout;
  const auto predictor =
      std::move(*make_predictor(layout.predictor, layout.capacity, layout.predictor_constants));
  State expected = agreed();
  for (int i = 0; i < 20; ++i) {
    if (i == 7) port.inputs.push_back(from_server(server.schedule(300)));
    if (i == 9) server.teleport(3);
    frame();
    predictor->step(expected, expected, {core->timeline()->drive(), layout.parameters.step});
  }
  expect_drawn(expected);
  ASSERT_TRUE(core->drift());
  EXPECT_EQ(core->drift()->frames, 20U);
  EXPECT_EQ(core->drift()->bodies, 40U);
  EXPECT_GT(core->drift()->mean, 100);
  EXPECT_GE(core->drift()->most, core->drift()->mean);
  expect_agreed();
}

TEST_F(UncorrectedTest, SwitchedOffTheAgreedStateIsDrawnAgain) {
  join();
  EXPECT_FALSE(core->drift());
  core->show_uncorrected(true);
  for (int i = 0; i < 10; ++i) frame();
  core->show_uncorrected(false);
  EXPECT_FALSE(core->drift());
  frame();
  expect_drawn(agreed());
  expect_agreed();
}

TEST_F(UncorrectedTest, ItsDriftIsTheDistanceToTheAgreedBodies) {
  join();
  core->show_uncorrected(true);
  EXPECT_EQ(core->drift()->mean, 0);
  server.teleport(3);
  frame();
  // The one that was teleported by hundreds of units of a thousand is far off, the others by what a frame
  // brings.
  EXPECT_GT(core->drift()->most, 800'000);
  EXPECT_LT(core->drift()->mean, 2 * core->drift()->most / 40);
}

TEST_F(UncorrectedTest, JoiningAgainBeginsAnew) {
  join();
  core->show_uncorrected(true);
  for (int i = 0; i < 5; ++i) frame();
  static_cast<void>(server.advance());
  frame();  // a gap
  ASSERT_EQ(core->phase(), ClientPhase::kJoining);
  EXPECT_FALSE(core->drift());
  poll(300 * kMs);
  port.snapshots.push_back(from_server(server.snapshot()));
  poll();
  ASSERT_EQ(core->phase(), ClientPhase::kPlaying);
  EXPECT_EQ(core->drift()->frames, 0U);
  EXPECT_EQ(core->drift()->mean, 0);
  expect_drawn(agreed());
}

TEST_F(UncorrectedTest, WantedBeforeTheFirstSnapshotItBeginsThere) {
  start();
  core->show_uncorrected(true);
  EXPECT_FALSE(core->drift());
  join();
  ASSERT_TRUE(core->drift());
  frame();
  EXPECT_EQ(core->drift()->frames, 1U);
  // After the server was started anew nothing of it is left.
  server = FakeServer(2000);
  port.sessions.push_back(from_server(server.session));
  poll();
  EXPECT_FALSE(core->drift());
}

}  // namespace
}  // namespace tandem::client
