#include <gtest/gtest.h>

#include <map>
#include <set>

#include "sdk/core/lattice/hash.hpp"
#include "sdk/wire/session_book.hpp"

namespace tandem::transport {
namespace {

// An announcement of an epoch. Ten epochs in a row are of one participant.
Received<SessionMessage> announcement(Epoch epoch) {
  Received<SessionMessage> received;
  received.message.epoch = epoch;
  received.from.bytes[0] = static_cast<std::uint8_t>(epoch / 10);
  received.from.bytes[1] = static_cast<std::uint8_t>(epoch / 2560);
  return received;
}

class Book : public ::testing::Test {
 protected:
  void update() {
    book_.update([this](std::uint64_t writer, const ParticipantId&) { return states_.at(writer); });
  }
  std::vector<Epoch> current() {
    update();
    std::vector<Received<SessionMessage>> out;
    book_.take_current(out);
    std::vector<Epoch> epochs;
    for (const auto& received : out) epochs.push_back(received.message.epoch);
    return epochs;
  }
  SessionBook book_;
  std::map<std::uint64_t, WriterState> states_{{1, WriterState::kLive}, {2, WriterState::kLive}};
};

using Epochs = std::vector<Epoch>;

TEST_F(Book, ReportsEachAnnouncementOnce) {
  book_.put(1, announcement(10));
  EXPECT_EQ(current(), Epochs{10});
  EXPECT_EQ(current(), Epochs{});
  book_.put(1, announcement(11));
  EXPECT_EQ(current(), Epochs{11});
}

TEST_F(Book, WhoLeavesWhileItLivesHasEndedAndWhoFallsSilentHasNot) {
  book_.put(1, announcement(10));
  book_.put(2, announcement(20));
  update();
  EXPECT_FALSE(book_.ended(10));
  states_[1] = WriterState::kSilent;  // killed, or cut off
  update();
  states_[1] = WriterState::kGone;
  update();
  EXPECT_FALSE(book_.ended(10));
  states_[2] = WriterState::kGone;
  update();
  EXPECT_TRUE(book_.ended(20));
  states_[2] = WriterState::kLive;
  book_.put(2, announcement(20));  // a relay that was started again
  update();
  EXPECT_FALSE(book_.ended(20));
}

TEST_F(Book, StaysWithAServerWhileItLivesAndThenReportsAnother) {
  book_.put(1, announcement(10));
  EXPECT_EQ(current(), Epochs{10});
  book_.put(2, announcement(20));
  EXPECT_EQ(current(), Epochs{});
  states_[1] = WriterState::kSilent;
  EXPECT_EQ(current(), Epochs{20});
  states_[1] = WriterState::kLive;
  EXPECT_EQ(current(), Epochs{}) << "who was away does not take over again";
  states_[2] = WriterState::kGone;
  EXPECT_EQ(current(), Epochs{10});
}

TEST_F(Book, OneThatCannotBePlayedIsPassedOverUntilItIsAnnouncedAnew) {
  book_.put(1, announcement(10));
  book_.put(2, announcement(20));
  EXPECT_EQ(current(), Epochs{10});
  book_.pass_over_current(PassOver::kUntilAnnouncedAnew);
  EXPECT_EQ(current(), Epochs{20});
  book_.pass_over_current(PassOver::kUntilAnnouncedAnew);
  EXPECT_EQ(current(), Epochs{});
  EXPECT_EQ(current(), Epochs{});
  book_.put(1, announcement(11));
  EXPECT_EQ(current(), Epochs{11});
}

TEST_F(Book, OneThatIsSilentIsLeftOnlyForAServerThatContinuesItsEpoch) {
  book_.put(1, announcement(10));
  EXPECT_EQ(current(), Epochs{10});
  book_.put(2, announcement(20));
  book_.pass_over_current(PassOver::kForItsSuccessor);
  EXPECT_EQ(current(), Epochs{}) << "the other one has another world";
  auto successor = announcement(21);
  successor.message.continues_epoch = 10;
  successor.message.server_role = ServerRole::kStandby;
  book_.put(2, successor);
  book_.pass_over_current(PassOver::kForItsSuccessor);
  EXPECT_EQ(current(), Epochs{}) << "it only stands by";
  successor.message.server_role = ServerRole::kLive;
  book_.put(2, successor);
  EXPECT_EQ(current(), Epochs{}) << "as long as the first one works";
  book_.pass_over_current(PassOver::kForItsSuccessor);
  EXPECT_EQ(current(), Epochs{21});
  book_.put(1, announcement(10));
  EXPECT_EQ(current(), Epochs{}) << "it wakes";
  states_[2] = WriterState::kGone;
  EXPECT_EQ(current(), Epochs{10});
}

TEST_F(Book, OneFromWhichNothingComesIsPassedOverAsLongAsThereIsAnother) {
  book_.put(1, announcement(10));
  EXPECT_EQ(current(), Epochs{10});
  book_.pass_over_current(PassOver::kWhileThereIsAnother);
  EXPECT_EQ(current(), Epochs{}) << "there is no other";
  book_.put(2, announcement(20));
  book_.pass_over_current(PassOver::kWhileThereIsAnother);
  EXPECT_EQ(current(), Epochs{20});
  book_.pass_over_current(PassOver::kWhileThereIsAnother);
  EXPECT_EQ(current(), Epochs{10});
}

TEST_F(Book, KeepsTheServerFollowedWhoeverAnnounces) {
  book_.put(1, announcement(10));
  EXPECT_EQ(current(), Epochs{10});
  for (std::uint64_t writer = 2; writer <= 200; ++writer) {
    states_[writer] = WriterState::kLive;
    book_.put(writer, announcement(writer * 10));
  }
  EXPECT_EQ(current(), Epochs{});
  EXPECT_TRUE(book_.epoch_live(10));
}

TEST_F(Book, HoldsOneAnnouncementOfAParticipantHoweverManyItsWriters) {
  for (std::uint64_t writer = 1; writer <= 80; ++writer) {
    states_[writer] = WriterState::kLive;
    Received<SessionMessage> forged = announcement(writer);
    forged.from = {};
    book_.put(writer, std::move(forged));
  }
  update();
  std::vector<Received<SessionMessage>> out;
  book_.list_live(out);
  EXPECT_EQ(out.size(), 1U);
}

TEST_F(Book, ReportsAServerAgainThatWasSilentForAWhile) {
  book_.put(1, announcement(10));
  EXPECT_EQ(current(), Epochs{10});
  states_[1] = WriterState::kSilent;
  EXPECT_EQ(current(), Epochs{});
  EXPECT_FALSE(book_.epoch_live(10));
  EXPECT_FALSE(book_.any_live());
  states_[1] = WriterState::kLive;
  EXPECT_EQ(current(), Epochs{10});
  EXPECT_TRUE(book_.epoch_live(10));
}

TEST_F(Book, ListsEveryLiveServerInTheOrderSeen) {
  book_.put(2, announcement(20));
  book_.put(1, announcement(10));
  update();
  std::vector<Received<SessionMessage>> out;
  book_.list_live(out);
  ASSERT_EQ(out.size(), 2U);
  EXPECT_EQ(out[0].message.epoch, 20U);
  EXPECT_EQ(out[1].message.epoch, 10U);
}

TEST_F(Book, AServerThatStandsByIsNotFollowedUntilItIsLive) {
  auto standby = announcement(20);
  standby.message.server_role = ServerRole::kStandby;
  book_.put(2, standby);
  EXPECT_EQ(current(), Epochs{});
  EXPECT_FALSE(book_.any_live());
  EXPECT_FALSE(book_.epoch_live(20));
  book_.put(1, announcement(10));
  EXPECT_EQ(current(), Epochs{10});
  states_[1] = WriterState::kGone;
  EXPECT_EQ(current(), Epochs{});
  book_.put(2, announcement(21));
  EXPECT_EQ(current(), Epochs{21});
}

TEST_F(Book, IsBoundedInTheNumberOfWriters) {
  for (std::uint64_t writer = 1; writer <= 1000; ++writer) {
    states_[writer] = WriterState::kLive;
    book_.put(writer, announcement(writer * 10));
  }
  update();
  std::vector<Received<SessionMessage>> out;
  book_.list_live(out);
  EXPECT_EQ(out.size(), 64U);
  EXPECT_EQ(out.back().message.epoch, 10'000U);
}

TEST(SessionName, TakesLettersDigitsDotUnderscoreAndMinus) {
  EXPECT_TRUE(check_session_name("default"));
  EXPECT_TRUE(check_session_name("A.b_c-9"));
  EXPECT_TRUE(check_session_name(std::string(64, 'x')));
}

TEST(SessionName, RefusesWildcardsAndWhatIsNoName) {
  for (const std::string name : {"", "*", "a*", "a?b", "[ab]", "a b", "a/b", "\xC3\xA4", "a\n"}) {
    EXPECT_FALSE(check_session_name(name)) << name;
  }
  EXPECT_FALSE(check_session_name(std::string(65, 'x')));
  EXPECT_FALSE(check_session_name(std::string("a\0b", 3)));
}

TEST(LayoutHash, ChangesWithEverythingThatDecidesHowBytesAreRead) {
  SessionMessage session;
  StreamMessage stream;
  stream.layout.codec = "entropy";
  stream.layout.predictor = "ballistic";
  std::set<std::uint64_t> hashes{layout_hash(session, stream)};
  const auto session_differs = [&](auto&& change) {
    SessionMessage changed = session;
    change(changed);
    return hashes.insert(layout_hash(changed, stream)).second;
  };
  const auto differs = [&](auto&& change) {
    StreamMessage changed = stream;
    change(changed.layout);
    return hashes.insert(layout_hash(session, changed)).second;
  };
  EXPECT_TRUE(session_differs([](auto& s) { s.protocol_version = kProtocolVersion + 1; }));
  EXPECT_TRUE(session_differs([](auto& s) { s.lattice_unit = 0.5; }));
  EXPECT_TRUE(differs([](auto& l) { l.capacity = 1; }));
  EXPECT_TRUE(differs([](auto& l) { l.type_count = 2; }));
  EXPECT_TRUE(differs([](auto& l) { l.lead = 0; }));
  EXPECT_TRUE(differs([](auto& l) { l.groups.emplace_back("orientation"); }));
  EXPECT_TRUE(differs([](auto& l) { l.radii = {5}; }));
  EXPECT_TRUE(differs([](auto& l) { l.codec = "none"; }));
  EXPECT_TRUE(differs([](auto& l) { l.codec_tables = Bytes(1); }));
  EXPECT_TRUE(differs([](auto& l) { l.predictor = "field"; }));
  EXPECT_TRUE(differs([](auto& l) { l.predictor_constants = {1}; }));
  EXPECT_TRUE(differs([](auto& l) { l.parameters.codec.threshold = 7; }));
  EXPECT_TRUE(differs([](auto& l) { l.parameters.codec.position_step = 7; }));
  EXPECT_TRUE(differs([](auto& l) { l.parameters.codec.velocity_step = 7; }));
  EXPECT_TRUE(differs([](auto& l) { l.parameters.step.decay = 7; }));
  EXPECT_TRUE(differs([](auto& l) { l.parameters.codec.velocity_gain = 7; }));
  EXPECT_TRUE(differs([](auto& l) { l.parameters.codec.acceleration_gain = 7; }));
  EXPECT_FALSE(session_differs([](auto& s) { s.epoch = 5; })) << "a restarted server has the same layout";
  EXPECT_FALSE(session_differs([](auto& s) { s.scene_json = "x"; })) << "drawing does not matter";
}

TEST(LayoutHash, OfTheProtocolsExampleIsTheNumberItGives) {
  SessionMessage session;
  session.lattice_unit = 0.0009765625;
  StreamMessage stream;
  stream.layout.capacity = 10000;
  stream.layout.type_count = 2;
  stream.layout.codec = "tracker";
  stream.layout.parameters.codec.threshold = 100;
  EXPECT_EQ(to_hex(layout_hash(session, stream)), "ae8bece13a96ed46")
      << "part of the protocol: other clients would refuse the session";
}

}  // namespace
}  // namespace tandem::transport
