#include "services/lab/bandwidth/bandwidth.hpp"

#include <gmock/gmock.h>

#include "sdk/core/codec/paper/code_tables.hpp"
#include "sdk/wire/units.hpp"
#include "services/lab/bandwidth/bandwidth_columns.hpp"
#include "services/lab/bandwidth/peers.hpp"
#include "tests/unit/lab/bouncing.hpp"

namespace tandem::lab::of_bandwidth {
namespace {

constexpr std::uint32_t kBodies = 500;
constexpr double kThreshold = 0.05;

std::vector<host::StreamConfig> streams(const std::vector<std::string>& codecs) {
  host::StreamConfig stream;
  stream.layout.capacity = kBodies;
  stream.lattice = *host::choose_lattice(kThreshold, 100, Bouncing::kDt);
  stream.layout.parameters.codec = *host::codec_parameters(stream.lattice, kThreshold, 0, 0);
  std::vector<host::StreamConfig> all;
  for (const std::string& codec : codecs) {
    stream.layout.codec = codec;
    stream.budget = codec == "limited" ? 100 : kNoBudget;
    stream.layout.codec_tables =
        codec == "entropy" || codec == "limited" ? default_code_tables() : std::vector<std::byte>{};
    all.push_back(stream);
  }
  return all;
}
const std::vector<std::string> kPaper{"none", "selective", "quantized", "entropy", "limited"};

std::vector<BandwidthRow> measure(std::vector<TimedInput> script, std::uint64_t frames) {
  Bouncing simulation(kBodies);
  const auto all = streams(kPaper);
  auto replay = Replay::create(simulation, std::move(script), all[0].lattice);
  EXPECT_TRUE(replay) << replay.error().message;
  std::uint64_t last = 0;
  auto rows = measure_bandwidth(*replay, all, frames, [&last](Frame frame) { last = frame; });
  EXPECT_TRUE(rows) << rows.error().message;
  EXPECT_EQ(last, frames);
  return rows ? *rows : std::vector<BandwidthRow>{};
}

TEST(Bandwidth, without_compression_a_body_costs_24_bytes_a_frame) {
  const auto rows = measure({}, 30);
  ASSERT_EQ(rows.size(), 5U);
  const double raw = 24.0 * 8 * kBodies * 30 / 1048576;
  EXPECT_NEAR(rows[0].mbit_per_s, raw, 0.005 * raw);
  EXPECT_EQ(rows[0].corrected_per_frame, kBodies);
}

TEST(Bandwidth, the_wire_has_the_headers_of_what_shares_a_message) {
  const auto rows = measure({}, 300);
  ASSERT_EQ(rows.size(), 5U);
  const auto headers_kbit_per_s = [](const BandwidthRow& row) {
    return (row.wire_mbit_per_s - row.mbit_per_s) * kBitsPerMbit / 1000;
  };
  EXPECT_NEAR(headers_kbit_per_s(rows[0]), 30 * 8 * (60 + 116 + 8 * 20) / 1000.0, 10)
      << "a frame fills nine packets";
  EXPECT_NEAR(headers_kbit_per_s(rows[3]), 5 * 8 * (60 + 116) / 1000.0, 10) << "six frames share one";
}

TEST(Bandwidth, each_step_of_the_papers_method_saves_and_keeps_to_the_threshold) {
  const auto rows = measure({}, 120);
  ASSERT_EQ(rows.size(), 5U);
  for (std::size_t i = 1; i < rows.size(); ++i)
    EXPECT_LT(rows[i].mbit_per_s, rows[i - 1].mbit_per_s) << rows[i].codec;
  EXPECT_LE(rows[1].max_error, kThreshold * 1.01) << "selective";
  EXPECT_GT(rows[1].max_error, 0);
  EXPECT_LE(rows[1].rms_error, rows[1].max_error);
  EXPECT_GT(rows[1].max_snap, kThreshold) << "who is within the threshold is left alone";
  EXPECT_LE(rows[1].rms_snap, rows[1].max_snap);
  EXPECT_GT(rows[1].rms_snap, kThreshold);
  EXPECT_EQ(rows[1].colliding_per_frame, 7.0);
  EXPECT_LE(rows[4].mbit_per_s, 100 * 8.0 * 30 / 1048576) << "the budget of limited";
}

TEST(Bandwidth, scripted_gravity_reaches_both_sides_on_its_frame) {
  const auto rows = measure({{10, {1, {3.0, 9.81, 0.0}, {}}}, {11, {1, {0.0, 20.0, 1.0}, {}}}}, 40);
  ASSERT_EQ(rows.size(), 5U);
  // Before frame 10 the lower bodies bounce; afterwards all fly freely, so prediction is almost perfect.
  EXPECT_LT(rows[1].corrected_per_frame, kBodies / 5.0);
}

TEST(Bandwidth, a_refused_scripted_input_names_its_frame) {
  Bouncing simulation(kBodies);
  const auto all = streams(kPaper);
  auto replay = Replay::create(simulation, {{3, {}}}, all[0].lattice);
  ASSERT_TRUE(replay);
  const auto rows = measure_bandwidth(*replay, all, 5, [](Frame) {});
  ASSERT_FALSE(rows);
  EXPECT_THAT(rows.error().message, ::testing::HasSubstr("frame 3"));
}

TEST(Bandwidth, an_unknown_codec_is_named) {
  Bouncing simulation(kBodies);
  const auto all = streams({"zip"});
  auto replay = Replay::create(simulation, {}, all[0].lattice);
  ASSERT_TRUE(replay);
  const auto rows = measure_bandwidth(*replay, all, 5, [](Frame) {});
  ASSERT_FALSE(rows);
  EXPECT_THAT(rows.error().message, ::testing::HasSubstr("zip"));
}

TEST(Bandwidth, adaptive_codecs_show_what_their_decisions_took_and_the_bound_beside_it) {
  Bouncing simulation(kBodies);
  const auto all = streams({"entropy", "tracker"});
  auto replay = Replay::create(simulation, {}, all[0].lattice);
  ASSERT_TRUE(replay);
  const auto rows = measure_bandwidth(*replay, all, 120, [](Frame) {});
  ASSERT_TRUE(rows) << rows.error().message;
  EXPECT_FALSE((*rows)[0].ideal_mbit_per_s);
  const BandwidthRow& row = (*rows)[1];
  ASSERT_TRUE(row.ideal_mbit_per_s && row.bound_mbit_per_s);
  EXPECT_LE(*row.bound_mbit_per_s, *row.ideal_mbit_per_s);
  EXPECT_LE(*row.ideal_mbit_per_s, row.mbit_per_s);
}

TEST(Bandwidth, with_orientations_the_threshold_is_kept_by_surfaces) {
  constexpr double kRadius = 0.5;
  Bouncing simulation(kBodies, 4);
  auto all = streams({"tracker", "tracker"});
  Layout& layout = all[0].layout;
  layout.groups = {kPositionGroup, kOrientationGroup};
  layout.radii = {static_cast<std::int32_t>(kRadius * all[0].lattice.position_scale())};
  auto replay = Replay::create(simulation, {}, all[0].lattice);
  ASSERT_TRUE(replay);
  const auto rows = measure_bandwidth(*replay, all, 120, [](Frame) {});
  ASSERT_TRUE(rows) << rows.error().message;
  const BandwidthRow& turning = (*rows)[0];
  ASSERT_TRUE(turning.max_surface_error && turning.rms_surface_error);
  EXPECT_LE(*turning.max_surface_error, kThreshold + 3 * all[0].lattice.unit);
  EXPECT_GT(*turning.max_surface_error, turning.max_error);
  EXPECT_GT(*turning.rms_surface_error, turning.rms_error);
  EXPECT_LE(*turning.rms_surface_error, *turning.max_surface_error);
  const BandwidthRow& points = (*rows)[1];
  EXPECT_FALSE(points.max_surface_error || points.rms_surface_error) << "of the same simulation";
  EXPECT_LE(points.max_error, kThreshold * 1.01);
}

TEST(Bandwidth, peers_keep_to_the_same_largest_error_and_name_a_missing_library) {
  Bouncing simulation(kBodies);
  const auto all = streams({"selective"});
  auto replay = Replay::create(simulation, {}, all[0].lattice);
  ASSERT_TRUE(replay);
  const auto rows = measure_bandwidth(
      *replay, all, 60, [](Frame) {}, kThreshold);
  ASSERT_TRUE(rows) << rows.error().message;
  ASSERT_EQ(rows->size(), 1 + peer_kinds().size());
  for (std::size_t i = 1; i < rows->size(); ++i) {
    const BandwidthRow& row = (*rows)[i];
    EXPECT_EQ(row.codec, peer_kinds()[i - 1].name);
    if (peer_kinds()[i - 1].make == nullptr) {
      EXPECT_EQ(row.missing, peer_kinds()[i - 1].missing);
      EXPECT_THAT(to_table(std::vector{row}), ::testing::HasSubstr(row.missing));
      continue;
    }
    EXPECT_LE(row.max_error, kThreshold * 1.001) << row.codec;
    EXPECT_GT(row.max_error, 0) << row.codec;
    EXPECT_GT(row.mbit_per_s, 0) << row.codec;
    EXPECT_EQ(row.bytes.size(), 60U) << row.codec;
  }
}

TEST(Bandwidth, a_correction_of_dead_reckoning_costs_24_bytes) {
  const PeerKind& first_order = peer_kinds()[3];
  ASSERT_EQ(first_order.name, "dis-1");
  const auto peer = first_order.make({1, 0.1, 1.0});
  std::array<float, 3> position{}, velocity{1, 0, 0};
  const std::uint8_t alive = 1;
  engine::Bodies body;
  for (std::size_t k = 0; k < 3; ++k) {
    body.position[k] = std::span(&position[k], 1);
    body.velocity[k] = std::span(&velocity[k], 1);
  }
  body.alive = std::span(&alive, 1);
  std::array<std::vector<double>, 3> seen;
  for (auto& column : seen) column.resize(1);
  EXPECT_EQ(peer->send(body, seen), std::size_t{24}) << "the start";
  position[0] = 1.05F;
  EXPECT_EQ(peer->send(body, seen), std::size_t{0}) << "within the threshold";
  EXPECT_EQ(seen[0][0], 1.0);
  position[0] = 2.2F;
  EXPECT_EQ(peer->send(body, seen), std::size_t{24}) << "beyond the threshold";
  EXPECT_EQ(seen[0][0], double{2.2F});
}

}  // namespace
}  // namespace tandem::lab::of_bandwidth
