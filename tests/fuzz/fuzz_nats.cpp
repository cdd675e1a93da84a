// Whatever arrives over NATS, at a relay and at who follows it: frames are handed on in order, each once, and
// what was read of a rule-keeping message is what was written.

#include <array>
#include <string>

#include "sdk/transport/nats/nats_client_port.hpp"
#include "sdk/transport/nats/nats_server_port.hpp"
#include "sdk/wire/envelope.hpp"
#include "tests/fuzz/program.hpp"
#include "tests/unit/relay/fake_nats.hpp"

namespace tandem::transport {
namespace {

using fuzz::Program;
using fuzz::require;

constexpr Epoch kEpoch = 1000;
constexpr ClientId kHonest = 0xab;

class Run {
 public:
  explicit Run(Program& program) : program_(program) {
    session_.session = "default";
    session_.epoch = kEpoch;
    session_.capacity = 16;
    StreamMessage stream;
    stream.max_delta_bytes = 4096;
    stream.max_snapshot_bytes = 4096;
    session_.streams = {stream};
    require(relay_.open_streams(1).has_value() && relay_.write(session_).has_value());
    for (int i = 0; i < 20; ++i) pass(20 * kMillisecond);
    require(follower_.open_stream(session_, session_.streams[0], kHonest).has_value());
    frame();
  }

  void play() {
    for (int step = 0; step < 96 && !program_.over(); ++step) event();
    // Where nobody forged what only a relay may say, nothing is missing in the end.
    nats_.loss = 0;
    for (int i = 0; i < 300; ++i) {
      if (i % 3 == 0) frame();
      pass(10 * kMillisecond);
    }
    require(hostile_ || last_ + 4 >= frame_);
  }

 private:
  NatsPortOptions options(const char* site, ClientId client, std::uint32_t sender) {
    return {.session = "default", .site = site, .client = client, .sender = sender, .clock = [this] {
              return nats_.now_ns;
            }};
  }
  void pass(std::int64_t ns) {
    nats_.now_ns += ns;
    inputs_.clear();
    acks_.clear();
    relay_.take(inputs_);
    relay_.take(acks_);
    deltas_.clear();
    sessions_.clear();
    follower_.take_sessions(sessions_);
    follower_.take(deltas_);
    for (const Received<DeltaMessage>& delta : deltas_) {
      if (delta.message.part != 0) continue;
      require(delta.message.frame > last_);
      last_ = delta.message.frame;
    }
    std::vector<Received<ScheduledInputMessage>> scheduled;
    follower_.take(scheduled);
    std::vector<Received<SnapshotMessage>> snapshots;
    follower_.take(snapshots);
    static_cast<void>(follower_.server_alive());
  }
  DeltaMessage delta_of(Frame frame) {
    DeltaMessage delta;
    delta.epoch = kEpoch;
    delta.frame = frame;
    delta.parts = 1;
    delta.hash = frame;
    delta.payload.assign(30, std::byte{7});
    return delta;
  }
  void frame() { require(relay_.write(delta_of(++frame_)).has_value()); }

  static std::string subject(std::uint8_t which) {
    constexpr std::array kSubjects{"beat",
                                   "hello",
                                   "inputs",
                                   "status",
                                   "from.other.00000000000000aa",
                                   "from.edge.00000000000000ab",
                                   "from.other.zz",
                                   "delta.0",
                                   "to.edge.00000000000000ab"};
    return "tandem.default." + std::string(kSubjects[which % kSubjects.size()]);
  }

  Bytes a_message() {
    Bytes out;
    switch (program_.u8() % 8) {
      case 0: {
        nats::Beat beat;
        beat.epoch = program_.u8() % 2 == 0 ? kEpoch : program_.number() | 1U;
        beat.announcement = program_.number();
        beat.leaving = program_.u8() % 4 == 0;
        beat.inputs = {program_.number(), program_.number()};
        beat.streams.push_back({StreamId{}, {program_.number(), program_.number()}});
        nats::write(beat, out);
        require(*nats::read_beat(out) == beat);
        break;
      }
      case 1: {
        const nats::Ask ask{.epoch = kEpoch,
                            .what = static_cast<nats::Ask::For>(program_.u8() % 3),
                            .stream = {},
                            .first = program_.u8(),
                            .count = program_.u8()};
        nats::write(ask, out);
        require(*nats::read_ask(out) == ask);
        break;
      }
      case 2:
        nats::write(nats::Hello{program_.u8() % 2 == 0 ? "other" : std::string(1 + program_.u8() % 40, 'x')},
                    out);
        break;
      case 3: {
        DeltaMessage delta = delta_of(program_.u8() % 2 == 0 ? frame_ + 1 : program_.number());
        delta.parts = program_.u8() % 4;
        delta.part = program_.u8() % 4;
        delta.last_input = program_.number();
        write_envelope(delta, out);
        break;
      }
      case 4: {
        ScheduledInputMessage input;
        input.epoch = kEpoch;
        input.number = program_.number();
        write_envelope(input, out);
        break;
      }
      case 5: {
        AckMessage ack;
        ack.client = program_.u8() % 2 == 0 ? kHonest : 0xaa;
        ack.epoch = kEpoch;
        write_envelope(ack, out);
        break;
      }
      default:
        out = program_.bytes(80);
    }
    if (program_.u8() % 3 == 0) program_.damage(out);
    return out;
  }

  void event() {
    switch (program_.u8() % 8) {
      case 0:
        return frame();
      case 1:
        return pass(std::int64_t{program_.u8()} * kMillisecond);
      case 2:
        nats_.loss = program_.u8() % 2 == 0 ? 0 : 0.3;
        return;
      default:
        break;
    }
    const std::string to = subject(program_.u8());
    // What only a relay may write makes a follower believe it, until its client finds the hash wrong.
    if (!to.starts_with("tandem.default.from.") && !to.ends_with(".hello")) hostile_ = true;
    Bytes message = a_message();
    if (program_.u8() % 8 == 0) {
      static_cast<void>(stranger_->publish(to, message));  // no packet
      return;
    }
    nats::Packer packer(program_.u8() % 4 == 0 ? 1U : 9U);
    std::vector<Bytes> packets = packer.pack(message, program_.u8() % 4 == 0 ? 28 : 64'000);
    for (Bytes& packet : packets) {
      if (program_.u8() % 6 == 0) program_.damage(packet);
      static_cast<void>(stranger_->publish(to, packet));
    }
  }

  Program& program_;
  FakeNats nats_{1};
  std::unique_ptr<FakeNats::Bus> stranger_ = nats_.connect();
  NatsServerPort relay_{options("hub", 0, 1), nats_.connect()};
  NatsClientPort follower_{options("edge", kHonest, 2), nats_.connect()};
  SessionMessage session_;
  std::vector<Received<InputMessage>> inputs_;
  std::vector<Received<AckMessage>> acks_;
  std::vector<Received<DeltaMessage>> deltas_;
  std::vector<Received<SessionMessage>> sessions_;
  Frame frame_ = 0, last_ = 0;
  bool hostile_ = false;
};

}  // namespace
}  // namespace tandem::transport

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  tandem::fuzz::Program program(std::as_bytes(std::span(data, size)));
  tandem::transport::Run(program).play();
  return 0;
}
