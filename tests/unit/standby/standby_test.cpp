#include "services/host/standby/standby.hpp"

#include <gmock/gmock.h>

#include "sdk/transport/simulated/network.hpp"
#include "services/host/checkpoint/format.hpp"
#include "tests/unit/checkpoint/sample.hpp"

namespace tandem::standby {
namespace {

using transport::JournalState;

constexpr Epoch kEpoch = 1'000;
constexpr transport::ClientId kSelf = 7;

/// A live server, played by the test, and one that stands by for it.
class StandbyTest : public ::testing::Test {
 protected:
  StandbyTest() : live_(*network_.make_server("default")) {
    port_ = *network_.make_server("default");
    standby_ = *Standby::create(
        {.session = "default", .id = kSelf, .rank = 1, .epoch = 1}, *port_,
        [](const auto& /*checkpoint*/, const auto& /*live*/) { return Result<void>(); },
        [](const auto& /*checkpoint*/, const auto& /*journal*/) { return true; });
    transport::SessionMessage session;
    session.session = "default";
    session.epoch = kEpoch;
    session.capacity = 4;
    session.lattice_unit = 1;
    session.types.resize(1);
    session.streams.resize(1);
    session.streams[0].layout.capacity = session.capacity;
    session.streams[0].max_delta_bytes = session.streams[0].max_snapshot_bytes = 100;
    EXPECT_TRUE(live_->open_standby(kSelf));
    EXPECT_TRUE(live_->write(session));
    run_ms(500);
    EXPECT_EQ(standby_->follows(), kEpoch);
  }

  void run_ms(int ms) {
    for (int i = 0; i < ms && !is_time_; ++i) {
      now_ns_ += kMillisecond;
      network_.advance_to(now_ns_);
      is_time_ = standby_->poll(now_ns_);
    }
  }
  /// The checkpoint of a frame that the journal names with this number.
  void send_checkpoint(Frame frame, std::uint64_t journal) {
    checkpoint::Checkpoint world = checkpoint::sample();
    world.epoch = kEpoch;
    world.frame = frame;
    transport::CheckpointMessage part;
    part.epoch = kEpoch;
    part.frame = frame;
    part.journal = journal;
    ASSERT_TRUE(checkpoint::encode(world, part.bytes));
    part.total_bytes = static_cast<std::uint32_t>(part.bytes.size());
    EXPECT_TRUE(live_->write(kSelf, part));
    run_ms(100);
    EXPECT_EQ(standby_->holds(), frame);
  }
  void send_entry(std::uint64_t number, Frame frame, JournalState state = JournalState::kMade) {
    transport::JournalMessage entry;
    entry.epoch = kEpoch;
    entry.number = number;
    entry.frame = frame;
    entry.state = state;
    if (state == JournalState::kLast) entry.successor = kSelf;
    EXPECT_TRUE(live_->write(entry));
    run_ms(100);
  }

  transport::simulated::Network network_{transport::simulated::NetworkOptions()};
  std::unique_ptr<transport::ServerPort> live_, port_;
  std::unique_ptr<Standby> standby_;
  std::int64_t now_ns_ = kSecond;
  bool is_time_ = false;
};

TEST_F(StandbyTest, EntriesThatComeAfterTheCheckpointThatCoversThemAreNoGap) {
  send_checkpoint(10, 20);
  send_entry(19, 9);
  send_entry(20, 10);
  send_entry(21, 11);
  send_entry(22, 12, JournalState::kLast);
  ASSERT_TRUE(is_time_);
  const Takeover takeover = standby_->take_over();
  EXPECT_TRUE(takeover.handed_over);
  EXPECT_EQ(takeover.checkpoint->frame, 10U);
  ASSERT_EQ(takeover.journal.size(), 2U);
  EXPECT_EQ(takeover.journal.front().number, 21U);
  EXPECT_EQ(takeover.published, 12U);
}

TEST_F(StandbyTest, TheEntryOfAHandoverCountsAlsoAfterTheCheckpointOfItsFrame) {
  send_checkpoint(10, 20);
  EXPECT_FALSE(is_time_);
  send_entry(20, 10, JournalState::kLast);
  ASSERT_TRUE(is_time_);
  const Takeover takeover = standby_->take_over();
  EXPECT_TRUE(takeover.handed_over);
  EXPECT_EQ(takeover.checkpoint->frame, 10U);
  EXPECT_TRUE(takeover.journal.empty());
}

TEST_F(StandbyTest, NothingBehindAGapIsUsed) {
  send_entry(1, 1);
  send_checkpoint(1, 1);
  send_entry(2, 2);
  send_entry(4, 4, JournalState::kLast);
  EXPECT_FALSE(is_time_) << "the checkpoint of the last frame is waited for";
  send_checkpoint(4, 4);
  run_ms(1);
  EXPECT_TRUE(is_time_);
}

}  // namespace
}  // namespace tandem::standby
