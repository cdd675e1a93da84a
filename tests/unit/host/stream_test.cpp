#include "services/host/streams/stream.hpp"
#include "sdk/core/predict/contact/constants.hpp"
#include "sdk/core/tables/codec_table.hpp"

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

/// A stream and the mirror that it follows.
struct Show {
  Mirror mirror;
  Stream stream;

  static Result<Show> create(const HostConfig& config, const FakeSimulation& simulation) {
    auto mirror = make_mirror(config.streams, simulation.bodies());
    if (!mirror) return tl::unexpected(mirror.error());
    auto stream = Stream::create(
        config.streams[0], {.mirror = *mirror,
                            .drive = to_drive(config.streams[0].lattice, simulation.gravity(), 0).value(),
                            .epoch = config.epoch,
                            .frame_rate_hz = config.frame_rate_hz});
    if (!stream) return tl::unexpected(stream.error());
    return Show{std::move(*mirror), std::move(*stream)};
  }
  Stream::FrameResult produce(const FakeSimulation& simulation, EncodeObserver* observer = nullptr) {
    mirror.update(simulation.bodies(), simulation.events());
    return stream.produce(mirror, observer);
  }
};

TEST(Stream, ProducesWhatAHostPublishes) {
  HostConfig config = test_config();
  config.streams[0].layout.codec = "tracker";
  config.streams[0].gains = GainGoal{};
  config.streams[0].quality = QualityGoal{0.004, 64, 1 << 20};
  Bench bench(config);
  bench.simulation.on_step = [&](std::uint64_t step) { disturb(bench.simulation, step); };
  bench.run_to(200);

  FakeSimulation simulation(4);
  Show show = Show::create(config, simulation).value();
  Stream& stream = show.stream;
  ASSERT_EQ(bench.port.deltas.size(), 200U);
  for (const transport::DeltaMessage& published : bench.port.deltas) {
    simulation.step();
    disturb(simulation, simulation.steps);
    const Stream::FrameResult frame = show.produce(simulation);
    ASSERT_EQ(frame.frame, published.frame);
    ASSERT_EQ(frame.hash, published.hash);
    ASSERT_TRUE(std::ranges::equal(frame.payload, published.payload)) << "frame " << frame.frame;
  }
  EXPECT_EQ(stream.parameters(), bench.host->parameters());
  EXPECT_NE(stream.parameters(), config.streams[0].layout.parameters) << "something was chosen";
  EXPECT_EQ(stream.bodies(), stream.agreed().alive_count());
}

TEST(Stream, RoundsOnlyWhereCorrectionsKeepIt) {
  for (const std::string_view codec : codec_names()) {
    SCOPED_TRACE(codec);
    HostConfig config = test_config();
    config.streams[0].layout.codec = codec;
    config.streams[0].layout.codec_tables = synthetic::tables_for(codec);
    FakeSimulation simulation(4);
    for (auto& column : simulation.position) std::iota(column.begin(), column.end(), 0.12345F);
    Show show = Show::create(config, simulation).value();
    Stream& stream = show.stream;
    const State before = stream.agreed();
    stream.round_next();
    show.produce(simulation);
    EXPECT_EQ(stream.agreed() == before, codec != "tracker");
  }
}

TEST(Stream, CanBeMovedWhileItsParametersAreChosen) {
  HostConfig config = test_config();
  config.streams[0].layout.codec = "quantized";
  config.streams[0].quality = QualityGoal{0.004, 64, 1 << 20};
  FakeSimulation simulation(4);
  Show first = Show::create(config, simulation).value();
  Show second = std::move(first);
  for (int frame = 0; frame < 60; ++frame) {
    simulation.step();
    disturb(simulation, simulation.steps);
    second.produce(simulation);
  }
  EXPECT_NE(second.stream.parameters(), config.streams[0].layout.parameters);
  EXPECT_FALSE(second.stream.set_parameters(config.streams[0].layout.parameters))
      << "nobody else decides then";
}

TEST(Stream, CountsWhatItCorrectsForTraining) {
  const HostConfig config = test_config();
  FakeSimulation simulation(4);
  Show show = Show::create(config, simulation).value();
  ResidualStatistics statistics;
  std::uint64_t corrected = 0;
  for (int frame = 0; frame < 20; ++frame) {
    for (float& y : simulation.position[1]) y += 0.1F * static_cast<float>(frame);
    corrected += show.produce(simulation, &statistics).corrected;
  }
  EXPECT_GT(corrected, 0U);
  EXPECT_EQ(statistics.bodies, corrected);
}

TEST(Stream, ShowsHowBodiesTurn) {
  const HostConfig config = turning_config();
  FakeSimulation simulation(4);
  simulation.turn();
  auto created = Show::create(config, simulation);
  ASSERT_TRUE(created) << created.error().message;
  for (int frame = 1; frame <= 30; ++frame) {
    const float half = 0.05F * static_cast<float>(frame);
    simulation.orientation[2][1] = std::sin(half);
    simulation.orientation[3][1] = std::cos(half);
    simulation.angular_velocity[2][1] = 3;
    created->produce(simulation);
  }
  const Quaternion turned = created->stream.agreed().quaternion(1);
  const double reached = config.streams[0].layout.parameters.codec.threshold / 1000.0;
  EXPECT_NEAR(2 * std::atan2(turned[2], turned[3]), 3.0, reached);
  EXPECT_EQ(created->stream.agreed().quaternion(0), kNoTurn);
}

TEST(Stream, RefusesOrientationsThatTheBodiesDoNotHave) {
  const HostConfig config = turning_config();
  FakeSimulation simulation(4);
  const auto refused = [&] {
    const auto stream = Show::create(config, simulation);
    return stream ? std::string() : stream.error().message;
  };
  EXPECT_NE(refused().find("orientations"), std::string::npos) << refused();
  simulation.turn();
  EXPECT_EQ(refused(), "");
  simulation.orientation[3].pop_back();
  EXPECT_NE(refused().find("column "), std::string::npos) << refused();
  simulation.turn();
  simulation.angular_velocity[0].clear();
  EXPECT_NE(refused().find("column "), std::string::npos) << refused();
}

// A heap that has come to rest before the session begins.
TEST(Stream, BeginsWithBodiesAtRestWhereNobodyMoved) {
  HostConfig config = test_config();
  Layout& layout = config.streams[0].layout;
  const auto at_rest = [&](std::uint32_t capacity, std::vector<std::uint8_t> moved) {
    layout.capacity = capacity;
    FakeSimulation simulation(capacity);
    simulation.velocity[0][7] = 1;
    const Mirror mirror = make_mirror(config.streams, simulation.bodies()).value();
    const auto stream = Stream::create(
        config.streams[0], {.mirror = mirror,
                            .drive = to_drive(config.streams[0].lattice, simulation.gravity(), 0).value(),
                            .frame_rate_hz = config.frame_rate_hz,
                            .moved = moved});
    const std::span<const std::uint8_t> rest = stream.value().agreed().rest();
    EXPECT_EQ(rest[7], 0) << "it has a velocity";
    return std::pair(std::accumulate(rest.begin(), rest.begin() + kBlockSlots, 0U),
                     std::accumulate(rest.begin() + kBlockSlots, rest.end(), 0U));
  };
  constexpr std::uint32_t kFew = kBlockSlots + 4, kMany = 4 * kBlockSlots + 4;
  EXPECT_EQ(at_rest(kFew, {0, 0}), std::pair(0U, 0U)) << "the codec puts nobody to rest";
  layout.codec = "tracker";
  EXPECT_EQ(at_rest(kFew, {}), std::pair(0U, 0U)) << "nobody knows who moved";
  EXPECT_EQ(at_rest(kFew, {1, 1}), std::pair(0U, 0U));
  EXPECT_EQ(at_rest(kFew, {0, 1}), std::pair(kBlockSlots - 1, 0U));
  EXPECT_EQ(at_rest(kFew, {1, 0}), std::pair(0U, 4U));
  layout.predictor = "field";
  ContactConstants constants;
  constants.types = {{1000, 65536}};
  layout.predictor_constants = write_contact_constants(constants);
  EXPECT_EQ(at_rest(kFew, {0, 0}), std::pair(0U, 0U)) << "bits are worth more than time";
  EXPECT_EQ(at_rest(kMany, {0, 1, 1, 1, 0}), std::pair(kBlockSlots - 1, 4U));
}

TEST(Stream, RefusesBodiesThatAreNotOfItsCapacity) {
  HostConfig config = test_config();
  config.streams[0].layout.capacity = 5;
  const FakeSimulation simulation(4);
  const auto stream = Show::create(config, simulation);
  ASSERT_FALSE(stream);
  EXPECT_EQ(stream.error().code, ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace tandem::host
