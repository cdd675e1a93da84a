#pragma once
// A session as a test wants it, and viewers that are envelopes.

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "sdk/wire/envelope.hpp"
#include "services/gateway/gateway.hpp"

namespace tandem::gateway {

inline constexpr std::int64_t kStart = 1000 * kSecond;
inline constexpr Epoch kEpoch = 77;

class FakeWorld final : public following::FollowedWorld {
 public:
  struct Sent {
    transport::InputKind kind;
    std::vector<double> values;
  };

  [[nodiscard]] bool playing() const override { return plays; }
  [[nodiscard]] transport::Role role() const override { return granted; }
  [[nodiscard]] bool inputs_settled() const override { return settled; }
  [[nodiscard]] std::optional<std::int64_t> server_time_ns(std::int64_t now_ns) const override {
    return now_ns + kSecond;
  }
  [[nodiscard]] std::optional<Cut> cut() override {
    if (!plays) return std::nullopt;
    ++cuts;
    return Cut{.stream = {}, .frame = frame, .last_input = last_input, .bytes = snapshot};
  }
  Result<std::uint64_t> send(transport::InputKind kind, std::vector<double> values,
                             transport::Bytes /*bytes*/, std::int64_t /*now_ns*/) override {
    if (!plays) return fail(ErrorCode::kOutOfOrder, "not playing");
    sent.push_back({kind, std::move(values)});
    return sent.size();
  }
  void report(const transport::ClientStatusMessage& status) override { reported.push_back(status); }

  bool plays = true;
  bool settled = true;
  transport::Role granted = transport::Role::kParticipant;
  Frame frame = 0;
  std::uint64_t last_input = 0;
  transport::Bytes snapshot = transport::Bytes(15'000);
  int cuts = 0;
  std::vector<Sent> sent;
  std::vector<transport::ClientStatusMessage> reported;
};

inline transport::SessionMessage fake_session(Epoch epoch = kEpoch) {
  transport::SessionMessage session;
  session.session = "default";
  session.epoch = epoch;
  session.scene = "scene";
  session.capacity = 10;
  session.lattice_unit = 0.01;
  session.types.resize(1);
  session.streams.resize(1);
  session.streams[0].max_delta_bytes = 1U << 20U;
  session.streams[0].max_snapshot_bytes = 1U << 20U;
  return session;
}

class GatewayTest : public ::testing::Test {
 protected:
  explicit GatewayTest(Limits limits = {}) : gateway(limits, world) {}

  void frame(std::size_t bytes = 100, std::int64_t later_ns = 33 * kMillisecond) {
    now_ns += later_ns;
    client::CompleteDelta delta;
    delta.frame = ++world.frame;
    delta.last_input = world.last_input;
    delta.payload.resize(bytes);
    gateway.on_applied(delta, now_ns);
    gateway.poll(now_ns);
  }
  void later(std::int64_t ns) {
    now_ns += ns;
    gateway.poll(now_ns);
  }
  template <class M>
  std::optional<Refusal> say(ViewerId id, const M& message) {
    transport::Bytes bytes;
    transport::write_envelope(message, bytes);
    return gateway.receive(id, bytes, now_ns);
  }
  [[nodiscard]] static transport::AckMessage ack(transport::ClientId client, transport::Phase phase,
                                                 std::uint32_t attempt = 1) {
    transport::AckMessage message;
    message.client = client;
    message.epoch = kEpoch;
    message.phase = phase;
    message.role_wanted = transport::Role::kParticipant;
    message.join_attempt = attempt;
    message.clock_ns = 5;
    return message;
  }
  [[nodiscard]] transport::InputMessage input(transport::ClientId client, std::uint64_t number,
                                              std::vector<double> values = {0, 0, -9}) const {
    transport::InputMessage message;
    message.client = client;
    message.epoch = kEpoch;
    message.number = number;
    message.kind = static_cast<std::uint32_t>(values.size() == 3 ? transport::InputKind::kGravity
                                                                 : transport::InputKind::kPush);
    message.values = std::move(values);
    return message;
  }
  /// All messages that a viewer gets now if it reads.
  std::vector<transport::GatewayMessage> read(ViewerId id) {
    std::vector<transport::GatewayMessage> messages;
    for (auto next = gateway.next(id, now_ns); next.message; next = gateway.next(id, now_ns)) {
      auto message = transport::read_gateway_envelope(next.message->envelope());
      EXPECT_TRUE(message) << message.error().message;
      if (message) messages.push_back(std::move(*message));
    }
    return messages;
  }
  template <class M>
  static std::vector<M> only(const std::vector<transport::GatewayMessage>& messages) {
    std::vector<M> found;
    for (const auto& message : messages) {
      if (const M* one = std::get_if<M>(&message)) found.push_back(*one);
    }
    return found;
  }
  /// A viewer that has joined and holds the snapshot. Its client id is `client`.
  ViewerId join(transport::ClientId client) {
    const ViewerId id = *gateway.admit();
    EXPECT_FALSE(say(id, ack(client, transport::Phase::kJoining)));
    later(accounts::kSnapshotSpacingNs);
    std::uint32_t held = 0, parts = 1;
    while (held < parts) {
      for (const auto& part : only<transport::SnapshotMessage>(read(id))) {
        EXPECT_EQ(part.part, held++);
        parts = part.parts;
      }
      auto holds = ack(client, transport::Phase::kJoining);
      holds.snapshot_frame = world.frame;
      holds.snapshot_parts = parts;
      if (held < parts) holds.missing = {held, parts - held};
      now_ns += 20 * kMillisecond;
      EXPECT_FALSE(say(id, holds));
    }
    plays(id, client);
    read(id);
    return id;
  }
  void plays(ViewerId id, transport::ClientId client) {
    auto message = ack(client, transport::Phase::kPlaying);
    message.applied = world.frame;
    EXPECT_FALSE(say(id, message));
  }
  /// The outcomes and the like that a viewer is told next.
  transport::ReplyMessage reply(ViewerId id) {
    now_ns += 200 * kMillisecond;
    const auto replies = only<transport::ReplyMessage>(read(id));
    EXPECT_FALSE(replies.empty());
    return replies.empty() ? transport::ReplyMessage() : replies.back();
  }
  void acts(std::uint64_t number, Frame on_frame) {
    gateway.on_outcome({client::InputOutcome::Kind::kActed, number, on_frame, 0, 0}, now_ns);
  }

  FakeWorld world;
  Gateway gateway;
  std::int64_t now_ns = kStart;
};

}  // namespace tandem::gateway
