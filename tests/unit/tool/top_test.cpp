#include "services/tool/top/model/diagnosis.hpp"
#include "services/tool/top/model/overview.hpp"
#include "services/tool/top/model/status_json.hpp"
#include "services/tool/top/screen/pages.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "sdk/wire/units.hpp"

namespace tandem::top {
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

/// An overview that hears reports as they are due.
class Top : public ::testing::Test {
 protected:
  Moment at(double s) const {
    return {static_cast<std::int64_t>(s * 1e9), kWall + static_cast<std::int64_t>(s * 1e9)};
  }
  void hear(const transport::ServerStatusMessage& status, double s, double ahead_s = 0) {
    overview.update({{status, from(1)}, kWall + static_cast<std::int64_t>((s + ahead_s) * 1e9)}, at(s));
  }
  /// `written_s`: if it is not the time at which the report comes.
  void hear(const transport::ClientStatusMessage& status, double s, double written_s = -1,
            std::uint8_t who = 2) {
    const double written = written_s < 0 ? s : written_s;
    overview.update({{status, from(who)}, kWall + static_cast<std::int64_t>(written * 1e9)}, peer, at(s));
  }
  void announce(const std::string& session) {
    transport::SessionMessage message;
    message.session = session;
    message.epoch = 7;
    message.frame_rate_hz = 30;
    message.streams.resize(1);
    overview.update(message);
  }
  Diagnosis of_client(transport::ClientId id, double s) {
    overview.age(at(s));
    return diagnose(overview, overview.clients().at(id), at(s));
  }
  static transport::ParticipantId from(std::uint8_t who) {
    transport::ParticipantId id;
    id.bytes[0] = who;
    return id;
  }
  nlohmann::json json(double s = 0) { return nlohmann::json::parse(to_json(overview, at(s))); }
  std::string table(double s = 0) { return print(overview, 100, at(s), Alphabet::kAscii); }

  static constexpr std::int64_t kWall = 1'700'000'000'000'000'000;
  Overview overview;
  std::optional<transport::Peer> peer;
};

TEST_F(Top, shows_a_standby_beside_the_live_server) {
  hear(server("a"), 0);
  auto standby = server("a");
  standby.server_role = transport::ServerRole::kStandby;
  standby.epoch = 8;
  standby.behind_frames = 3;
  overview.update({{standby, from(9)}, kWall}, at(0));
  ASSERT_EQ(json()["sessions"].size(), 2U);
  EXPECT_EQ(json()["sessions"][0]["role"], "live");
  EXPECT_EQ(json()["sessions"][1]["role"], "standby");
  EXPECT_EQ(json()["sessions"][1]["behind_frames"], 3);
  EXPECT_THAT(table(), HasSubstr("stands by, 3 frames"));
}

TEST_F(Top, SaysOfAStreamThatNobodyCanPlayThatItIsMeasured) {
  auto measured = server("a");
  measured.stream = 2;
  measured.predictor = "hard";
  hear(server("a"), 0);
  hear(measured, 0);
  announce("a");  // one stream
  EXPECT_THAT(table(), HasSubstr("hard: only measured"));
  EXPECT_TRUE(json()["sessions"][0]["streams"][0]["offered"]);
  EXPECT_FALSE(json()["sessions"][0]["streams"][1]["offered"]);
}

TEST_F(Top, AnOfferOfAStreamIsToldByItsDelay) {
  auto late = server("a");
  late.stream = 1;
  hear(server("a"), 0);
  hear(late, 0);
  transport::SessionMessage message;
  message.session = "a";
  message.epoch = 7;
  message.frame_rate_hz = 30;
  message.streams.resize(2);
  message.streams[1].id.id = 1;
  message.streams[1].delay_ms = 200;
  overview.update(message);
  EXPECT_THAT(table(), HasSubstr("a@0.2")) << "of a stream without a name";
  for (auto& stream : message.streams) stream.name = "thin";
  overview.update(message);
  EXPECT_THAT(table(), HasSubstr("a/thin "));
  EXPECT_THAT(table(), HasSubstr("a/thin@0.2"));
  EXPECT_EQ(json()["sessions"][0]["streams"][0]["delay_ms"], 0);
  EXPECT_EQ(json()["sessions"][0]["streams"][1]["delay_ms"], 200);
}

TEST_F(Top, shows_the_newest_status_of_each_session_and_client) {
  hear(server("a"), 0);
  hear(server("b"), 0);
  auto newer = server("a");
  newer.frame = 301;
  hear(newer, 1);
  hear(client(0xabc, "a"), 1);
  ASSERT_EQ(json()["sessions"].size(), 2U);
  EXPECT_EQ(json()["sessions"][0]["frame"], 301);
  ASSERT_EQ(json()["clients"].size(), 1U);
  EXPECT_EQ(json()["clients"][0]["client"], "0000000000000abc");
  EXPECT_EQ(json()["clients"][0]["role"], "participant");
  EXPECT_EQ(json()["clients"][0]["stream_reason"], "fewest bits");
  EXPECT_THAT(table(1), HasSubstr("fewest bits"));
  EXPECT_THAT(table(1), HasSubstr("2+1"));
}

std::vector<std::string> names(const nlohmann::json& object) {
  std::vector<std::string> names;
  for (const auto& [name, value] : object.items()) names.push_back(name);
  return names;
}

// Scripts read these: names may come, none may go.
TEST_F(Top, has_a_name_for_every_figure) {
  hear(server("a"), 0);
  hear(client(1, "a"), 0);
  const auto json = this->json();
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

TEST_F(Top, keeps_a_silent_server_as_gone_and_its_clients_as_stranded) {
  hear(server("a"), 0);
  for (int s = 0; s <= 12; ++s) hear(client(1, "a"), s);
  overview.age(at(12));
  EXPECT_EQ(json(12)["sessions"].size(), 0U) << "scripts see the living only";
  EXPECT_THAT(table(12), HasSubstr("gone for 12 s"));
  EXPECT_THAT(table(12), HasSubstr("stranded"));
  EXPECT_EQ(of_client(1, 12).why, "its server is gone for 12 s");
  hear(server("a"), 13);
  EXPECT_THAT(table(13), Not(HasSubstr("gone")));
}

TEST_F(Top, shows_a_silent_client_as_gone_for_a_minute) {
  hear(client(1, "a"), 0);
  overview.age(at(5));
  EXPECT_FALSE(overview.empty());
  overview.age(at(5.1));
  EXPECT_TRUE(overview.empty());
  EXPECT_THAT(table(6), HasSubstr("silent for 6 s"));
  overview.age(at(61));
  EXPECT_TRUE(overview.clients().empty());
}

TEST_F(Top, can_show_one_session_only) {
  overview.only("a");
  hear(server("b"), 0);
  hear(client(1, "b"), 0);
  EXPECT_TRUE(overview.empty());
  hear(client(1, "a"), 0);
  EXPECT_FALSE(overview.empty());
}

TEST_F(Top, holds_a_bounded_number_of_clients) {
  for (transport::ClientId id = 1; id <= 5000; ++id) hear(client(id, "a"), 0);
  EXPECT_EQ(overview.clients().size(), 4096U);
}

TEST_F(Top, lets_nobody_take_the_id_of_a_living_client) {
  hear(client(1, "a"), 0);
  auto other = client(1, "a");
  other.lag_ms = 9999;
  hear(other, 1, -1, 7);
  EXPECT_EQ(overview.clients().at(1).status.lag_ms, 12.5);
}

TEST_F(Top, names_the_own_step_as_the_cause) {
  hear(server("a"), 0);
  announce("a");
  auto slow = client(1, "a");
  slow.client_ms_p50 = 41;
  slow.lag_ms = 400;
  for (int s = 0; s < 3; ++s) hear(slow, s);
  EXPECT_EQ(of_client(1, 2.5).why, "own step takes 41 of 33 ms");
}

TEST_F(Top, names_a_process_that_is_held_up_as_the_cause) {
  auto slow = client(1, "a");
  slow.lag_ms = 250;
  double due = 0;
  for (int i = 0; i < 8; ++i, due += i % 2 == 0 ? 1.0 : 1.3) hear(slow, due);
  EXPECT_THAT(of_client(1, due).why, HasSubstr("process held up, by 300 ms"));
}

TEST_F(Top, names_a_link_that_loses_packets_as_the_cause) {
  auto slow = client(1, "a");
  slow.lag_ms = 250;
  for (int s = 0; s < 40; ++s)
    if (s % 10 != 5) hear(slow, s);
  EXPECT_THAT(of_client(1, 40).why, HasSubstr("link loses packets: 10 % of reports"));
}

TEST_F(Top, takes_a_clock_that_is_set_for_no_loss) {
  auto slow = client(1, "a");
  slow.lag_ms = 250;
  for (int s = 0; s < 40; ++s) hear(slow, s, s < 20 ? s : s + 35);
  EXPECT_THAT(of_client(1, 40).why, Not(HasSubstr("loses packets")));
}

TEST_F(Top, names_a_thin_link_as_the_cause) {
  auto status = server("a");
  status.frame_rate_hz = 30;
  hear(status, 0);
  auto slow = client(1, "a");
  slow.lag_ms = 2000;
  slow.mbit_per_s = 0.5;
  for (int s = 0; s < 3; ++s) hear(slow, s);
  EXPECT_EQ(of_client(1, 2.5).why, "link too thin: 0.50 of 1.50 Mbit/s");
}

TEST_F(Top, does_not_blame_the_network_for_an_engine_that_hangs) {
  auto status = server("a");
  auto waits = client(1, "a");
  waits.applied = status.frame;
  for (int s = 0; s < 16; ++s) {
    const bool hangs = s >= 3 && s < 12;
    status.frame_rate_hz = hangs ? 0 : 30;
    waits.lag_ms = hangs ? 1e3 * (s - 2) : 5;
    hear(status, s);
    announce("a");
    hear(waits, s);
    if (s == 8) {
      const auto& [key, stream] = *overview.streams().begin();
      EXPECT_EQ(diagnose(overview, key, stream, at(s)).why,
                "0 of 30 Hz: its simulation takes long for a step, or hangs");
    }
    if (s == 8 || s == 15) {
      EXPECT_EQ(of_client(1, s).why, "its server makes fewer frames than are due") << s;
    }
  }
}

TEST_F(Top, does_not_take_a_wrong_clock_for_a_lag) {
  auto ahead = client(1, "a");
  ahead.lag_ms = 35'004;
  for (int s = 0; s < 3; ++s) {
    hear(server("a"), s);
    hear(ahead, s, s + 35);
  }
  EXPECT_EQ(of_client(1, 2.5).why, "its clock is 35.0 s ahead of the server's");
  EXPECT_NEAR(facts_of(overview, overview.clients().at(1)).lag_ms, 4, 0.1);
}

TEST_F(Top, believes_the_lag_of_a_client_whose_clock_is_wrong) {
  auto ahead = client(1, "a");
  ahead.lag_ms = 250;
  for (int s = 0; s < 3; ++s) {
    hear(server("a"), s);
    hear(ahead, s, s + 35);
  }
  EXPECT_NEAR(facts_of(overview, overview.clients().at(1)).lag_ms, 250, 0.1);
}

TEST_F(Top, sees_a_demotion_also_of_a_client_that_was_demoted_before) {
  hear(client(1, "a"), 0);
  auto observer = client(1, "a");
  observer.role = static_cast<std::uint32_t>(transport::Role::kObserver);
  hear(observer, 1);
  EXPECT_THAT(of_client(1, 2).why, HasSubstr("held the server up 1 s ago"));
  peer = transport::Peer{"tandem client 0000000000000002", "h", "p", "1", std::chrono::milliseconds(500)};
  observer.client = 2;
  for (int s = 0; s < 3; ++s) hear(observer, s);
  EXPECT_TRUE(overview.clients().at(2).demoted);
  peer->lease = std::chrono::seconds(10);
  peer->name = "tandem client 0000000000000003";
  observer.client = 3;
  for (int s = 0; s < 3; ++s) hear(observer, s);
  EXPECT_FALSE(overview.clients().at(3).demoted) << "it never wanted to be a participant";
}

TEST_F(Top, counts_viewers_behind_a_gateway) {
  hear(server("a"), 0);
  peer = transport::Peer{"tandem client 00000000000000aa", "h", "tandem-gateway", "1",
                         std::chrono::milliseconds(500)};
  hear(client(0xaa, "a"), 0);
  hear(client(1, "a"), 0);
  hear(client(2, "a"), 0);
  overview.age(at(0));
  EXPECT_EQ(overview.clients().at(0xaa).viewers, 2U);
  EXPECT_THAT(table(), HasSubstr("2+1+2v"));
  EXPECT_THAT(table(), HasSubstr("gateway of 2 viewers"));
}

TEST_F(Top, keeps_hostile_text_and_numbers_off_the_terminal) {
  auto evil = server("evil\x1b[2J\xff");
  evil.predictor = "\x1b]0;x\x07\u202e";
  evil.mbit_per_s = 1e300;
  evil.frame_rate_hz = std::numeric_limits<double>::quiet_NaN();
  hear(evil, 0);
  auto client_status = client(1, "a");
  client_status.lag_ms = std::numeric_limits<double>::infinity();
  client_status.mbit_per_s = -1e300;
  client_status.stream_reason =
      "\x9b"
      "2J\u200b";
  hear(client_status, 0);
  for (const Panel panel : {Panel::kTables, Panel::kDetails, Panel::kEvents, Panel::kHelp}) {
    for (const Size size : {Size{100, 30}, Size{80, 24}, Size{200, 60}, Size{20, 5}, Size{1, 1}}) {
      View view;
      const Rows rows = view.rows(overview, at(0));
      if (panel == Panel::kDetails) {
        ASSERT_TRUE(view.press(Key::kDetails, rows, 5));
      }
      if (panel == Panel::kEvents) {
        ASSERT_TRUE(view.press(Key::kEvents, rows, 5));
      }
      if (panel == Panel::kHelp) {
        ASSERT_TRUE(view.press(Key::kHelp, rows, 5));
      }
      const Page page = compose(overview, view, rows, 0, size, at(0), Alphabet::kAscii);
      EXPECT_LE(page.size(), size.lines);
      for (const Line& line : page) {
        EXPECT_LE(columns_of(line.text()), size.columns);
        for (const char c : line.text()) EXPECT_TRUE(c >= 0x20 && c < 0x7F) << line.text();
      }
    }
  }
  EXPECT_TRUE(nlohmann::json::accept(to_json(overview, at(0))));
}

TEST_F(Top, wraps_a_long_word_without_losing_any_of_it) {
  const std::string word = "0123456789abcdefghijklmnopqrstuvwxyz";
  const auto lines = wrap("see " + word + " here", 10, Alphabet::kAscii);
  EXPECT_EQ(lines,
            (std::vector<std::string>{"see", "0123456789", "abcdefghij", "klmnopqrst", "uvwxyz", "here"}));
}

TEST_F(Top, sorts_by_any_column_and_follows_the_chosen_client) {
  for (transport::ClientId id = 1; id <= 3; ++id) {
    auto status = client(id << 32U, "a");
    status.mbit_per_s = static_cast<double>(id);
    hear(status, 0);
  }
  View view;
  for (std::size_t i = 0; i < client_columns().size(); ++i) {
    ASSERT_TRUE(view.press(Key::kSortNext, view.rows(overview, at(0)), 5));
    const std::size_t column = view.order(Focus::kClients).column;
    if (client_columns()[column].title != "MBIT/S") continue;
    const Rows rows = view.rows(overview, at(0));
    EXPECT_EQ(rows.clients.front().client->status.mbit_per_s, 3);
    ASSERT_TRUE(view.press(Key::kDown, rows, 5));
    ASSERT_TRUE(view.press(Key::kReverse, rows, 5));
    const Rows reversed = view.rows(overview, at(0));
    EXPECT_EQ(reversed.clients.front().client->status.mbit_per_s, 1);
    EXPECT_EQ(reversed.clients[*view.chosen_client(reversed)].client->status.mbit_per_s, 2);
  }
  EXPECT_FALSE(view.press(Key::kQuit, view.rows(overview, at(0)), 5));
}

TEST_F(Top, fits_a_hundred_columns) {
  for (int s = 0; s < 3; ++s) {
    hear(server(std::string(64, 'a')), s);
    hear(client(1, std::string(64, 'a')), s);
  }
  std::istringstream lines(table(2));
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 100U) << line;
}

TEST_F(Top, says_when_nothing_was_heard) { EXPECT_THAT(table(), HasSubstr("no session")); }

}  // namespace
}  // namespace tandem::top
