// Whatever a server's topics may carry, in any order, to a client: it never holds a broken state, and plays
// again when the server behaves.

#include "sdk/core/tables/codec_table.hpp"
#include "sdk/wire/frame_bundle.hpp"
#include "tests/fuzz/program.hpp"
#include "tests/property/synthetic.hpp"
#include "tests/support/client/fake_server.hpp"

namespace tandem::client {
namespace {

using fuzz::Program;
using fuzz::require;

constexpr std::uint32_t kCapacity = 8;
constexpr std::int64_t kStart = 1'000'000'000'000;

/// The messages of an honest server, made once, so that a run costs only the client's work.
struct Honest {
  explicit Honest(const Groups& groups)
      : server(1000, kCapacity, 1, groups), successor(~std::uint64_t{0} >> 1U, kCapacity, 1, groups) {
    server.advance();
    snapshot = server.snapshot();
    for (int i = 0; i < 6; ++i) {
      if (i == 2) input = server.schedule(-40);
      deltas.push_back(server.advance(i * kFrameNs));
    }
    late_snapshot = server.snapshot();
    for (int frame = 0; frame < 12; ++frame) {
      successor_deltas.push_back(successor.advance(kStart));
      successor_snapshots.push_back(successor.snapshot());
    }
  }
  FakeServer server;
  transport::SnapshotMessage snapshot, late_snapshot;
  transport::ScheduledInputMessage input;
  std::vector<transport::DeltaMessage> deltas;
  // The next run of the server, of a higher epoch than any that a program is likely to make up.
  FakeServer successor;
  std::vector<transport::DeltaMessage> successor_deltas;
  std::vector<transport::SnapshotMessage> successor_snapshots;
};

class Run {
 public:
  Run(const Honest& honest, Program& program) : honest_(honest), program_(program) {
    CoreOptions options;
    options.session = "default";
    options.id = kClient;
    core_ = std::make_unique<ClientCore>(options, port_);
    core_->start_sampling();
  }

  void play() {
    for (int step = 0; step < 64 && !program_.over(); ++step) event();
    make_peace();
  }

 private:
  // A transport hands on only what keeps its limits.
  template <class M>
  void arrive(std::vector<transport::Received<M>>& to, M message) {
    if (!within_limits(message, transport::Limits{})) return;
    to.push_back({std::move(message), program_.u8() % 8 == 1 ? transport::ParticipantId{{9}} : kServerId});
  }

  void event() {
    switch (program_.u8() % 8) {
      case 0:
        return arrive(port_.sessions, damaged_session());
      case 1:
        return arrive(port_.snapshots, damaged_snapshot());
      case 2:
        return arrive(port_.deltas, honest_.deltas[next_delta_++ % honest_.deltas.size()]);
      case 3:
        return arrive(port_.deltas, damaged_delta());
      case 4:
        return arrive(port_.inputs, damaged_input());
      case 5:
        return arrive(port_.replies, damaged_reply());
      case 6:
        return arrive(port_.sessions, honest_.server.session);
      default:
        return poll(std::int64_t{program_.u8()} * 4 * kMs);
    }
  }

  transport::SessionMessage damaged_session() {
    auto session = honest_.server.session;
    auto& stream = session.streams[0];
    switch (program_.u8() % 30) {
      case 0:
        session.epoch = program_.number();
        break;
      case 1:
        session.protocol_version = static_cast<std::uint32_t>(program_.number());
        break;
      case 2:
        stream.layout_hash ^= program_.number();
        break;
      case 3:
        session.capacity = stream.layout.capacity = static_cast<std::uint32_t>(program_.number() % 4096);
        break;
      case 4:
        session.frame_rate_hz = program_.real();
        break;
      case 5:
        session.lattice_unit = program_.real();
        break;
      case 6:
        session.lead = stream.layout.lead = static_cast<std::uint32_t>(program_.number());
        break;
      case 7:
        session.window_ceiling = static_cast<std::uint32_t>(program_.number());
        break;
      case 8:
        stream.max_delta_bytes = static_cast<std::uint32_t>(program_.number());
        break;
      case 9:
        stream.layout.codec = codec_names()[program_.u8() % codec_names().size()];
        break;
      case 10:
        stream.layout.parameters.codec.threshold = program_.i32();
        break;
      case 11:
        stream.layout.parameters.codec.position_step = program_.i32();
        break;
      case 12:
        stream.layout.predictor = program_.u8() % 2 == 0 ? "nonsense" : "";
        break;
      case 13:
        stream.layout.predictor_constants.assign(program_.u8(), program_.i32());
        break;
      case 14:
        stream.layout.codec_tables = program_.bytes(600);
        break;
      case 15:
        stream.id.id = static_cast<std::uint32_t>(program_.number());
        stream.carries = stream.id.id + (program_.u8() % 4 == 0 ? 1 : 0);
        break;
      case 16:
        session.scene_json.assign(program_.u8(), static_cast<char>(program_.u8()));
        break;
      case 17:
        stream.layout.groups.emplace_back(program_.u8() % 2 == 0 ? "orientation" : kPositionGroup);
        break;
      case 18:
        session.streams.insert(session.streams.begin(), stream);
        session.streams[0].layout.predictor = "nonsense";
        break;
      case 19:
        stream.layout.radii.assign(program_.u8() % 3, program_.i32());
        break;
      case 20:
        stream.layout.parameters.codec.turn_step = program_.i32();
        break;
      case 21:
        stream.layout.parameters.codec.spin_step = program_.i32();
        break;
      case 22:
        stream.layout.groups.pop_back();
        break;
      case 23:
        session.server_role = static_cast<transport::ServerRole>(program_.u8() % 3);
        break;
      case 24:
        session.dt_s = program_.real();
        break;
      case 25:
        session.gravity[program_.u8() % 3] = program_.real();
        break;
      case 26:
        session.up_axis = static_cast<transport::UpAxis>(program_.u8() % 4);
        break;
      case 27:
        stream.name = program_.u8() % 2 == 0 ? "thin" : "Not One";
        break;
      case 28:
        for (int count = program_.u8() % 12; count > 0; --count)
          session.names.push_back({program_.u8() % (kCapacity + 1), program_.u8() % 3U, "crane"});
        break;
      default:
        (program_.u8() % 2 == 0 ? stream.max_snapshot_bytes : stream.delay_ms) =
            static_cast<std::uint32_t>(program_.number());
        break;
    }
    if (program_.u8() % 2 == 0) {
      for (auto& any : session.streams) any.layout_hash = transport::layout_hash(session, any);
    }
    return session;
  }
  transport::SnapshotMessage damaged_snapshot() {
    auto snapshot = program_.u8() % 2 == 0 ? honest_.snapshot : honest_.late_snapshot;
    if (program_.u8() % 4 == 1) snapshot.frame = program_.number();
    program_.damage(snapshot.bytes);
    return snapshot;
  }
  // That delta and some that follow it, as one.
  transport::DeltaMessage several(const transport::DeltaMessage& first) {
    transport::FrameBundle bundle;
    std::size_t most = 1U + program_.u8() % 8U;
    for (const transport::DeltaMessage& delta : honest_.deltas)
      if (delta.frame >= first.frame && most > 0 && delta.parts == 1) {
        if (!bundle.empty() && delta.frame != bundle.last() + 1) break;
        bundle.add(delta.frame, delta.hash, delta.payload);
        --most;
      }
    if (bundle.empty()) return first;
    transport::DeltaMessage delta = bundle.take();
    delta.epoch = first.epoch;
    delta.stream = first.stream;
    delta.last_input = first.last_input;
    return delta;
  }
  transport::DeltaMessage damaged_delta() {
    auto delta = honest_.deltas[program_.u8() % honest_.deltas.size()];
    switch (program_.u8() % 9) {
      case 0:
        delta.frame = program_.number();
        break;
      case 1:
        delta.epoch = program_.number();
        break;
      case 2:
        delta.part = static_cast<std::uint32_t>(program_.number());
        [[fallthrough]];
      case 3:
        delta.parts = static_cast<std::uint32_t>(program_.number());
        break;
      case 4:
        delta.last_input = program_.number();
        break;
      case 5:
        delta.hash ^= program_.number();
        break;
      case 6:
        delta.server_time_ns = static_cast<std::int64_t>(program_.u64());
        break;
      case 7:
        delta.earlier = static_cast<std::uint32_t>(program_.number());
        if (program_.u8() % 2 == 0) delta.payload.clear();
        break;
      default:
        if (program_.u8() % 2 == 0) delta = several(delta);
        break;
    }
    program_.damage(delta.payload);
    return delta;
  }
  transport::ScheduledInputMessage damaged_input() {
    auto input = honest_.input;
    switch (program_.u8() % 8) {
      case 0:
        input.number = program_.number();
        break;
      case 1:
        input.frame = program_.number();
        break;
      case 2:
        input.kind = program_.u8();
        break;
      case 3:
        input.values.assign(program_.u8() % 70, program_.i32());
        break;
      case 4:
        input.values[program_.u8() % input.values.size()] = program_.i32();
        break;
      case 5:
        input.epoch = program_.number();
        break;
      default:
        break;
    }
    return input;
  }
  transport::ReplyMessage damaged_reply() {
    transport::ReplyMessage reply;
    reply.client = program_.u8() % 4 == 1 ? program_.u64() : kClient;
    reply.epoch = honest_.server.session.epoch;
    reply.role = static_cast<transport::Role>(program_.u8() % 3);
    reply.phase = static_cast<transport::Phase>(program_.u8() % 3);
    reply.reason = program_.u8() % 16;
    reply.highest_input = program_.number();
    reply.client_clock_ns = static_cast<std::int64_t>(program_.u64());
    reply.server_time_ns = static_cast<std::int64_t>(program_.u64());
    for (unsigned count = program_.u8() % 40; count > 0; --count) {
      reply.entries.push_back({program_.number(), program_.number(), program_.u8() % 16U});
      if (reply.entries.back().code == 3) reply.texts.push_back({reply.entries.back().number, "beyond 100"});
    }
    return reply;
  }

  void poll(std::int64_t later_ns) {
    now_ns_ += later_ns;
    core_->poll({now_ns_, now_ns_});
    core_->sample(sample_, SampleMode::kExtrapolate, {now_ns_, now_ns_});
    for (Slot slot = 0; slot <= kCapacity; ++slot) {
      const std::string_view name = core_->body_name(slot);
      require(name.empty() ||
              (name == "crane" && core_->timeline()->state(core_->timeline()->applied()).alive()[slot] != 0));
    }
    if (program_.u8() % 4 == 1) {
      static_cast<void>(
          core_->send(transport::InputKind::kGravity, {program_.real(), 0, 0}, {}, {now_ns_, now_ns_}));
    }
    if (const ClientTimeline* held = core_->timeline(); held != nullptr && held->playing()) {
      require(held->now() >= held->applied() && held->now() <= held->applied() + 1);
      require(synthetic::broken_invariant(held->state(held->now())) == nullptr);
    }
    // A client's output is limited by time, whatever it receives.
    require(port_.acks.size() <= 4096);
  }

  // The server announces itself anew, and behaves: the client must play.
  void make_peace() {
    port_.deltas.clear();
    port_.inputs.clear();
    port_.replies.clear();
    port_.sessions = {from_server(honest_.successor.session)};
    poll(5000 * kMs);
    for (std::size_t i = 0; i < honest_.successor_deltas.size(); ++i) {
      port_.deltas.push_back(from_server(honest_.successor_deltas[i]));
      if (!port_.snapshots_open.empty())
        port_.snapshots.push_back(from_server(honest_.successor_snapshots[i]));
      poll(100 * kMs);
    }
    require(core_->phase() == ClientPhase::kPlaying);
    require(core_->timeline()->hash() == honest_.successor.hashes.at(core_->timeline()->applied()));
  }

  const Honest& honest_;
  Program& program_;
  FakePort port_;
  std::unique_ptr<ClientCore> core_;
  Sample sample_;
  std::int64_t now_ns_ = kStart;
  std::size_t next_delta_ = 0;
};

}  // namespace
}  // namespace tandem::client

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const tandem::client::Honest honest({}), turning(tandem::synthetic::kTurning);
  for (const auto* server : {&honest, &turning}) {
    tandem::fuzz::Program program(std::as_bytes(std::span(data, size)));
    tandem::client::Run(*server, program).play();
  }
  return 0;
}
