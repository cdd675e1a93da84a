#include "sdk/transport/nats/nats_wire.hpp"

#include <gtest/gtest.h>

#include "sdk/transport/nats/nats_bus.hpp"

namespace tandem::transport::nats {
namespace {

Bytes bytes_of(std::size_t size) {
  Bytes bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::byte>(i * 7 + 1);
  return bytes;
}

TEST(NatsWire, AMessageThatFitsIsOnePacketWithSixBytesMore) {
  Packer packer(5);
  const auto& packets = packer.pack(bytes_of(1000), 64'000);
  ASSERT_EQ(packets.size(), 1U);
  EXPECT_EQ(packets[0].size(), 1006U);
  Unpacker unpacker;
  const auto whole = unpacker.take("a", packets[0]);
  ASSERT_TRUE(whole);
  EXPECT_EQ(whole->sender, 5U);
  EXPECT_EQ(Bytes(whole->message.begin(), whole->message.end()), bytes_of(1000));
}

TEST(NatsWire, ALargeMessageIsCutAndPutTogetherAgain) {
  Packer packer(5);
  Unpacker unpacker;
  for (int round = 0; round < 3; ++round) {
    const auto packets = packer.pack(bytes_of(200'001), 65'536);
    ASSERT_EQ(packets.size(), 4U);
    for (std::size_t i = 0; i < packets.size(); ++i) {
      EXPECT_LE(packets[i].size(), 64'000U);
      const auto whole = unpacker.take("a", packets[i]);
      ASSERT_EQ(whole.has_value(), i == 3);
      if (whole) {
        EXPECT_EQ(Bytes(whole->message.begin(), whole->message.end()), bytes_of(200'001));
      }
    }
  }
  EXPECT_EQ(unpacker.dropped(), 0U);
}

TEST(NatsWire, AMessageOfWhichAPieceIsMissingIsDropped) {
  Packer packer(5);
  const auto packets = packer.pack(bytes_of(1000), 300);
  Unpacker unpacker;
  for (std::size_t i = 0; i < packets.size(); ++i) {
    if (i != 1) {
      EXPECT_FALSE(unpacker.take("a", packets[i]));
    }
  }
  EXPECT_GT(unpacker.dropped(), 0U);
}

TEST(NatsWire, PacketsOfTwoSendersAreNotMixed) {
  Packer one(1), two(2);
  const auto a = one.pack(bytes_of(500), 300), b = two.pack(bytes_of(500), 300);
  Unpacker unpacker;
  EXPECT_FALSE(unpacker.take("s", a[0]));
  EXPECT_FALSE(unpacker.take("s", b[1]));
}

TEST(NatsWire, NoMessageGrowsBeyondItsLimit) {
  Packer packer(5);
  const auto packets = packer.pack(bytes_of(5000), 300);
  Unpacker unpacker(1000);
  for (const Bytes& packet : packets) EXPECT_FALSE(unpacker.take("a", packet));
}

TEST(NatsWire, AHelloHasTheNameOfASiteAndItsProof) {
  for (const Hello& hello : {Hello{"north", 0}, Hello{"north", 0xab}, Hello{"north", UINT64_MAX}}) {
    Bytes bytes;
    write(hello, bytes);
    const auto read = read_hello(bytes);
    ASSERT_TRUE(read);
    EXPECT_EQ(*read, hello);
  }
  for (const char* const text : {"", ".00000000000000ab", "a.", "a.ab", "a.zzzzzzzzzzzzzzzz",
                                 "a.00000000000000ab.", "a b", "a.0000000000000000"}) {
    Bytes bytes{std::byte{kHelloKind}};
    for (const char* c = text; *c != 0; ++c) bytes.push_back(static_cast<std::byte>(*c));
    EXPECT_FALSE(read_hello(bytes)) << text;
  }
  for (const std::size_t size : {1U, 8U, 9U, 10U}) {
    Bytes bytes(size, std::byte{5});
    bytes[0] = std::byte{kProofKind};
    EXPECT_EQ(read_proof(bytes).has_value(), size == 9) << size;
  }
}

TEST(NatsWire, BeatsAndRequestsKeepTheirContent) {
  const Beat beat{.epoch = 9,
                  .announcement = 77,
                  .leaving = true,
                  .inputs = {3, 5},
                  .streams = {{{0, 0}, {1, 900}}, {{1, 0}, {901, 900}}}};
  Bytes bytes;
  write(beat, bytes);
  EXPECT_EQ(read_beat(bytes).value(), beat);
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_FALSE(read_beat(std::span(bytes).first(size)).has_value()) << size;
  const Ask ask{.epoch = 9, .what = Ask::For::kDeltas, .stream = {1, 0}, .first = 10, .count = 1024};
  bytes.clear();
  write(ask, bytes);
  EXPECT_EQ(read_ask(bytes).value(), ask);
  bytes.clear();
  write(Ask{.epoch = 9, .what = Ask::For::kDeltas, .stream = {}, .first = 10, .count = 1025}, bytes);
  EXPECT_FALSE(read_ask(bytes).has_value());
}

TEST(NatsWire, SubjectsNameSessionSiteAndClient) {
  EXPECT_EQ(delta_subject("a.b", 3), "tandem.a~b.delta.3");
  EXPECT_EQ(to_subject("s", "north", 255), "tandem.s.to.north.00000000000000ff");
  const auto sender = read_from_subject("s", from_subject("s", "north", 255));
  ASSERT_TRUE(sender);
  EXPECT_EQ(sender->site, "north");
  EXPECT_EQ(sender->client, 255U);
  for (const char* wrong : {"tandem.s.from.north", "tandem.s.from.north.ff",
                            "tandem.s.from.no rth.00000000000000ff", "tandem.s.from.north.0000000000000000",
                            "tandem.t.from.north.00000000000000ff", "tandem.s.from.north.00000000000000fg"})
    EXPECT_FALSE(read_from_subject("s", wrong)) << wrong;
}

TEST(NatsWire, APasswordIsNotShown) {
  EXPECT_EQ(without_password("nats://user:secret@hub:4222,tls://a:b@c"),
            "nats://user:...@hub:4222,tls://a:...@c");
  EXPECT_EQ(without_password("nats://hub"), "nats://hub");
}

}  // namespace
}  // namespace tandem::transport::nats
