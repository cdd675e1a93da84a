#include "sdk/wire/envelope.hpp"

#include <gtest/gtest.h>

#include <type_traits>

#include "random_messages.hpp"

namespace tandem::transport::of_envelope {
namespace {

template <class M>
constexpr bool kFromViewer = std::is_constructible_v<ViewerMessage, M>;

/// Makes a message of random content. Fields that random numbers would hardly ever put within the limits are
/// set.
template <class M>
M lawful(std::uint64_t seed) {
  auto message = RandomMessages(seed).make<M>();
  if constexpr (requires { message.client; }) message.client |= 1U;
  if constexpr (requires { message.role; }) message.role = {};
  if constexpr (requires { message.phase; }) message.phase = {};
  if constexpr (requires { message.session; }) message.session = "arena";
  if constexpr (requires { message.server_role; }) message.server_role = {};
  if constexpr (requires { message.texts; }) message.texts = {{seed, "beyond 100"}};
  if constexpr (requires { message.stream_reason; }) message.stream_reason = "the only one";
  if constexpr (requires { message.part; }) {
    message.part = 0;
    message.parts = 1;
  }
  if constexpr (std::is_same_v<M, SessionMessage>) {
    message = {};
    message.session = "arena";
    message.capacity = 5;
    message.lattice_unit = 1;
    message.types.resize(1);
    message.streams.resize(1);
    message.names = {{1, 2, "crane"}};
  } else if constexpr (std::is_same_v<M, DeltaMessage>) {
    message.frame |= 8U;
    message.earlier = seed % 2 == 0 ? 5 : 0;
  } else if constexpr (std::is_same_v<M, ScheduledInputMessage>) {
    message.number |= 1U;
  } else if constexpr (std::is_same_v<M, SnapshotMessage>) {
    message.bytes.resize(9);
    message.total_bytes = 9;
  } else if constexpr (std::is_same_v<M, AckMessage>) {
    message.role_wanted = {};
    message.max_delay_ms = static_cast<std::uint32_t>(seed % 1001);
    message.missing = {1, 2};
  } else if constexpr (std::is_same_v<M, InputMessage>) {
    message.values.resize(7);
    message.bytes.resize(9);
  }
  return message;
}

template <class M>
Bytes envelope(const M& message) {
  Bytes bytes;
  write_envelope(message, bytes);
  return bytes;
}

template <class M>
auto read(std::span<const std::byte> bytes) {
  if constexpr (kFromViewer<M>) {
    return read_viewer_envelope(bytes);
  } else {
    return read_gateway_envelope(bytes);
  }
}

template <class M>
class Envelope : public ::testing::Test {};
using Messages =
    ::testing::Types<SessionMessage, DeltaMessage, ScheduledInputMessage, SnapshotMessage, ReplyMessage,
                     ServerStatusMessage, AckMessage, InputMessage, ClientStatusMessage>;
TYPED_TEST_SUITE(Envelope, Messages);

TYPED_TEST(Envelope, WhatIsWrittenIsRead) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const auto message = lawful<TypeParam>(seed);
    const auto received = read<TypeParam>(envelope(message));
    ASSERT_TRUE(received) << "seed " << seed << ": " << received.error().message;
    ASSERT_TRUE(std::holds_alternative<TypeParam>(*received)) << "seed " << seed;
    // Sessions get what their streams share from the session.
    if constexpr (!std::is_same_v<TypeParam, SessionMessage>) {
      EXPECT_EQ(std::get<TypeParam>(*received), message) << "seed " << seed;
    }
  }
}

TYPED_TEST(Envelope, IsTheKindAndTheCdrBytes) {
  const auto message = lawful<TypeParam>(1);
  const Bytes bytes = envelope(message);
  Bytes cdr;
  write_cdr(message, cdr);
  EXPECT_EQ(Bytes(bytes.begin() + 1, bytes.end()), cdr);
  EXPECT_EQ(std::to_integer<unsigned>(bytes[0]) >= 16, kFromViewer<TypeParam>);
}

TYPED_TEST(Envelope, OneCutShortIsRefused) {
  const Bytes bytes = envelope(lawful<TypeParam>(1));
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_FALSE(read<TypeParam>(std::span(bytes).first(size))) << size;
  }
}

TYPED_TEST(Envelope, OneOfTheOtherDirectionIsNotTaken) {
  const Bytes bytes = envelope(lawful<TypeParam>(1));
  if constexpr (kFromViewer<TypeParam>) {
    const auto received = read_gateway_envelope(bytes);
    ASSERT_TRUE(received);
    EXPECT_TRUE(std::holds_alternative<UnknownMessage>(*received));
  } else {
    const auto received = read_viewer_envelope(bytes);
    ASSERT_FALSE(received);
    EXPECT_EQ(received.error().code, ErrorCode::kUnsupported);
  }
}

TEST(Envelope, OfAnAbsentServerHasNoBody) {
  Bytes bytes = envelope(AbsentMessage{});
  EXPECT_EQ(bytes, Bytes{std::byte{7}});
  const auto received = read_gateway_envelope(bytes);
  ASSERT_TRUE(received);
  EXPECT_TRUE(std::holds_alternative<AbsentMessage>(*received));
  bytes.push_back(std::byte{0});
  EXPECT_FALSE(read_gateway_envelope(bytes));
}

TEST(Envelope, OfAnUnknownKindIsSkippedByViewersAndRefusedByGateways) {
  const Bytes bytes{std::byte{15}, std::byte{1}};
  const auto received = read_gateway_envelope(bytes);
  ASSERT_TRUE(received);
  EXPECT_EQ(std::get<UnknownMessage>(*received).kind, 15);
  EXPECT_FALSE(read_viewer_envelope(bytes));
}

TEST(Envelope, WhatIsBeyondALimitIsRefused) {
  DeltaMessage delta;
  delta.payload.resize(11);
  EXPECT_TRUE(read_gateway_envelope(envelope(delta), {.max_delta_bytes = 11}));
  EXPECT_FALSE(read_gateway_envelope(envelope(delta), {.max_delta_bytes = 10}));
  AckMessage ack;
  ack.client = 0;
  EXPECT_FALSE(read_viewer_envelope(envelope(ack)));
}

}  // namespace
}  // namespace tandem::transport::of_envelope
