// What a host tells a monitor besides its totals.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "sdk/core/predict/contact/constants.hpp"
#include "services/host/outgoing/publisher.hpp"
#include "services/host/streams/position_error.hpp"
#include "tests/unit/host/fakes.hpp"

namespace tandem::host {
namespace {

using transport::Reason;

TEST(Moment, OfAHostWithClients) {
  Bench bench{test_config()};
  bench.poll();
  bench.enter(1);
  bench.enter(2, transport::Role::kObserver);
  bench.on_ms = [&bench] { bench.playing(1, bench.host->frame()); };
  bench.run_ms(500);
  const HostMoment moment = bench.host->present();
  ASSERT_EQ(moment.streams.size(), 1U);
  EXPECT_EQ(moment.bodies, bench.host->agreed().alive_count());
  EXPECT_GT(moment.dds_participants, 0U);
  EXPECT_EQ(moment.window, bench.host->window());
  EXPECT_GT(moment.streams[0].threshold_m, 0);
  EXPECT_GE(moment.streams[0].longest_lag, 10U) << "the observer says nothing any more";
  EXPECT_LE(moment.streams[0].error_rms_m, moment.streams[0].error_largest_m);
  EXPECT_EQ(moment.streams[0].joining, 0U);
  bench.joining(3);
  bench.poll();
  EXPECT_EQ(bench.host->present().streams[0].joining, 1U);
}

// Cells are as wide as the largest body, and `hard` seeks pairs of 16 bodies of a cell.
TEST(Moment, BodiesThatOneLargeBodyCrowdsAreCountedAndToldOnce) {
  constexpr std::uint32_t kBodies = 100;
  HostConfig config = test_config();
  config.types.push_back({.name = "planet", .radius = 10});
  Layout& layout = config.streams[0].layout;
  layout.type_count = static_cast<TypeId>(config.types.size());
  layout.codec = "tracker";
  layout.predictor = "hard";
  ContactConstants constants;
  constants.types = {{1000, 65536}, {ContactConstants::kMaxRadius / 4, 65536}};
  layout.predictor_constants = write_contact_constants(constants);
  layout.parameters.step.contacts.listed = true;
  Bench bench(std::move(config), kBodies);
  const auto move = [&simulation = bench.simulation](std::uint64_t step) {
    for (std::uint32_t i = 0; i < kBodies; ++i) {
      simulation.position[0][i] = 0.1F * static_cast<float>(i % 10) + 0.01F * static_cast<float>(step);
      simulation.position[1][i] = 0.1F * static_cast<float>(i / 10);
    }
  };
  bench.simulation.on_step = move;
  bench.poll();
  bench.enter(1);
  bench.on_ms = [&bench] { bench.playing(1, bench.host->frame()); };
  bench.run_ms(500);
  const auto told = [&bench] {
    const auto lines = bench.host->take_notices();
    return std::ranges::count_if(lines, [](const std::string& line) {
      return line.find("'planet'") != std::string::npos && line.find("'ballistic'") != std::string::npos;
    });
  };
  EXPECT_GT(bench.host->present().streams[0].crowded, kBodies / 2);
  EXPECT_EQ(told(), 1);
  bench.run_ms(1000);
  EXPECT_EQ(told(), 0);
}

TEST(Moment, DemotionsOfTheSameClientAreRepeated) {
  HostConfig config = test_config();
  config.window = 2;
  Bench bench{std::move(config)};
  bench.poll();
  bool awake = true;
  bench.on_ms = [&] {
    bench.playing(1, bench.host->frame());
    if (awake) bench.playing(2, bench.host->frame());
  };
  bench.enter(1);
  bench.enter(2);
  for (std::uint64_t times = 1; times <= 3; ++times) {
    awake = false;
    bench.run_ms(1000);
    EXPECT_EQ(bench.host->totals().demotions, times);
    EXPECT_EQ(bench.host->totals().repeated_demotions, times - 1);
    awake = true;
    bench.run_ms(11'000);
  }
  bench.run_ms(300'000);
  awake = false;
  bench.run_ms(1000);
  EXPECT_EQ(bench.host->totals().demotions, 4U);
  EXPECT_EQ(bench.host->totals().repeated_demotions, 2U) << "more than five minutes later";
}

TEST(Moment, RefusalsHaveTheirReason) {
  Bench bench{test_config()};
  bench.poll();
  auto ack = bench.ack(1, transport::Phase::kPlaying, 5);
  ack.epoch += 1;
  bench.send(ack);
  bench.send(bench.gravity(7, 1));
  bench.run_ms(20);
  const HostTotals totals = bench.host->totals();
  EXPECT_EQ(totals.messages_refused.by_reason[static_cast<std::size_t>(Reason::kStaleEpoch)], 1U);
  EXPECT_EQ(totals.inputs_refused.by_reason[static_cast<std::size_t>(Reason::kNotPlaying)], 1U);
  EXPECT_EQ(totals.refused_inputs, totals.inputs_refused.total());
  EXPECT_EQ(totals.refused_messages, totals.messages_refused.total());
}

TEST(PositionErrorOf, BodiesIsTheirDistance) {
  State target(3, {}), agreed(3, {});
  for (Slot slot = 0; slot < 3; ++slot) {
    target.spawn(slot, 0, 0, {.p = {0, 0, 0}});
    agreed.spawn(slot, 0, 0, {.p = {0, 0, 0}});
  }
  agreed.p(0)[1] = 3;
  agreed.p(2)[1] = -4;
  const PositionError error = position_error(target, agreed, 0);
  EXPECT_DOUBLE_EQ(error.largest, 5);
  EXPECT_DOUBLE_EQ(error.rms, 5 / std::sqrt(3));
}

TEST(PositionErrorOf, ManyBodiesIsOfOtherOnesEachFrame) {
  const Slot bodies = 3 * kMaxCompared;
  State target(bodies, {}), agreed(bodies, {});
  for (Slot slot = 0; slot < bodies; ++slot) {
    target.spawn(slot, 0, 0, {.p = {0, 0, 0}});
    agreed.spawn(slot, 0, 0, {.p = {static_cast<std::int32_t>(slot % 3), 0, 0}});
  }
  for (Frame frame = 0; frame < 6; ++frame)
    EXPECT_DOUBLE_EQ(position_error(target, agreed, frame).largest, static_cast<double>(frame % 3)) << frame;
}

TEST(PublisherDurations, CountEachFrameOnce) {
  Outbox outbox({});
  FakePort port(participant(1));
  Publisher publisher(outbox, port);
  for (Frame frame = 1; frame <= 3; ++frame) {
    ASSERT_TRUE(outbox.push(transport::DeltaMessage{}));
    ASSERT_TRUE(outbox.push(transport::DeltaMessage{}));
    ASSERT_TRUE(outbox.push(EndOfFrame{}));
  }
  publisher.flush();
  publisher.stop();
  EXPECT_EQ(publisher.durations().total(), 3U);
  EXPECT_GT(publisher.durations().sum_ns, 0);
}

}  // namespace
}  // namespace tandem::host
