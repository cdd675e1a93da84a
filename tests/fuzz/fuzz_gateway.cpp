// Whatever viewers may write, in any order, to a gateway: one that behaves does not notice, and the server
// hears no more than one client may say.

#include <array>

#include "sdk/wire/envelope.hpp"
#include "services/gateway/gateway.hpp"
#include "tests/fuzz/program.hpp"
#include "tests/unit/gateway/fake_world.hpp"

namespace tandem::gateway {
namespace {

using fuzz::Program;
using fuzz::require;
using transport::Phase;

constexpr transport::ClientId kHonest = 200;
constexpr std::int64_t kPeriod = 33 * kMillisecond;

class Run {
 public:
  explicit Run(Program& program) : program_(program) {
    gateway_.on_session(fake_session());
    frame(kPeriod);
    honest_ = *gateway_.admit();
    say(honest_, ack(kHonest, Phase::kJoining));
    while (joining_) frame(kPeriod);
    for (ViewerId& stranger : strangers_) stranger = *gateway_.admit();
  }

  void play() {
    for (int step = 0; step < 128 && !program_.over(); ++step) event();
    transport::InputMessage input;
    input.client = kHonest;
    input.epoch = kEpoch;
    input.number = 1;
    input.kind = static_cast<std::uint32_t>(transport::InputKind::kGravity);
    input.values = {0, 0, -9};
    say(honest_, input);
    for (int i = 0; i < 40 && !acted_; ++i) frame(kPeriod);
    require(acted_);
    // A burst and a rate of each kind, as in InputMerger.
    const double seconds = static_cast<double>(now_ns_ - kStart) * 1e-9;
    require(static_cast<double>(world_.sent.size()) <= 31 + 50 * seconds);
    require(gateway_.viewers() <= 4);
  }

 private:
  static transport::AckMessage ack(transport::ClientId client, Phase phase) {
    transport::AckMessage message;
    message.client = client;
    message.epoch = kEpoch;
    message.phase = phase;
    message.role_wanted = transport::Role::kParticipant;
    message.join_attempt = 1;
    return message;
  }

  // The well-behaved viewer reads and acknowledges the next frame.
  void frame(std::int64_t later_ns) {
    now_ns_ += later_ns;
    client::CompleteDelta delta;
    delta.frame = ++world_.frame;
    gateway_.on_applied(delta, now_ns_);
    gateway_.poll(now_ns_);
    for (; acted_upon_ < world_.sent.size(); ++acted_upon_) {
      gateway_.on_outcome({client::InputOutcome::Kind::kActed, acted_upon_ + 1, world_.frame, 0, 0}, now_ns_);
    }
    if (honest_ == 0) return;
    for (auto next = gateway_.next(honest_, now_ns_); next.message; next = gateway_.next(honest_, now_ns_))
      read(*transport::read_gateway_envelope(next.message->envelope()));
    if (joining_) return;
    require(applied_ == world_.frame);
    auto message = ack(kHonest, Phase::kPlaying);
    message.applied = applied_;
    say(honest_, message);
  }

  void read(const transport::GatewayMessage& message) {
    if (const auto* part = std::get_if<transport::SnapshotMessage>(&message)) {
      joining_ = ++parts_ < part->parts;
      applied_ = part->frame + skipped_;
      auto holds = ack(kHonest, Phase::kJoining);
      holds.snapshot_frame = part->frame;
      holds.snapshot_parts = part->parts;
      if (joining_) holds.missing = {parts_, part->parts - parts_};
      say(honest_, holds);
    } else if (const auto* delta = std::get_if<transport::DeltaMessage>(&message)) {
      // While it joins, the snapshot's frame may not be known yet.
      require(joining_ || delta->frame == applied_ + 1);
      ++(joining_ ? skipped_ : applied_);
    } else if (const auto* reply = std::get_if<transport::ReplyMessage>(&message)) {
      require(reply->client == kHonest);
      for (const auto& entry : reply->entries) acted_ |= entry.number == 1 && entry.code == 0;
    }
  }

  template <class M>
  void say(ViewerId id, const M& message) {
    transport::Bytes bytes;
    transport::write_envelope(message, bytes);
    require(!gateway_.receive(id, bytes, now_ns_));
  }

  void event() {
    const std::size_t who = program_.u8() % strangers_.size();
    transport::Bytes bytes;
    switch (program_.u8() % 6) {
      case 0:
        bytes = program_.bytes(64);
        break;
      case 1:
      case 2:
        transport::write_envelope(an_ack(who), bytes);
        break;
      case 3:
        transport::write_envelope(an_input(who), bytes);
        break;
      case 4: {
        const auto next = gateway_.next(strangers_[who], now_ns_);
        if (next.message) require(transport::read_gateway_envelope(next.message->envelope()).has_value());
        return;
      }
      default:
        return frame(std::int64_t{program_.u8()} * kMillisecond);
    }
    if (program_.u8() % 4 == 0) program_.damage(bytes);
    if (!gateway_.receive(strangers_[who], bytes, now_ns_)) return;
    gateway_.leave(strangers_[who]);
    strangers_[who] = *gateway_.admit();
  }

  transport::AckMessage an_ack(std::size_t who) {
    auto message = ack(1 + who, static_cast<Phase>(program_.u8() % 2));
    const std::uint8_t change = program_.u8();
    if ((change & 1U) != 0) message.applied = program_.number();
    if ((change & 2U) != 0) message.join_attempt = program_.u8();
    if ((change & 4U) != 0) message.epoch = program_.number();
    if ((change & 8U) != 0) message.role_wanted = static_cast<transport::Role>(program_.u8() % 3);
    if ((change & 16U) != 0) message.snapshot_frame = program_.number();
    if ((change & 32U) != 0) message.snapshot_parts = static_cast<std::uint32_t>(program_.number());
    if ((change & 64U) != 0) message.missing.assign(program_.u8() % 4, program_.u8());
    if ((change & 128U) != 0) message.clock_ns = static_cast<std::int64_t>(program_.u64());
    return message;
  }

  transport::InputMessage an_input(std::size_t who) {
    transport::InputMessage message;
    message.client = 1 + who;
    message.epoch = kEpoch;
    message.number = program_.number();
    const std::uint8_t change = program_.u8();
    message.kind = change % 20;
    message.values.assign(change % 3 == 0 ? 7 : 3, program_.real());
    if ((change & 64U) != 0) message.epoch = program_.number();
    if ((change & 128U) != 0) message.bytes = program_.bytes(1100);
    return message;
  }

  Program& program_;
  FakeWorld world_;
  Gateway gateway_{{.viewers = 4, .queue_bytes = 65'536}, world_};
  std::int64_t now_ns_ = kStart;
  ViewerId honest_ = 0;
  std::array<ViewerId, 3> strangers_{};
  bool joining_ = true, acted_ = false;
  Frame applied_ = 0, skipped_ = 0;
  std::uint32_t parts_ = 0;
  std::size_t acted_upon_ = 0;
};

}  // namespace
}  // namespace tandem::gateway

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  tandem::fuzz::Program program(std::as_bytes(std::span(data, size)));
  tandem::gateway::Run(program).play();
  return 0;
}
