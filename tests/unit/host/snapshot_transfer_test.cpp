#include "services/host/clients/snapshot_transfer.hpp"

#include <gtest/gtest.h>

#include <random>

#include "sdk/client/following/snapshot_assembly.hpp"
#include "sdk/wire/limits.hpp"

namespace tandem::host {
namespace {

using accounts::TransferWindow;
using client::SnapshotAssembly;
using transport::ClientId;

constexpr Epoch kEpoch = 5;
constexpr StreamId kStream{2, 3};
constexpr std::size_t kPart = SnapshotTransfer::kPartBytes;
constexpr std::int64_t kNever = INT64_MAX;

std::vector<std::byte> content(std::size_t size) {
  std::vector<std::byte> bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::byte>(i % 251);
  return bytes;
}

/// One direction to a receiver over reliable DDS: samples arrive in order, and a lost one holds up all behind
/// it for a round trip.
struct Link {
  double bytes_per_s = 1e9;
  std::int64_t delay_ns = 10 * kMillisecond;
  std::int64_t jitter_ns = 0;
  double loss = 0;
  std::int64_t queue_ns = kNever;     // what would wait longer is dropped
  bool is_cut = false;                // what is sent meanwhile arrives once it is mended
  std::int64_t lifespan_ns = kNever;  // but not what is older than that
};

class Receiver {
 public:
  Link link;
  SnapshotAssembly held{std::size_t{1} << 26U};
  std::int64_t longest_queue_ns = 0;
  std::size_t sent_bytes = 0;
  std::optional<std::int64_t> whole_ns;

  void send(const transport::SnapshotMessage& part, std::int64_t now_ns, std::mt19937_64& random) {
    sent_bytes += part.bytes.size();
    const auto chance = [&] { return static_cast<double>(random() >> 11U) * 0x1.0p-53; };
    const bool dropped = free_ns_ - now_ns > link.queue_ns;
    if (!dropped) {
      free_ns_ = std::max(free_ns_, now_ns) +
                 static_cast<std::int64_t>(static_cast<double>(part.bytes.size()) / link.bytes_per_s * 1e9);
      longest_queue_ns = std::max(longest_queue_ns, free_ns_ - now_ns);
    }
    std::int64_t at_ns = std::max(free_ns_, now_ns) + link.delay_ns +
                         static_cast<std::int64_t>(chance() * static_cast<double>(link.jitter_ns));
    if (dropped) at_ns += 2 * link.delay_ns;
    while (chance() < link.loss) at_ns += 2 * link.delay_ns;
    flying_.push_back({std::max(at_ns, flying_.empty() ? 0 : flying_.back().first), part});
  }
  /// True when something came that is to be acknowledged.
  bool receive(std::int64_t now_ns) {
    bool stored = false;
    if (link.is_cut)
      std::erase_if(flying_, [&](const auto& entry) { return now_ns - entry.first > link.lifespan_ns; });
    while (!link.is_cut && !flying_.empty() && flying_.front().first <= now_ns) {
      stored |= held.add(std::move(flying_.front().second)) == SnapshotAssembly::Outcome::kStored;
      flying_.pop_front();
    }
    if (held.parts() > 0 && held.missing().empty() && !whole_ns) whole_ns = now_ns;
    return stored;
  }

 private:
  std::int64_t free_ns_ = 0;
  std::deque<std::pair<std::int64_t, transport::SnapshotMessage>> flying_;
};

class SnapshotTransferTest : public ::testing::Test {
 protected:
  void start(Frame frame, std::size_t size, std::initializer_list<ClientId> clients) {
    for (const ClientId client : clients) {
      Account& account = accounts[client];
      account.id = client;
      account.stream = kStream.id;
      account.phase = transport::Phase::kJoining;
      account.asked = true;
      receivers[client];
    }
    transfer.start(kEpoch, kStream, frame, bytes = content(size), clients, now_ns);
    began_ns = now_ns;
  }
  std::vector<SnapshotPart> send() {
    transfer.send(accounts, deltas_bytes_per_s, now_ns);
    std::vector<SnapshotPart> out;
    while (const auto message = outbox.pop(std::chrono::nanoseconds{0}))
      out.push_back(std::get<SnapshotPart>(*message));
    return out;
  }
  [[nodiscard]] transport::AckMessage acknowledgement(ClientId client) const {
    const SnapshotAssembly& held = receivers.at(client).held;
    transport::AckMessage ack;
    ack.client = client;
    ack.stream = kStream;
    ack.snapshot_frame = held.frame();
    ack.snapshot_parts = held.parts();
    ack.missing = held.missing();
    return ack;
  }
  void acknowledge(ClientId client) { transfer.acknowledged(acknowledgement(client), now_ns); }
  /// A millisecond: acknowledgements take the link's delay back, and are 20 ms apart.
  void tick() {
    for (const auto& [client, part] : send()) receivers.at(client).send(part, now_ns, random);
    for (auto& [client, receiver] : receivers) {
      if (receiver.receive(now_ns)) due[client] = true;
      if (due[client] && now_ns - last_ns[client] >= 20 * kMillisecond) {
        returning[client].push_back({now_ns + receiver.link.delay_ns, acknowledgement(client)});
        last_ns[client] = now_ns;
        due[client] = false;
      }
      auto& way = returning[client];
      while (!way.empty() && way.front().first <= now_ns) {
        if (answers) transfer.acknowledged(way.front().second, now_ns);
        way.pop_front();
      }
    }
    now_ns += kMillisecond;
  }
  void run_ms(int ms) {
    for (int i = 0; i < ms; ++i) tick();
  }
  /// Milliseconds until `client` has all of it.
  int run_until_whole(ClientId client, int most_ms) {
    for (int ms = 0; ms < most_ms && !receivers.at(client).whole_ns; ++ms) tick();
    return receivers.at(client).whole_ns
               ? static_cast<int>((*receivers.at(client).whole_ns - began_ns) / kMillisecond)
               : most_ms;
  }

  Outbox outbox{{}};
  SnapshotTransfer transfer{outbox};
  std::map<ClientId, Account> accounts;
  std::map<ClientId, Receiver> receivers;
  std::map<ClientId, bool> due;
  std::map<ClientId, std::int64_t> last_ns;
  std::map<ClientId, std::deque<std::pair<std::int64_t, transport::AckMessage>>> returning;
  std::vector<std::byte> bytes;
  std::int64_t now_ns = 77 * kSecond, began_ns = 0;
  std::mt19937_64 random{20261122};
  bool answers = true;
  double deltas_bytes_per_s = 0;
};

TEST_F(SnapshotTransferTest, PartsAreConsecutiveCutsThatTellWhatTheyBelongTo) {
  start(7, 2 * kPart + 1, {1});
  std::vector<std::byte> joined;
  for (const auto& [client, part] : send()) {
    EXPECT_EQ(client, 1U);
    EXPECT_EQ(part.epoch, kEpoch);
    EXPECT_EQ(part.stream, kStream);
    EXPECT_EQ(part.frame, 7U);
    EXPECT_EQ(part.parts, 3U);
    EXPECT_EQ(part.total_bytes, bytes.size());
    joined.insert(joined.end(), part.bytes.begin(), part.bytes.end());
    receivers[1].held.add(transport::SnapshotMessage(part));
  }
  EXPECT_EQ(joined, bytes);
  acknowledge(1);
  EXPECT_EQ(transfer.bytes(), bytes.size());
  now_ns += 10 * kSecond;
  EXPECT_TRUE(send().empty()) << "once, unless somebody lacks them";
}

TEST_F(SnapshotTransferTest, NoMoreIsOnItsWayThanTheWindowUntilSomethingArrived) {
  start(7, 100 * kPart, {1});
  EXPECT_EQ(send().size() * kPart, TransferWindow::kFirst);
  EXPECT_TRUE(send().empty());
}

TEST_F(SnapshotTransferTest, AThinLinkIsFilledButItsQueueStaysShort) {
  start(7, 100'000, {1});
  receivers[1].link.bytes_per_s = 256'000 / 8.0;
  EXPECT_LT(run_until_whole(1, 20'000), 1.2 * 1000 * 100'000 / receivers[1].link.bytes_per_s);
  EXPECT_LT(receivers[1].longest_queue_ns, 400 * kMillisecond);
  EXPECT_EQ(receivers[1].sent_bytes, 100'000U);
}

TEST_F(SnapshotTransferTest, AFastLinkIsFilledSoon) {
  start(7, 10'000'000, {1});
  receivers[1].link.bytes_per_s = 1e8;
  EXPECT_LT(run_until_whole(1, 20'000), 1'500);
  EXPECT_EQ(receivers[1].sent_bytes, 10'000'000U);
}

TEST_F(SnapshotTransferTest, DelayJitterAndLossAreNotTakenForAThinLink) {
  for (const double loss : {0.0, 0.05, 0.1}) {
    SCOPED_TRACE(loss);
    receivers.clear();
    returning.clear();
    start(static_cast<Frame>(7 + 100 * loss), 85'000, {1});
    receivers[1].link = {.delay_ns = 100 * kMillisecond, .jitter_ns = 50 * kMillisecond, .loss = loss};
    EXPECT_LT(run_until_whole(1, 20'000), 1'200 + static_cast<int>(20'000 * loss));
    EXPECT_EQ(receivers[1].sent_bytes, 85'000U) << "what DDS repairs is not sent again besides";
  }
}

TEST_F(SnapshotTransferTest, AReceiverWithACapIsSentWhatTheDeltasLeaveOfItAndAtLeastAQuarter) {
  constexpr std::uint32_t kCap = 64;
  constexpr double kCapBytes = kCap * 1000 / 8.0, kHeaders = 0.1;
  for (const double deltas : {0.0, 0.5, 2.0}) {
    SCOPED_TRACE(deltas);
    start(static_cast<Frame>(7 + 10 * deltas), 20'000, {1, 2});
    receivers[1] = receivers[2] = {};
    accounts[1].cap_kbit_s = kCap;
    deltas_bytes_per_s = deltas * kCapBytes;
    const double left = kCapBytes * std::max(0.25, 1 - deltas);
    const int took_ms = run_until_whole(1, 60'000);
    EXPECT_GT(took_ms, 1000 * 20'000 / left * (1 + kHeaders)) << "with headers it is all that there is";
    EXPECT_LT(took_ms, 1000 * 20'000 / left * 1.6);
    EXPECT_LT(*receivers[2].whole_ns - began_ns, kSecond) << "nobody else is held up";
  }
}

TEST_F(SnapshotTransferTest, EachReceiverIsServedAtThePaceOfItsOwnLink) {
  start(7, 100 * kPart, {1, 2});
  receivers[1].link.bytes_per_s = 256'000 / 8.0;
  receivers[2].link.bytes_per_s = 1e7;
  EXPECT_LT(run_until_whole(2, 20'000), 500);
  EXPECT_LT(run_until_whole(1, 20'000), 5'000);
  EXPECT_LT(receivers[1].longest_queue_ns, 400 * kMillisecond);
}

TEST_F(SnapshotTransferTest, WhoeverNeverAnswersIsSentLittleAndDelaysNobody) {
  answers = false;
  start(7, 1000 * kPart, {1});
  run_ms(60'000);
  EXPECT_LT(receivers[1].sent_bytes, 50 * kPart);
  EXPECT_FALSE(transfer.full(now_ns));
  answers = true;
  start(8, 1000 * kPart, {2});
  EXPECT_LT(run_until_whole(2, 20'000), 1'000);
}

TEST_F(SnapshotTransferTest, WhatDdsLostIsSentAgainAsSoonAsLaterPartsArrived) {
  start(7, 100 * kPart, {1});
  const auto sent = send();
  ASSERT_GT(sent.size(), 3U);
  now_ns += 30 * kMillisecond;
  for (const std::size_t arrives : {1U, 3U})
    receivers[1].held.add(transport::SnapshotMessage(sent[arrives].part));
  acknowledge(1);
  const auto next = send();
  ASSERT_GT(next.size(), 1U);
  EXPECT_EQ(next[0].part.part, 0U);
  EXPECT_EQ(next[1].part.part, 2U);
}

TEST_F(SnapshotTransferTest, ALinkThatWasGoneForSecondsIsFoundAgainSoon) {
  start(7, 100 * kPart, {1});
  receivers[1].link.bytes_per_s = 1e5;
  run_ms(300);
  receivers[1].link.is_cut = true;
  run_ms(5'000);
  receivers[1].link.is_cut = false;
  const std::int64_t back_ns = now_ns;
  run_until_whole(1, 20'000);
  ASSERT_TRUE(receivers[1].whole_ns);
  EXPECT_LT(*receivers[1].whole_ns - back_ns, 4 * kSecond);
}

TEST_F(SnapshotTransferTest, WhatDdsRepeatsNoLongerIsSentAgainSoonAfterALossOfSeconds) {
  for (const int lost_ms : {1'800, 2'200, 4'000}) {
    SCOPED_TRACE(lost_ms);
    start(static_cast<Frame>(lost_ms), 1500 * kPart, {1});
    receivers[1] = {};
    receivers[1].link = {.bytes_per_s = 6e6, .lifespan_ns = 300 * kMillisecond};
    run_ms(200);
    receivers[1].link.is_cut = true;
    run_ms(lost_ms);
    receivers[1].link.is_cut = false;
    const std::int64_t back_ns = now_ns;
    run_until_whole(1, 60'000);
    ASSERT_TRUE(receivers[1].whole_ns);
    EXPECT_LT(*receivers[1].whole_ns - back_ns, 4 * kSecond);
  }
}

TEST_F(SnapshotTransferTest, ALossOfAllFirstPartsCostsSomeRoundTrips) {
  // A burst takes them, and DDS gives them up before the link is good again.
  start(7, 60'000, {1});
  Receiver& receiver = receivers[1];
  receiver.link.delay_ns = 100 * kMillisecond;
  receiver.link.lifespan_ns = 0;
  receiver.link.is_cut = true;
  run_ms(150);
  receiver.link.is_cut = false;
  EXPECT_LT(run_until_whole(1, 20'000), 2'500);
}

TEST_F(SnapshotTransferTest, AServerWhoseFramesTakeLongStillFillsALink) {
  start(7, 15'000'000, {1});  // a million bodies
  receivers[1].link.bytes_per_s = 1e8;
  for (int frame = 0; frame < 100 && !receivers[1].whole_ns; ++frame) {
    for (const auto& [client, part] : send()) receivers.at(client).send(part, now_ns, random);
    for (int ms = 0; ms < 333; ++ms) {
      if (receivers[1].receive(now_ns)) due[1] = true;
      now_ns += kMillisecond;
    }
    if (due[1]) acknowledge(1);
  }
  ASSERT_TRUE(receivers[1].whole_ns);
  EXPECT_LT(*receivers[1].whole_ns - began_ns, 15 * kSecond);
}

TEST_F(SnapshotTransferTest, AFrameThatStandsStillIsOneSnapshot) {
  // While the server waits, inputs are scheduled, and a later cut of the same frame is longer by them.
  start(7, 50 * kPart, {1});
  receivers[1].link.bytes_per_s = 50'000;
  run_ms(400);
  ASSERT_GT(receivers[1].held.parts(), 0U);
  ASSERT_FALSE(receivers[1].whole_ns);
  start(7, 50 * kPart + 30, {1});
  EXPECT_LT(run_until_whole(1, 20'000), 10'000);
}

TEST_F(SnapshotTransferTest, ALinkWhoseRateFallsIsNotFlooded) {
  start(7, 300 * kPart, {1});
  receivers[1].link = {.bytes_per_s = 500'000, .queue_ns = 400 * kMillisecond};
  run_ms(200);
  receivers[1].link.bytes_per_s = 50'000;
  EXPECT_LT(run_until_whole(1, 30'000), 12'000);
  EXPECT_LT(receivers[1].sent_bytes, 2 * bytes.size());
}

TEST_F(SnapshotTransferTest, ALinkWhoseRateRisesIsFilled) {
  start(7, 1000 * kPart, {1});
  receivers[1].link = {.bytes_per_s = 50'000, .queue_ns = 400 * kMillisecond};
  run_ms(2'000);
  receivers[1].link.bytes_per_s = 500'000;
  EXPECT_LT(run_until_whole(1, 30'000), 8'000);
}

TEST_F(SnapshotTransferTest, AQueueThatDropsBeforeItDelaysIsNotFlooded) {
  start(7, 150 * kPart, {1});
  receivers[1].link = {.bytes_per_s = 125'000, .queue_ns = 50 * kMillisecond};
  EXPECT_LT(run_until_whole(1, 10'000), 4'000);
  EXPECT_LT(receivers[1].sent_bytes, 2 * bytes.size());
}

TEST_F(SnapshotTransferTest, AReceiverThatHoldsPartsIsServedAfterAPauseToo) {
  start(7, 100 * kPart, {1});
  run_ms(60);
  answers = false;
  run_ms(10'000);
  EXPECT_FALSE(transfer.serves(1, now_ns));
  answers = true;
  acknowledge(1);
  EXPECT_TRUE(transfer.serves(1, now_ns)) << "resumed, not restarted";
  EXPECT_LT(run_until_whole(1, 20'000), 20'000);
}

TEST_F(SnapshotTransferTest, WhoeverDropsWhatItHeldIsServedNoMore) {
  start(7, 10 * kPart, {1});
  run_ms(60);
  receivers[1].held.reject();
  acknowledge(1);
  EXPECT_FALSE(transfer.serves(1, now_ns));
  EXPECT_TRUE(transfer.idle());
}

// Damaged bytes make a receiver drop all that it holds. If it then takes the next part, it names the snapshot
// again.
TEST_F(SnapshotTransferTest, WhoeverDropsPartsAndGoesOnWithTheNextIsSentThemAgain) {
  start(7, 2 * kPart, {1});
  const auto parts = send();
  ASSERT_EQ(parts.size(), 2U);
  receivers[1].held.add(transport::SnapshotMessage(parts[0].part));
  acknowledge(1);
  receivers[1].held = SnapshotAssembly{std::size_t{1} << 26U};
  receivers[1].held.add(transport::SnapshotMessage(parts[1].part));
  acknowledge(1);
  EXPECT_LT(run_until_whole(1, 2'000), 2'000);
}

TEST_F(SnapshotTransferTest, WhoeverPlaysOrIsGoneIsForgotten) {
  start(7, 10 * kPart, {1, 2});
  send();
  accounts.at(1).phase = transport::Phase::kPlaying;
  accounts.at(2).present = false;
  send();
  EXPECT_TRUE(transfer.idle());
}

TEST_F(SnapshotTransferTest, MemoryIsFullWithSnapshotsOnTheirWayButNotWithThoseOfStalledReceivers) {
  constexpr std::size_t kLarge = SnapshotTransfer::kMaxHeldBytes / 2;
  start(7, kLarge, {1});
  EXPECT_FALSE(transfer.full(now_ns)) << "two of any size have room";
  start(8, kLarge, {2});
  EXPECT_TRUE(transfer.full(now_ns));
  now_ns += accounts::kHostTransfers.stalled_ns;
  EXPECT_FALSE(transfer.full(now_ns));
  start(9, kLarge, {3});
  EXPECT_FALSE(transfer.serves(1, now_ns));
}

TEST_F(SnapshotTransferTest, SenselessAcknowledgementsCostABoundedNumberOfParts) {
  start(7, 100 * kPart, {1});
  send();
  transport::AckMessage ack = acknowledgement(1);
  ack.snapshot_frame = 7;
  ack.snapshot_parts = 100;
  for (const auto& missing : std::vector<std::vector<std::uint32_t>>{
           {5}, {99, 1'000'000}, {4'000'000'000, 4'000'000'000}, {3, 0xFFFFFFFF, 0, 0xFFFFFFFF}, {7, 0}}) {
    ack.missing = missing;
    transfer.acknowledged(ack, now_ns);
    send();
  }
  // Holds one part more each time, and never the first one.
  std::uint64_t parts = 0;
  for (std::uint32_t i = 1; i < 200'000 && !transfer.idle(); ++i, now_ns += kMillisecond) {
    ack.missing = {0, 1, 1 + i % 99, 200};
    transfer.acknowledged(ack, now_ns);
    parts += send().size();
  }
  EXPECT_LT(parts * kPart, 6 * bytes.size() + 100'000);
  ack.snapshot_parts = 99;
  transfer.acknowledged(ack, now_ns);
  transfer.send({}, 0, now_ns);
  EXPECT_TRUE(transfer.idle());
}

}  // namespace
}  // namespace tandem::host
