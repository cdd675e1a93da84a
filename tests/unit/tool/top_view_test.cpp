#include "services/tool/top_view.hpp"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "sdk/transport/units.hpp"

namespace tandem::tool {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsSupersetOf;
using ::testing::Not;

transport::ServerStatusMessage server(const std::string& session) {
  transport::ServerStatusMessage status;
  status.session = session;
  status.epoch = 7;
  status.frame = 300;
  status.bodies = 10000;
  status.mbit_per_s = 1.5;
  status.raw_mbit_per_s = 50;
  status.participants = 2;
  status.observers = 1;
  return status;
}

transport::ClientStatusMessage client(transport::ClientId id, const std::string& session) {
  transport::ClientStatusMessage status;
  status.client = id;
  status.session = session;
  status.role = static_cast<std::uint32_t>(transport::Role::kParticipant);
  status.phase = static_cast<std::uint32_t>(transport::Phase::kPlaying);
  status.applied = 299;
  status.lag_ms = 12.5;
  status.stream_reason = "fewest bits";
  return status;
}

TEST(TopView, shows_a_standby_beside_the_live_server) {
  TopView view;
  view.update(server("a"), 0);
  transport::ServerStatusMessage standby = server("a");
  standby.server_role = transport::ServerRole::kStandby;
  standby.behind_frames = 3;
  view.update(standby, 0);
  const auto json = nlohmann::json::parse(view.to_json());
  ASSERT_EQ(json["sessions"].size(), 2U);
  EXPECT_EQ(json["sessions"][0]["role"], "live");
  EXPECT_EQ(json["sessions"][1]["role"], "standby");
  EXPECT_EQ(json["sessions"][1]["session"], "a");
  EXPECT_EQ(json["sessions"][1]["behind_frames"], 3);
  standby.epoch = 8;
  standby.behind_frames = 12;
  view.update(standby, 0);
  EXPECT_THAT(view.to_table(),
              ::testing::AllOf(HasSubstr("STANDS BY FOR"), HasSubstr(" 3 "), HasSubstr(" 12 ")))
      << "each of several";
}

TEST(TopView, shows_the_newest_status_of_each_session_and_client) {
  TopView view;
  view.update(server("a"), 0);
  view.update(server("b"), 0);
  transport::ServerStatusMessage newer = server("a");
  newer.frame = 301;
  view.update(newer, kSecond);
  view.update(client(0xabc, "a"), kSecond);
  const auto json = nlohmann::json::parse(view.to_json());
  ASSERT_EQ(json["sessions"].size(), 2U);
  EXPECT_EQ(json["sessions"][0]["session"], "a");
  EXPECT_EQ(json["sessions"][0]["frame"], 301);
  ASSERT_EQ(json["clients"].size(), 1U);
  EXPECT_EQ(json["clients"][0]["client"], "0000000000000abc");
  EXPECT_EQ(json["clients"][0]["role"], "participant");
  EXPECT_EQ(json["clients"][0]["phase"], "playing");
  EXPECT_EQ(json["clients"][0]["lag_ms"], 12.5);
  EXPECT_EQ(json["clients"][0]["stream_reason"], "fewest bits");
  EXPECT_THAT(view.to_table(), HasSubstr("fewest bits"));
  EXPECT_EQ(json["sessions"][0]["role"], "live");
  EXPECT_THAT(view.to_table(), HasSubstr("1.50 (3.0 %)"));
  EXPECT_THAT(view.to_table(), HasSubstr("2+1"));
}

TEST(TopView, tells_bytes_by_kind_bodies_at_rest_and_who_is_too_slow) {
  TopView view;
  auto status = server("a");
  status.at_rest = 9876;
  status.delta_bytes = 12'345'678;
  status.reply_bytes = 999;
  status.input_bytes = 1'000;
  status.snapshot_bytes = 0;
  view.update(status, 0);
  auto slow = client(1, "a");
  slow.too_slow = 1;
  view.update(slow, 0);
  EXPECT_THAT(view.to_table(), HasSubstr(" 9876 "));
  EXPECT_THAT(view.to_table(), HasSubstr("12M 999 1k 0"));
  EXPECT_THAT(view.to_table(), HasSubstr("too slow"));
  const auto json = nlohmann::json::parse(view.to_json());
  EXPECT_EQ(json["sessions"][0]["bytes"]["deltas"], 12'345'678);
  EXPECT_EQ(json["clients"][0]["too_slow"], true);
}

std::vector<std::string> names(const nlohmann::json& object) {
  std::vector<std::string> names;
  for (const auto& [name, value] : object.items()) names.push_back(name);
  return names;
}

// Scripts read these: names may come, none may go.
TEST(TopView, has_a_name_for_every_figure) {
  TopView view;
  view.update(server("a"), 0);
  view.update(client(1, "a"), 0);
  const auto json = nlohmann::json::parse(view.to_json());
  const auto& session = json["sessions"][0]["streams"][0];
  EXPECT_THAT(names(session), IsSupersetOf({"session",
                                            "stream",
                                            "epoch",
                                            "frame",
                                            "uptime_s",
                                            "frame_rate_hz",
                                            "mbit_per_s",
                                            "raw_mbit_per_s",
                                            "frame_ms",
                                            "corrected_per_frame",
                                            "bodies",
                                            "participants",
                                            "observers",
                                            "window",
                                            "bytes",
                                            "stalls",
                                            "suspended_ms",
                                            "refused_inputs",
                                            "refused_messages",
                                            "snapshots",
                                            "codec",
                                            "predictor",
                                            "threshold",
                                            "at_rest",
                                            "queue_high_water"}));
  EXPECT_THAT(names(session["frame_ms"]), ElementsAre("p50", "p99"));
  EXPECT_THAT(names(session["bytes"]), ElementsAre("deltas", "inputs", "replies", "snapshots"));
  EXPECT_THAT(names(json["clients"][0]),
              IsSupersetOf({"client", "session", "stream", "epoch", "applied", "role", "phase", "lag_ms",
                            "client_ms_p50", "too_slow", "mbit_per_s", "frames_applied", "resyncs",
                            "hash_mismatches", "inputs_sent", "inputs_refused", "queue_high_water"}));
}

TEST(TopView, tells_which_stream_a_client_plays_and_its_predictor_once_heard) {
  TopView view;
  auto rich = client(0xabc, "a");
  rich.stream.id = 1;
  view.update(rich, 0);
  EXPECT_THAT(view.to_table(), HasSubstr("SESSION              STREAM      ROLE "));
  EXPECT_THAT(view.to_table(), HasSubstr("a                    1           participant"));
  auto status = server("a");
  status.predictor = "ballistic";
  view.update(status, 0);
  EXPECT_THAT(view.to_table(), HasSubstr("a                    1           participant"))
      << "not of stream 0";
  status.stream = 1;
  status.predictor = "field";
  view.update(status, 0);
  EXPECT_THAT(view.to_table(), HasSubstr("a                    1 field     participant"));
}

TEST(TopView, forgets_who_is_silent_for_more_than_three_seconds) {
  TopView view;
  view.update(server("a"), 0);
  view.update(client(1, "a"), 2 * kSecond);
  view.forget_silent(3 * kSecond);
  EXPECT_EQ(nlohmann::json::parse(view.to_json())["sessions"].size(), 1U);
  view.forget_silent(3 * kSecond + 1);
  EXPECT_EQ(nlohmann::json::parse(view.to_json())["sessions"].size(), 0U);
  EXPECT_FALSE(view.empty());
  view.forget_silent(5 * kSecond + 1);
  EXPECT_TRUE(view.empty());
}

TEST(TopView, can_show_one_session_only) {
  TopView view;
  view.only("a");
  view.update(server("b"), 0);
  view.update(client(1, "b"), 0);
  EXPECT_TRUE(view.empty());
  view.update(client(1, "a"), 0);
  EXPECT_FALSE(view.empty());
}

TEST(TopView, keeps_control_characters_and_broken_text_off_the_terminal) {
  TopView view;
  view.update(server("evil\x1b[2J\xff"), 0);
  EXPECT_THAT(view.to_table(), Not(HasSubstr("\x1b")));
  EXPECT_TRUE(nlohmann::json::accept(view.to_json()));
}

TEST(TopView, holds_a_bounded_number_of_clients) {
  TopView view;
  for (transport::ClientId id = 1; id <= 5000; ++id) view.update(client(id, "a"), 0);
  EXPECT_EQ(nlohmann::json::parse(view.to_json())["clients"].size(), 4096U);
}

TEST(TopView, says_when_nothing_was_heard) { EXPECT_THAT(TopView().to_table(), HasSubstr("no session")); }

}  // namespace
}  // namespace tandem::tool
