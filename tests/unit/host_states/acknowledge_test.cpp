// What an acknowledgement makes of a client, for all that can be known of it and all that it can say.
#include <gtest/gtest.h>

#include <array>
#include <optional>
#include <string>

#include "services/host/clients/roster.hpp"

namespace tandem::host {
namespace {

using transport::Phase;
using transport::Role;

constexpr Frame kFrame = 100;
constexpr std::uint32_t kAttempt = 3;

// Known of the client: it plays or joins stream a, or it changes from a to b.
struct Known {
  const char* name;
  Phase phase = Phase::kJoining;
  std::optional<std::uint32_t> next_stream = {};
  bool served = false;
  bool has_account = true;
};
constexpr std::array kKnown{
    Known{.name = "unknown", .has_account = false},
    Known{.name = "joining"},
    Known{.name = "served", .served = true},
    Known{.name = "playing", .phase = Phase::kPlaying},
    Known{.name = "fetching", .phase = Phase::kPlaying, .next_stream = 0},
    Known{.name = "fetching, served", .phase = Phase::kPlaying, .next_stream = 0, .served = true},
    Known{.name = "changing", .phase = Phase::kPlaying, .next_stream = 1},
    Known{.name = "changing, served", .phase = Phase::kPlaying, .next_stream = 1, .served = true},
};

struct Words {
  Phase phase;
  Frame applied;
  std::uint32_t attempt;
};
constexpr Words kJoins{Phase::kJoining, 0, kAttempt + 1}, kChanges{Phase::kJoining, kFrame, kAttempt + 1},
    kPlays{Phase::kPlaying, kFrame, kAttempt}, kPlaysAnew{Phase::kPlaying, kFrame, kAttempt + 1};

// What the roster makes of words about a stream.
std::string outcome(const Known& known, const Words& words, std::uint32_t stream) {
  Roster roster({.epoch = 1, .streams = {"a", "b", "c"}, .stall_timeout_ns = {}, .fixed_window = {}});
  const transport::ParticipantId from{{1}};
  const std::array<SentFrames, 3> sent;
  const Roster::Now now{.ns = 1, .frame = kFrame, .written = kFrame, .period_ns = 1, .sent = sent};
  transport::AckMessage ack;
  ack.client = 7;
  ack.epoch = 1;
  ack.role_wanted = Role::kParticipant;
  if (known.has_account) {
    ack.phase = Phase::kJoining;
    EXPECT_EQ(roster.acknowledge(ack, from, now), transport::Reason::kNone);
    Account& account = roster.accounts().at(7);
    account.phase = known.phase;
    account.next_stream = known.next_stream;
    account.attempt = kAttempt;
    account.counted = known.phase == Phase::kPlaying;
    account.join = {
        .served = known.served, .served_attempt = kAttempt, .served_stream = known.next_stream.value_or(0)};
  }
  ack.phase = words.phase;
  ack.applied = ack.simulated = words.applied;
  ack.join_attempt = words.attempt;
  ack.stream.id = stream;
  EXPECT_EQ(roster.acknowledge(ack, from, now), transport::Reason::kNone);
  const Account& account = roster.accounts().at(7);
  EXPECT_EQ(account.attempt, words.attempt);
  EXPECT_EQ(account.applied, words.applied);
  const char* const streams[] = {"a", "b", "c"};
  const std::string of = streams[account.stream];
  const auto notices = roster.notices().take();
  if (account.phase == Phase::kJoining) {
    EXPECT_FALSE(account.counted || account.next_stream);
    EXPECT_TRUE(notices.empty());
    return "joins " + of;
  }
  const bool enters = account.timed_from == kFrame;
  const bool moves = notices.size() == 1 && notices[0].ends_with("changed to stream " + of);
  EXPECT_EQ(enters, notices.size() == 1 && notices[0].ends_with("plays as participant of stream " + of));
  EXPECT_EQ(notices.size(), enters || moves ? 1U : 0U);
  EXPECT_EQ(account.counted, !enters) << "the server waits for who has caught up before";
  const std::string next = account.next_stream ? std::string(", joins ") + streams[*account.next_stream] : "";
  return (enters ? "enters " : moves ? "moves to " : "plays ") + of + next;
}

using OfStreams = std::array<const char*, 3>;  // what follows when it says it of stream a, b, c

TEST(Acknowledge, OneThatJoinsAndPlaysNothingJoinsTheStreamThatItNames) {
  for (const Known& known : kKnown) {
    SCOPED_TRACE(known.name);
    EXPECT_EQ(outcome(known, kJoins, 0), "joins a");
    EXPECT_EQ(outcome(known, kJoins, 1), "joins b");
    EXPECT_EQ(outcome(known, kJoins, 2), "joins c");
  }
}

void expect(const Words& words, const std::array<OfStreams, kKnown.size()>& rows) {
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (std::uint32_t stream = 0; stream < 3; ++stream) {
      SCOPED_TRACE(std::string(kKnown[i].name) + ", stream " + std::to_string(stream));
      EXPECT_EQ(outcome(kKnown[i], words, stream), rows[i][stream]);
    }
  }
}

TEST(Acknowledge, OneThatJoinsAndPlaysKeepsItsStreamMeanwhile) {
  expect(kChanges, {{
                       {"joins a", "joins b", "joins c"},                                // unknown
                       {"joins a", "joins b", "joins c"},                                // joining
                       {"enters a, joins a", "enters a, joins b", "enters a, joins c"},  // served
                       {"plays a, joins a", "plays a, joins b", "plays a, joins c"},     // playing
                       {"plays a, joins a", "plays a, joins b", "plays a, joins c"},     // fetching
                       {"plays a, joins a", "plays a, joins b", "plays a, joins c"},     // and served
                       {"joins a", "plays a, joins b", "plays a, joins c"},              // changing
                       {"moves to b, joins a", "plays a, joins b", "plays a, joins c"},  // and served
                   }});
}

TEST(Acknowledge, OneThatPlaysEntersUnlessItPlayedOrJoinedThatStream) {
  expect(kPlays, {{
                     {"enters a", "enters b", "enters c"},   // unknown
                     {"enters a", "enters b", "enters c"},   // joining
                     {"enters a", "enters b", "enters c"},   // served
                     {"plays a", "enters b", "enters c"},    // playing
                     {"plays a", "enters b", "enters c"},    // fetching
                     {"plays a", "enters b", "enters c"},    // and served
                     {"plays a", "moves to b", "enters c"},  // changing
                     {"plays a", "moves to b", "enters c"},  // and served
                 }});
}

TEST(Acknowledge, OneThatJoinedAnewEntersUnlessThatWasToChange) {
  expect(kPlaysAnew, {{
                         {"enters a", "enters b", "enters c"},   // unknown
                         {"enters a", "enters b", "enters c"},   // joining
                         {"enters a", "enters b", "enters c"},   // served
                         {"enters a", "enters b", "enters c"},   // playing
                         {"plays a", "enters b", "enters c"},    // fetching
                         {"plays a", "enters b", "enters c"},    // and served
                         {"plays a", "moves to b", "enters c"},  // changing
                         {"plays a", "moves to b", "enters c"},  // and served
                     }});
}

}  // namespace
}  // namespace tandem::host
