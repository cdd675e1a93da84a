#include "services/lab/bandwidth/bandwidth_columns.hpp"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

namespace tandem::lab {
namespace {

TEST(BandwidthColumns, rows_have_the_agreed_fields) {
  BandwidthRow row;
  row.scene = "half_pipe";
  const auto json = nlohmann::json::parse(to_json(std::vector{row}));
  ASSERT_EQ(json["rows"].size(), 1U);
  std::vector<std::string> keys;
  for (const auto& [key, value] : json["rows"][0].items()) keys.push_back(key);
  EXPECT_THAT(
      keys, ::testing::UnorderedElementsAre(
                "scene", "number", "bodies", "codec", "predictor", "decay", "velocity_gain",
                "acceleration_gain", "threads", "seed", "frames", "dt_s", "threshold", "lattice_unit",
                "mbit_per_s", "wire_mbit_per_s", "ideal_mbit_per_s", "bound_mbit_per_s", "max_error",
                "rms_error", "max_surface_error", "rms_surface_error", "max_snap", "rms_snap",
                "corrected_per_frame", "at_rest_per_frame", "snapshot_bytes_per_body", "colliding_per_frame",
                "step_ms", "predict_ms", "encode_ms", "decode_ms", "apply_ms", "missing"));
  EXPECT_TRUE(json["rows"][0]["number"].is_null());
  EXPECT_TRUE(json["rows"][0]["colliding_per_frame"].is_null());
}

TEST(BandwidthColumns, a_series_has_every_frame) {
  BandwidthRow row;
  row.bytes = {7, 8};
  row.colliding = {1, 0};
  EXPECT_FALSE(nlohmann::json::parse(to_json(std::vector{row}))["rows"][0].contains("payload_bytes"));
  const auto json = nlohmann::json::parse(to_json(std::vector{row}, true))["rows"][0];
  EXPECT_EQ(json["payload_bytes"], nlohmann::json({7, 8}));
  EXPECT_EQ(json["colliding"], nlohmann::json({1, 0}));
}

TEST(BandwidthColumns, surface_errors_are_there_with_orientations_alone) {
  BandwidthRow row;
  row.predictor = "ballistic";
  row.max_error = 0.125;
  const auto of = [](const BandwidthRow& one) {
    return nlohmann::json::parse(to_json(std::vector{one}))["rows"][0];
  };
  EXPECT_TRUE(of(row)["max_surface_error"].is_null());
  EXPECT_TRUE(of(row)["rms_surface_error"].is_null());
  row.max_surface_error = 0.5;
  row.rms_surface_error = 0.25;
  EXPECT_EQ(of(row)["max_surface_error"], 0.5);
  EXPECT_EQ(of(row)["rms_surface_error"], 0.25);
  EXPECT_EQ(of(row)["max_error"], 0.125);
}

BandwidthRow peer() {
  BandwidthRow row;
  row.scene = "pile";
  row.bodies = 20;
  row.codec = "zip";
  row.mbit_per_s = 1.5;
  row.wire_mbit_per_s = 1.75;
  row.max_error = 0.25;
  row.colliding_per_frame = 3;
  return row;
}

TEST(BandwidthColumns, a_peers_row_has_nothing_of_what_only_ours_have) {
  const auto json = nlohmann::json::parse(to_json(std::vector{peer()}))["rows"][0];
  EXPECT_EQ(json["mbit_per_s"], 1.5);
  EXPECT_TRUE(json["rms_snap"].is_null());
  EXPECT_TRUE(json["encode_ms"].is_null());
  const std::string table = to_table(std::vector{peer()});
  EXPECT_THAT(table,
              ::testing::EndsWith(
                  "\npile              20 zip        -            1.500    1.750       -   0.25000   0.00000"
                  "   0.00000\n"));
}

TEST(BandwidthColumns, a_peer_that_was_not_built_shows_no_numbers) {
  BandwidthRow row = peer();
  row.missing = "libzip-dev";
  EXPECT_TRUE(nlohmann::json::parse(to_json(std::vector{row}))["rows"][0]["max_error"].is_null());
  EXPECT_THAT(
      to_table(std::vector{row}),
      ::testing::EndsWith("\npile              20 zip        not in this build: libzip-dev was missing\n"));
}

}  // namespace
}  // namespace tandem::lab
