#include "services/host/stream.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "tests/property/synthetic.hpp"
#include "tests/unit/host/fakes.hpp"

namespace tandem::host {
namespace {

/// Bodies that drift, jump now and then, and come and go.
void disturb(FakeSimulation& simulation, std::uint64_t step) {
  for (std::size_t body = 0; body < simulation.alive.size(); ++body) {
    simulation.position[1][body] += 0.05F * static_cast<float>((step + body) % 7) - 0.15F;
  }
  if (step % 11 == 0) simulation.alive[3] ^= 1U;
}

StreamStart start_of(const FakeSimulation& simulation, const HostConfig& config) {
  return {.bodies = simulation.bodies(),
          .drive = to_drive(config.stream.lattice, simulation.gravity(), 0).value(),
          .epoch = config.epoch,
          .frame_rate_hz = config.frame_rate_hz};
}

TEST(Stream, ProducesWhatAHostPublishes) {
  HostConfig config = test_config();
  config.stream.layout.codec = "tracker";
  config.stream.gains = GainGoal{};
  config.stream.quality = QualityGoal{0.004, 64, 1 << 20};
  Bench bench(config);
  bench.simulation.on_step = [&](std::uint64_t step) { disturb(bench.simulation, step); };
  bench.run_to(200);

  FakeSimulation simulation(4);
  Stream stream = Stream::create(config.stream, start_of(simulation, config)).value();
  ASSERT_EQ(bench.port.deltas.size(), 200U);
  for (const transport::DeltaMessage& published : bench.port.deltas) {
    simulation.step();
    disturb(simulation, simulation.steps);
    const Stream::FrameResult frame = stream.produce(simulation.bodies(), simulation.events());
    ASSERT_EQ(frame.frame, published.frame);
    ASSERT_EQ(frame.hash, published.hash);
    ASSERT_TRUE(std::ranges::equal(frame.payload, published.payload)) << "frame " << frame.frame;
  }
  EXPECT_EQ(stream.parameters(), bench.host->parameters());
  EXPECT_NE(stream.parameters(), config.stream.layout.parameters) << "something was chosen";
  EXPECT_EQ(stream.bodies(), stream.agreed().alive_count());
}

TEST(Stream, RoundsOnlyWhereCorrectionsKeepIt) {
  for (const std::string_view codec : codec_names()) {
    SCOPED_TRACE(codec);
    HostConfig config = test_config();
    config.stream.layout.codec = codec;
    config.stream.layout.codec_tables = synthetic::tables_for(codec);
    FakeSimulation simulation(4);
    for (auto& column : simulation.position) std::iota(column.begin(), column.end(), 0.12345F);
    Stream stream = Stream::create(config.stream, start_of(simulation, config)).value();
    const State before = stream.agreed();
    stream.round_next();
    stream.produce(simulation.bodies(), {});
    EXPECT_EQ(stream.agreed() == before, codec != "tracker");
  }
}

TEST(Stream, CanBeMovedWhileItsParametersAreChosen) {
  HostConfig config = test_config();
  config.stream.layout.codec = "quantized";
  config.stream.quality = QualityGoal{0.004, 64, 1 << 20};
  FakeSimulation simulation(4);
  Stream first = Stream::create(config.stream, start_of(simulation, config)).value();
  Stream second = std::move(first);
  for (int frame = 0; frame < 60; ++frame) {
    simulation.step();
    disturb(simulation, simulation.steps);
    second.produce(simulation.bodies(), simulation.events());
  }
  EXPECT_NE(second.parameters(), config.stream.layout.parameters);
  EXPECT_FALSE(second.set_parameters(config.stream.layout.parameters)) << "nobody else decides then";
}

TEST(Stream, CountsWhatItCorrectsForTraining) {
  const HostConfig config = test_config();
  FakeSimulation simulation(4);
  Stream stream = Stream::create(config.stream, start_of(simulation, config)).value();
  ResidualStatistics statistics;
  std::uint64_t corrected = 0;
  for (int frame = 0; frame < 20; ++frame) {
    for (float& y : simulation.position[1]) y += 0.1F * static_cast<float>(frame);
    corrected += stream.produce(simulation.bodies(), {}, &statistics).corrected;
  }
  EXPECT_GT(corrected, 0U);
  EXPECT_EQ(statistics.bodies, corrected);
}

TEST(Stream, ShowsHowBodiesTurn) {
  const HostConfig config = turning_config();
  FakeSimulation simulation(4);
  simulation.turn();
  auto created = Stream::create(config.stream, start_of(simulation, config));
  ASSERT_TRUE(created) << created.error().message;
  for (int frame = 1; frame <= 30; ++frame) {
    const float half = 0.05F * static_cast<float>(frame);
    simulation.orientation[2][1] = std::sin(half);
    simulation.orientation[3][1] = std::cos(half);
    simulation.angular_velocity[2][1] = 3;
    created->produce(simulation.bodies(), {});
  }
  const Quaternion turned = created->agreed().quaternion(1);
  const double reached = config.stream.layout.parameters.codec.threshold / 1000.0;
  EXPECT_NEAR(2 * std::atan2(turned[2], turned[3]), 3.0, reached);
  EXPECT_EQ(created->agreed().quaternion(0), kNoTurn);
}

TEST(Stream, RefusesOrientationsThatTheBodiesDoNotHave) {
  const HostConfig config = turning_config();
  FakeSimulation simulation(4);
  const auto refused = [&] {
    const auto stream = Stream::create(config.stream, start_of(simulation, config));
    return stream ? std::string() : stream.error().message;
  };
  EXPECT_NE(refused().find("orientations"), std::string::npos) << refused();
  simulation.turn();
  EXPECT_EQ(refused(), "");
  simulation.orientation[3].pop_back();
  EXPECT_NE(refused().find("body columns"), std::string::npos) << refused();
  simulation.turn();
  simulation.angular_velocity[0].clear();
  EXPECT_NE(refused().find("body columns"), std::string::npos) << refused();
}

TEST(Stream, RefusesBodiesThatAreNotOfItsCapacity) {
  HostConfig config = test_config();
  config.stream.layout.capacity = 5;
  const FakeSimulation simulation(4);
  const auto stream = Stream::create(config.stream, start_of(simulation, config));
  ASSERT_FALSE(stream);
  EXPECT_EQ(stream.error().code, ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace tandem::host
