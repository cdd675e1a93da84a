// Whatever clients may write, in any order, to a server, and whatever its engine says of a body's
// orientation: it keeps its frames, and a client that behaves does not notice.

#include "tests/fuzz/program.hpp"
#include "tests/unit/host/fakes.hpp"

namespace tandem::host {
namespace {

using fuzz::Program;
using fuzz::require;

constexpr transport::ClientId kHonest = 200;  // the strangers' ids are 0 .. 7 and anything above 2^32

constexpr std::uint32_t kBodies = 2;

class Run {
 public:
  Run(Program& program, bool turning)
      : program_(program), turning_(turning), bench_(turning ? turning_config() : test_config(), kBodies) {
    bench_.poll();
    behave(transport::Phase::kJoining);
    bench_.run_to(3);
  }

  void play() {
    for (int step = 0; step < 64 && !program_.over(); ++step) event();
    // Everything has an answer by now, and the honest client still plays and may send.
    for (int frame = 0; frame < 4; ++frame) poll(Bench::kPeriod);
    auto input = bench_.gravity(kHonest, ++honest_inputs_);
    bench_.send(input);
    for (int frame = 0; frame < 60 && !bench_.outcome(kHonest, honest_inputs_); ++frame) poll(Bench::kPeriod);
    require(bench_.host->state() == Host::State::kRunning);
    require(bench_.refusal(kHonest, honest_inputs_) == transport::Reason::kNone);
    require(bench_.outcome(kHonest, honest_inputs_).has_value());
    require(bench_.last_reply(kHonest)->role == transport::Role::kParticipant);
  }

 private:
  void behave(transport::Phase phase) { bench_.send(bench_.ack(kHonest, phase, bench_.host->frame())); }

  void poll(std::int64_t later_ns) {
    const Frame before = bench_.host->frame();
    bench_.now += later_ns;
    behave(transport::Phase::kPlaying);
    const bool produced = bench_.poll();
    require(bench_.host->frame() == before + (produced ? 1 : 0));
    require(bench_.host->outbox().size() == 0);  // all of it could be written
    require(bench_.host->take_notices().size() <= 256);
  }

  transport::ParticipantId somebody() {
    return participant(static_cast<std::uint8_t>(1 + program_.u8() % 3));
  }
  transport::ClientId an_id() {
    const std::uint8_t pick = program_.u8();
    if (pick % 16 == 15) return kHonest;  // of another participant
    if (pick % 16 == 14) return program_.u64() | (std::uint64_t{1} << 32U);
    return pick % 8;
  }
  // A transport hands on only what keeps its limits.
  template <class M>
  void arrive(std::vector<transport::Received<M>>& to, M message) {
    if (within_limits(message, transport::Limits{})) to.push_back({std::move(message), somebody()});
  }

  void event() {
    // Bodies are called otherwise with every event; nothing of it may delay a frame.
    bench_.simulation.names_version_now++;
    bench_.simulation.body_names = {{kBodies - 1, "\x1b crane"}, {0, ""}, {kBodies, "none"}};
    switch (program_.u8() % (turning_ ? 6 : 4)) {
      case 0:
        return arrive(bench_.port.acks, an_ack());
      case 1:
        return arrive(bench_.port.inputs, an_input());
      case 2:
        return toggle(program_.u8() % 2 == 0 ? bench_.port.dead : bench_.port.unmatched);
      case 4:
        return say(bench_.simulation.orientation);
      case 5:
        return say(bench_.simulation.angular_velocity);
      default:
        return poll(std::int64_t{program_.u8()} * kMillisecond);
    }
  }
  void toggle(std::set<transport::ParticipantId>& members) {
    const auto who = somebody();
    if (members.erase(who) == 0) members.insert(who);
  }

  // The engine has a new number for a body.
  template <std::size_t N>
  void say(std::array<std::vector<float>, N>& columns) {
    columns[program_.u8() % N][program_.u8() % kBodies] = static_cast<float>(program_.real());
  }

  transport::AckMessage an_ack() {
    auto ack = bench_.ack(an_id(), transport::Phase::kPlaying, bench_.host->frame());
    const std::uint8_t change = program_.u8();
    if ((change & 1U) != 0) ack.phase = static_cast<transport::Phase>(program_.u8() % 3);
    if ((change & 2U) != 0) ack.applied = program_.number();
    if ((change & 4U) != 0) ack.simulated = program_.number();
    if ((change & 8U) != 0) ack.role_wanted = static_cast<transport::Role>(program_.u8() % 3);
    if ((change & 16U) != 0) ack.epoch = program_.number();
    if ((change & 32U) != 0) ack.protocol_version = program_.u8();
    if ((change & 64U) != 0) ack.clock_ns = static_cast<std::int64_t>(program_.u64());
    if ((change & 128U) != 0) ack.join_attempt = program_.u8();
    return ack;
  }

  transport::InputMessage an_input() {
    auto input = bench_.gravity(an_id(), program_.number());
    const std::uint8_t change = program_.u8();
    if ((change & 1U) != 0) input.kind = program_.u8() % 20;
    if ((change & 2U) != 0) input.epoch = program_.number();
    if ((change & 4U) != 0) input.client_frame = program_.number();
    if ((change & 8U) != 0) input.values.assign(program_.u8() % 20, program_.real());
    if ((change & 16U) != 0) input.bytes = program_.bytes(1100);
    return input;
  }

  Program& program_;
  bool turning_;
  Bench bench_;
  std::uint64_t honest_inputs_ = 0;
};

}  // namespace
}  // namespace tandem::host

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  for (const bool turning : {false, true}) {
    tandem::fuzz::Program program(std::as_bytes(std::span(data, size)));
    tandem::host::Run(program, turning).play();
  }
  return 0;
}
