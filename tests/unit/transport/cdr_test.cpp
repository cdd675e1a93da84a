#include "sdk/wire/cdr.hpp"

#include <gtest/gtest.h>

#include "random_messages.hpp"

namespace tandem::transport {
namespace {

template <class M>
class Cdr : public ::testing::Test {};
using Messages =
    ::testing::Types<SessionMessage, DeltaMessage, ScheduledInputMessage, SnapshotMessage, ReplyMessage,
                     InputMessage, AckMessage, ServerStatusMessage, ClientStatusMessage, JournalMessage,
                     CheckpointMessage, StandbyMessage, CommandMessage>;
TYPED_TEST_SUITE(Cdr, Messages);

template <class M>
Bytes to_cdr(const M& message) {
  Bytes bytes;
  write_cdr(message, bytes);
  return bytes;
}

TYPED_TEST(Cdr, WhatIsWrittenIsRead) {
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    const auto message = RandomMessages(seed).make<TypeParam>();
    const auto read = read_cdr<TypeParam>(to_cdr(message));
    ASSERT_TRUE(read) << "seed " << seed << ": " << read.error().message;
    EXPECT_EQ(*read, message) << "seed " << seed;
  }
}

TYPED_TEST(Cdr, AMessageBehindOthersIsAlignedFromItsOwnHeader) {
  const auto message = RandomMessages(1).make<TypeParam>();
  Bytes bytes(3);
  write_cdr(message, bytes);
  EXPECT_EQ(Bytes(bytes.begin() + 3, bytes.end()), to_cdr(message));
}

TYPED_TEST(Cdr, AMessageCutShortOrLongerThanItsFieldsIsRefused) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Bytes bytes = to_cdr(RandomMessages(seed).make<TypeParam>());
    for (std::size_t size = 0; size < bytes.size(); ++size) {
      EXPECT_FALSE(read_cdr<TypeParam>(std::span(bytes).first(size))) << "seed " << seed << ", " << size;
    }
    bytes.push_back(std::byte{0});
    EXPECT_FALSE(read_cdr<TypeParam>(bytes)) << "seed " << seed;
  }
}

TYPED_TEST(Cdr, PaddingThatTheOptionsAnnounceIsTaken) {
  const auto message = RandomMessages(1).make<TypeParam>();
  Bytes bytes = to_cdr(message);
  bytes[3] = std::byte{2};
  EXPECT_FALSE(read_cdr<TypeParam>(bytes));
  bytes.resize(bytes.size() + 2);
  const auto read = read_cdr<TypeParam>(bytes);
  ASSERT_TRUE(read);
  EXPECT_EQ(*read, message);
}

TYPED_TEST(Cdr, AnotherEncapsulationIsRefused) {
  Bytes bytes = to_cdr(RandomMessages(1).make<TypeParam>());
  for (const unsigned kind : {0U, 2U, 3U, 7U}) {
    bytes[1] = static_cast<std::byte>(kind);
    const auto read = read_cdr<TypeParam>(bytes);
    ASSERT_FALSE(read);
    EXPECT_EQ(read.error().code, ErrorCode::kUnsupported);
  }
}

Bytes from_hex(std::string_view text) {
  Bytes bytes;
  std::string digits;
  for (const char c : text) {
    if (c == ' ') continue;
    digits += c;
    if (digits.size() < 2) continue;
    bytes.push_back(static_cast<std::byte>(std::stoi(digits, nullptr, 16)));
    digits.clear();
  }
  return bytes;
}

TEST(CdrBytes, AreThoseOfPlainCdr) {
  ScheduledInputMessage input;
  input.epoch = 0x0102030405060708;
  input.number = 1;
  input.frame = 2;
  input.source_client = 3;
  input.source_number = 4;
  input.kind = 5;
  input.values = {-1, 6};
  EXPECT_EQ(to_cdr(input), from_hex("00010000 0807060504030201 0100000000000000 0200000000000000"
                                    "0300000000000000 0400000000000000 05000000 02000000 ffffffff 06000000"));
}

TEST(CdrBytes, EightByteNumbersStandAtMultiplesOfEight) {
  ClientStatusMessage status;
  status.stream_reason = "ab";
  const Bytes bytes = to_cdr(status);
  // 3 x 8, 6 x 4, 4 x 8, 5 x 8, then two texts: length and bytes with NUL, and padding between them.
  ASSERT_EQ(bytes.size(), 4U + 24 + 24 + 32 + 40 + 4 + 1 + 3 + 4 + 3);
  EXPECT_EQ(Bytes(bytes.end() - 7, bytes.end()), from_hex("03000000 616200"));
  AckMessage ack;
  ack.join_attempt = 0x11111111;
  ack.clock_ns = 0x22;
  // 2 x 8, 4 x 4, 2 x 8, 2 x 4, and no padding before the clock.
  EXPECT_EQ(to_cdr(ack)[4 + 16 + 16 + 16 + 8], std::byte{0x22});
  ServerStatusMessage server;
  server.at_rest = 0x33333333;
  EXPECT_EQ(to_cdr(server)[4 + 13 * 8 + 4], std::byte{0x33});
}

TEST(CdrBytes, ATextEndsWithOneNul) {
  const std::string long_name(10, 'n');
  ClientStatusMessage status;
  status.stream_reason = long_name;
  Bytes bytes = to_cdr(status);
  ASSERT_TRUE(read_cdr<ClientStatusMessage>(bytes));
  Bytes unended = bytes;
  unended.back() = std::byte{'n'};
  EXPECT_FALSE(read_cdr<ClientStatusMessage>(unended));
  Bytes early = bytes;
  early[early.size() - 3] = std::byte{0};
  EXPECT_FALSE(read_cdr<ClientStatusMessage>(early));
  status.stream_reason = std::string("ab\0cd", 5);
  EXPECT_EQ(read_cdr<ClientStatusMessage>(to_cdr(status))->stream_reason, "ab");
}

TEST(CdrBytes, TheVersionOfASessionOfAnyLayoutIsRead) {
  SessionMessage session;
  session.epoch = 0x0102030405060708;
  session.protocol_version = 7;
  Bytes bytes = to_cdr(session);
  EXPECT_EQ(session_version(bytes), 7U);
  bytes.resize(kCdrHeaderBytes + 12);
  EXPECT_EQ(session_version(bytes), 7U) << "whatever follows";
  bytes.pop_back();
  EXPECT_EQ(session_version(bytes), std::nullopt);
  bytes.resize(kCdrHeaderBytes + 12);
  bytes[1] = std::byte{0};
  EXPECT_EQ(session_version(bytes), std::nullopt) << "big-endian";
}

TEST(CdrBytes, ACountWithoutElementsAllocatesNothing) {
  SessionMessage session;
  Bytes bytes = to_cdr(session);
  // The last word counts the names, those before it the streams and the types.
  for (const std::size_t from_end : {4U, 8U, 12U}) {
    Bytes forged = bytes;
    std::fill_n(forged.end() - static_cast<std::ptrdiff_t>(from_end), 4, std::byte{0xFF});
    EXPECT_FALSE(read_cdr<SessionMessage>(forged));
  }
}

TEST(CdrBytes, ParametersThatAreNotAllThereReadAsNoneThatALayoutMayHave) {
  SessionMessage session;
  session.types.resize(1);
  session.streams.resize(1);
  session.streams[0].layout.parameters.codec.threshold = 5;
  Bytes bytes = to_cdr(session);
  ASSERT_TRUE(valid_parameters(read_cdr<SessionMessage>(bytes)->streams[0].layout.parameters.codec));
  const Bytes first = from_hex("06000000 01000000 05000000");
  const auto at = std::search(bytes.begin(), bytes.end(), first.begin(), first.end());
  ASSERT_NE(at, bytes.end());
  at[4] = std::byte{9};
  const auto read = read_cdr<SessionMessage>(bytes);
  ASSERT_TRUE(read);
  EXPECT_FALSE(valid_parameters(read->streams[0].layout.parameters.codec));
}

}  // namespace
}  // namespace tandem::transport
