#include "sdk/transport/websocket/web_port.hpp"

#include <gtest/gtest.h>

namespace tandem::transport {
namespace {

template <class M>
Bytes envelope(const M& message) {
  Bytes bytes;
  write_envelope(message, bytes);
  return bytes;
}

SessionMessage session(Epoch epoch = 5) {
  SessionMessage message;
  message.session = "arena";
  message.epoch = epoch;
  message.capacity = 1;
  message.lattice_unit = 1;
  message.types.resize(1);
  message.streams.resize(1);
  message.streams[0].max_delta_bytes = message.streams[0].max_snapshot_bytes = 100;
  return message;
}

DeltaMessage delta(std::size_t payload_bytes = 10) {
  DeltaMessage message;
  message.frame = 7;
  message.payload.resize(payload_bytes);
  return message;
}

AckMessage ack() {
  AckMessage message;
  message.client = 1;
  return message;
}

template <class M>
std::vector<Received<M>> take(WebPort& port) {
  std::vector<Received<M>> out;
  if constexpr (std::is_same_v<M, SessionMessage>) {
    port.take_sessions(out);
  } else {
    port.take(out);
  }
  return out;
}

class WebPortTest : public ::testing::Test {
 protected:
  void open() {
    port.connected();
    ASSERT_TRUE(port.receive(envelope(session())));
    ASSERT_EQ(take<SessionMessage>(port).size(), 1U);
    ASSERT_TRUE(port.open_stream(session(), session().streams[0], 1));
  }
  WebPort port;
};

TEST_F(WebPortTest, AnAnnouncementIsTakenOnceAndTheServerLives) {
  port.connected();
  EXPECT_FALSE(port.server_alive());
  ASSERT_TRUE(port.receive(envelope(session())));
  EXPECT_TRUE(port.server_alive());
  const auto taken = take<SessionMessage>(port);
  ASSERT_EQ(taken.size(), 1U);
  EXPECT_EQ(taken[0].message.epoch, 5U);
  EXPECT_TRUE(take<SessionMessage>(port).empty());
}

TEST_F(WebPortTest, MessagesOfAStreamAreTakenOnceItIsOpen) {
  port.connected();
  ASSERT_TRUE(port.receive(envelope(delta())));
  open();
  EXPECT_TRUE(take<DeltaMessage>(port).empty()) << "from before it was open";
  ASSERT_TRUE(port.receive(envelope(delta())));
  const auto taken = take<DeltaMessage>(port);
  ASSERT_EQ(taken.size(), 1U);
  EXPECT_EQ(taken[0].message, delta());
  EXPECT_TRUE(take<DeltaMessage>(port).empty());
  port.close_streams();
  ASSERT_TRUE(port.receive(envelope(delta())));
  EXPECT_TRUE(take<DeltaMessage>(port).empty());
}

TEST_F(WebPortTest, SnapshotsComeWhileTheyAreOpenAlone) {
  open();
  SnapshotMessage part;
  part.total_bytes = 3;
  part.bytes.resize(3);
  ASSERT_TRUE(port.receive(envelope(part)));
  EXPECT_TRUE(take<SnapshotMessage>(port).empty());
  ASSERT_TRUE(port.open_snapshots(0));
  ASSERT_TRUE(port.receive(envelope(part)));
  EXPECT_EQ(take<SnapshotMessage>(port).size(), 1U);
}

TEST_F(WebPortTest, LimitsOfTheStreamHold) {
  open();
  EXPECT_TRUE(port.receive(envelope(delta(100))));
  EXPECT_FALSE(port.receive(envelope(delta(101))));
  EXPECT_EQ(port.dropped(), 1U);
}

TEST_F(WebPortTest, AQueueThatIsFullDropsAndCounts) {
  port.connected();
  StreamMessage stream = session().streams[0];
  stream.max_delta_bytes = 40U << 20U;
  ASSERT_TRUE(port.open_stream(session(), stream, 1));
  const Bytes large = envelope(delta(40U << 20U));
  EXPECT_TRUE(port.receive(large));
  EXPECT_EQ(port.receive(large).error().code, ErrorCode::kCapacity);
  EXPECT_EQ(port.dropped(), 1U);
  EXPECT_EQ(take<DeltaMessage>(port).size(), 1U);
  EXPECT_TRUE(port.receive(large)) << "there is room again";
}

TEST_F(WebPortTest, EachConnectionIsAnotherParticipant) {
  open();
  ASSERT_TRUE(port.receive(envelope(delta())));
  const auto first = take<DeltaMessage>(port)[0].from;
  ASSERT_TRUE(port.receive(envelope(delta())));
  port.disconnected();
  EXPECT_FALSE(port.server_alive());
  EXPECT_TRUE(take<DeltaMessage>(port).empty()) << "of the old connection";
  open();
  ASSERT_TRUE(port.receive(envelope(delta())));
  EXPECT_NE(take<DeltaMessage>(port)[0].from, first);
}

TEST_F(WebPortTest, WhatIsOpenStaysSoOverAnotherConnection) {
  open();
  port.disconnected();
  EXPECT_TRUE(port.hears_all_servers());
  port.connected();
  ASSERT_TRUE(port.receive(envelope(session())));
  ASSERT_EQ(take<SessionMessage>(port).size(), 1U);
  ASSERT_TRUE(port.receive(envelope(delta())));
  EXPECT_FALSE(port.receive(envelope(delta(101)))) << "with its limits";
  EXPECT_EQ(take<DeltaMessage>(port).size(), 1U);
  port.connected(true);
  EXPECT_FALSE(port.hears_all_servers()) << "it has to be joined";
}

TEST_F(WebPortTest, WritesAreQueuedInOrderWhileThereIsAServer) {
  EXPECT_FALSE(port.write(ack()));
  port.connected();
  EXPECT_FALSE(port.write(ack())) << "nothing of an older session may go out";
  ASSERT_TRUE(port.receive(envelope(session())));
  EXPECT_FALSE(port.write(ack())) << "the client does not know yet whom it writes to";
  open();
  EXPECT_TRUE(port.write(ack()));
  InputMessage input;
  input.client = 1;
  EXPECT_TRUE(port.write(input));
  EXPECT_EQ(port.next_message(), envelope(ack()));
  EXPECT_EQ(port.next_message(), envelope(input));
  EXPECT_FALSE(port.next_message());
  ASSERT_TRUE(port.receive(envelope(AbsentMessage{})));
  EXPECT_FALSE(port.server_alive());
  EXPECT_FALSE(port.write(ack()));
}

TEST_F(WebPortTest, WhatNobodySendsIsBounded) {
  open();
  for (std::size_t i = 0; i < WebPort::kMaxQueuedOut; ++i) ASSERT_TRUE(port.write(ack()));
  EXPECT_FALSE(port.write(ack()));
}

TEST_F(WebPortTest, BytesThatAreNoMessageAreCountedAndUnknownKindsSkipped) {
  open();
  EXPECT_FALSE(port.receive({}));
  EXPECT_FALSE(port.receive(Bytes(5, std::byte{2})));
  EXPECT_TRUE(port.receive(Bytes(5, std::byte{14})));
  EXPECT_EQ(port.dropped(), 2U);
}

TEST_F(WebPortTest, TheServersStatusIsThatOfTheConnection) {
  open();
  ServerStatusMessage status;
  status.session = "arena";
  status.frame = 9;
  ASSERT_TRUE(port.receive(envelope(status)));
  ASSERT_TRUE(port.server_status());
  EXPECT_EQ(port.server_status()->frame, 9U);
  port.disconnected();
  EXPECT_FALSE(port.server_status());
}

}  // namespace
}  // namespace tandem::transport
