#include "services/host/snapshot_transfer.hpp"

#include <gtest/gtest.h>

#include "sdk/client/snapshot_assembly.hpp"
#include "sdk/transport/limits.hpp"

namespace tandem::host {
namespace {

using accounts::TransferWindow;

constexpr Epoch kEpoch = 5;
constexpr StreamId kStream{2, 3};
constexpr std::size_t kPart = SnapshotTransfer::kLeastPartBytes;
using transport::ClientId;

std::vector<std::byte> content(std::size_t size) {
  std::vector<std::byte> bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::byte>(i % 251);
  return bytes;
}

/// A server, joiners, and a link of so many bytes a second between them that keeps whatever it is given.
class SnapshotTransferTest : public ::testing::Test {
 protected:
  void start(Frame frame, std::size_t size, std::initializer_list<ClientId> receivers) {
    for (const ClientId client : receivers) join(client);
    transfer.start(kEpoch, kStream, frame, bytes = content(size), receivers, now_ns);
  }
  void join(ClientId client) {
    Account& account = accounts[client];
    account.id = client;
    account.stream = kStream.id;
    account.phase = transport::Phase::kJoining;
    assemblies.try_emplace(client, std::size_t{1} << 24U);
  }
  std::vector<transport::SnapshotMessage> send() {
    transfer.send(accounts, now_ns);
    std::vector<transport::SnapshotMessage> out;
    while (const auto message = outbox.pop(std::chrono::nanoseconds{0})) {
      out.push_back(std::get<transport::SnapshotMessage>(*message));
    }
    return out;
  }
  void acknowledge(ClientId client) {
    const client::SnapshotAssembly& held = assemblies.at(client);
    transport::AckMessage ack;
    ack.client = client;
    ack.stream = kStream;
    ack.snapshot_frame = held.frame();
    ack.snapshot_parts = held.parts();
    ack.missing = held.missing();
    transfer.acknowledged(ack, now_ns);
  }
  void deliver(const transport::SnapshotMessage& part) {
    for (auto& [client, assembly] : assemblies) {
      if (assembly.add(transport::SnapshotMessage(part)) == client::SnapshotAssembly::Outcome::kStored)
        acknowledge(client);
    }
  }
  /// Milliseconds until `client` has all of it, at most `most_ms`; `rate` in bytes a second, one way 10 ms.
  /// What would wait for longer than `queue_ns` is dropped.
  int run_until_whole(ClientId client, double rate, int most_ms, std::int64_t queue_ns = INT64_MAX) {
    struct Flying {
      std::int64_t at_ns;
      transport::SnapshotMessage part;
    };
    std::deque<Flying> link;
    std::int64_t free_ns = now_ns;  // when the link has sent what it was given
    for (int ms = 0; ms < most_ms; ++ms) {
      for (auto& part : send()) {
        sent_bytes += part.bytes.size();
        if (free_ns - now_ns > queue_ns) continue;
        free_ns = std::max(free_ns, now_ns) +
                  static_cast<std::int64_t>(static_cast<double>(part.bytes.size()) / rate * 1e9);
        longest_queue_ns = std::max(longest_queue_ns, free_ns - now_ns);
        link.push_back({free_ns + 10 * kMillisecond, std::move(part)});
      }
      while (!link.empty() && link.front().at_ns <= now_ns) {
        deliver(link.front().part);
        link.pop_front();
      }
      if (assemblies.at(client).take()) return ms;
      now_ns += kMillisecond;
    }
    return most_ms;
  }

  Outbox outbox{{}};
  SnapshotTransfer transfer{outbox};
  std::map<ClientId, Account> accounts;
  std::map<ClientId, client::SnapshotAssembly> assemblies;
  std::vector<std::byte> bytes;
  std::int64_t now_ns = 77 * kSecond;
  std::int64_t longest_queue_ns = 0;
  std::size_t sent_bytes = 0;
};

TEST_F(SnapshotTransferTest, PartsAreConsecutiveCutsThatTellWhatTheyBelongTo) {
  start(7, 2 * kPart + 1, {1});
  std::vector<std::byte> joined;
  for (std::uint32_t i = 0; i < 3; ++i) {
    auto sent = send();
    while (sent.empty()) sent = send();
    for (const auto& part : sent) {
      EXPECT_EQ(part.epoch, kEpoch);
      EXPECT_EQ(part.stream, kStream);
      EXPECT_EQ(part.frame, 7U);
      EXPECT_EQ(part.parts, 3U);
      EXPECT_EQ(part.total_bytes, bytes.size());
      joined.insert(joined.end(), part.bytes.begin(), part.bytes.end());
      deliver(part);
    }
    if (joined.size() == bytes.size()) break;
  }
  EXPECT_EQ(joined, bytes);
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
  const double rate = 256'000 / 8.0;
  const int took_ms = run_until_whole(1, rate, 20'000);
  EXPECT_LT(took_ms, 1.2 * 1000 * 100'000 / rate);
  EXPECT_LT(longest_queue_ns, 400 * kMillisecond);
  EXPECT_EQ(sent_bytes, 100'000U);
}

TEST_F(SnapshotTransferTest, AFastLinkIsFilledSoon) {
  start(7, 10'000'000, {1});
  EXPECT_LT(run_until_whole(1, 1e8, 20'000), 1'000);
  EXPECT_EQ(sent_bytes, 10'000'000U);
}

TEST_F(SnapshotTransferTest, TheSlowestReceiverSetsThePace) {
  start(7, 100 * kPart, {1, 2});
  for (int i = 0; i < 10; ++i) {
    for (const auto& part : send()) {
      if (assemblies.at(1).add(transport::SnapshotMessage(part)) ==
          client::SnapshotAssembly::Outcome::kStored)
        acknowledge(1);
    }
    now_ns += 10 * kMillisecond;
  }
  EXPECT_EQ(transfer.bytes(), TransferWindow::kFirst) << "2 got nothing yet";
}

TEST_F(SnapshotTransferTest, WhatDoesNotArriveIsSentAgainAndOnlyThat) {
  start(7, 4 * kPart, {1});
  auto sent = send();
  ASSERT_EQ(sent.size(), 2U);
  deliver(sent[1]);
  std::vector<std::uint32_t> parts;
  for (int i = 0; i < 40; ++i) {
    now_ns += 100 * kMillisecond;
    for (const auto& part : send()) {
      parts.push_back(part.part);
      deliver(part);
    }
  }
  EXPECT_EQ(parts, (std::vector<std::uint32_t>{2, 3, 0}));
  EXPECT_TRUE(assemblies.at(1).take());
}

TEST_F(SnapshotTransferTest, WhatLaterPartsOvertookIsSentAgainAtOnce) {
  start(7, 100 * kPart, {1});
  for (int i = 0; i < 2; ++i, now_ns += 30 * kMillisecond) {
    for (const auto& part : send()) deliver(part);
  }
  const auto sent = send();
  ASSERT_GT(sent.size(), 1U);
  const std::uint32_t lost = sent[0].part;
  now_ns += 30 * kMillisecond;
  for (std::size_t i = 1; i < sent.size(); ++i) deliver(sent[i]);
  const auto later = send();
  ASSERT_FALSE(later.empty());
  EXPECT_NE(later[0].part, lost) << "of those sent together one may come after another";
  now_ns += 30 * kMillisecond;
  for (const auto& part : later) deliver(part);
  const auto again = send();
  ASSERT_FALSE(again.empty());
  EXPECT_EQ(again[0].part, lost);
}

TEST_F(SnapshotTransferTest, AQueueThatDropsBeforeItDelaysIsNotFlooded) {
  start(7, 150 * kPart, {1});
  constexpr double kRate = 125'000;  // 1 Mbit/s: 1.6 s for all
  EXPECT_LT(run_until_whole(1, kRate, 10'000, 50 * kMillisecond), 4'000);
  EXPECT_LT(sent_bytes, 2 * bytes.size());
}

TEST_F(SnapshotTransferTest, AReceiverThatHoldsPartsIsServedAfterAPauseToo) {
  start(7, 100 * kPart, {1});
  for (const auto& part : send()) deliver(part);
  now_ns += 10 * kSecond;
  EXPECT_FALSE(transfer.serves(1, now_ns));
  EXPECT_FALSE(transfer.busy(now_ns));
  acknowledge(1);
  EXPECT_TRUE(transfer.serves(1, now_ns)) << "resumed, not restarted";
  EXPECT_EQ(run_until_whole(1, 1e6, 10'000) < 10'000, true);
}

TEST_F(SnapshotTransferTest, WhoDropsWhatItHeldIsServedNoMore) {
  start(7, 10 * kPart, {1});
  for (const auto& part : send()) deliver(part);
  assemblies.at(1).reject();
  acknowledge(1);
  EXPECT_FALSE(transfer.serves(1, now_ns));
  EXPECT_FALSE(transfer.busy(now_ns));
}

TEST_F(SnapshotTransferTest, WhoPlaysOrIsGoneIsForgotten) {
  start(7, 10 * kPart, {1, 2});
  send();
  accounts.at(1).phase = transport::Phase::kPlaying;
  accounts.at(2).present = false;
  send();
  EXPECT_FALSE(transfer.busy(now_ns));
}

TEST_F(SnapshotTransferTest, ALaterJoinerThatNamesItIsServedToo) {
  start(7, 3 * kPart, {1});
  for (int i = 0; i < 10 && !assemblies.at(1).take(); ++i) {
    for (const auto& part : send()) deliver(part);
  }
  join(2);
  transport::SnapshotMessage last;
  last.epoch = kEpoch;
  last.stream = kStream;
  last.frame = 7;
  last.part = 2;
  last.parts = 3;
  last.total_bytes = static_cast<std::uint32_t>(3 * kPart);
  last.bytes.assign(bytes.begin() + 2 * kPart, bytes.end());
  assemblies.at(2).add(std::move(last));
  acknowledge(2);
  now_ns += 2 * kSecond;
  run_until_whole(2, 1e6, 5'000);
  EXPECT_TRUE(assemblies.at(2).missing().empty());
}

TEST_F(SnapshotTransferTest, OneThatTakesTooLongDoesNotKeepOthersWaiting) {
  start(7, 100 * kPart, {1});
  for (int i = 0; i < 59; ++i) {
    for (const auto& part : send()) {
      if (part.part * 2 <= static_cast<std::uint32_t>(i)) deliver(part);  // a part every two seconds
    }
    EXPECT_TRUE(transfer.busy(now_ns)) << i;
    now_ns += kSecond;
  }
  now_ns += kSecond;
  EXPECT_FALSE(transfer.busy(now_ns));
}

TEST_F(SnapshotTransferTest, SenselessAcknowledgementsChangeNothingThatIsWrong) {
  start(7, 100 * kPart, {1});
  send();
  transport::AckMessage ack;
  ack.client = 1;
  ack.stream = kStream;
  ack.snapshot_frame = 7;
  ack.snapshot_parts = 100;
  for (const auto& missing : std::vector<std::vector<std::uint32_t>>{
           {5}, {99, 1'000'000}, {4'000'000'000, 4'000'000'000}, {3, 0xFFFFFFFF, 0, 0xFFFFFFFF}, {7, 0}}) {
    ack.missing = missing;
    transfer.acknowledged(ack, now_ns);
    send();
  }
  ack.snapshot_parts = 99;
  transfer.acknowledged(ack, now_ns);
  transfer.send({}, now_ns);
  EXPECT_FALSE(transfer.busy(now_ns));
}

}  // namespace
}  // namespace tandem::host
