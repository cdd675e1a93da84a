#include "tests/support/client/fake_server.hpp"

#include <algorithm>
#include <utility>

namespace tandem::client {

transport::SessionMessage FakeServer::make_session(Epoch epoch, std::uint32_t capacity, std::uint32_t lead,
                                                   const Groups& groups, const WorldFeatures& world) {
  transport::SessionMessage s;
  s.session = "default";
  s.epoch = epoch;
  s.capacity = capacity;
  s.lattice_unit = 0.001;
  s.lead = lead;
  s.scene = "test";
  s.types = {{"ball", 0.1F, 0xFFFFFFFF, transport::Shape::kSphere, {}}};
  transport::StreamMessage stream;
  stream.max_delta_bytes = stream.max_snapshot_bytes = 100'000 + 64 * capacity;
  s.features = transport::features_of(world);
  stream.layout.world = world;
  stream.layout.capacity = capacity;
  stream.layout.lead = lead;
  stream.layout.codec = "quantized";
  stream.layout.parameters.codec.threshold = 50;
  stream.layout.parameters.codec.position_step = 40;
  stream.layout.parameters.codec.velocity_step = 40;
  if (groups.orientation) {
    stream.layout.groups.emplace_back(kOrientationGroup);
    stream.layout.radii = {100};
    stream.layout.parameters.codec.turn_step = 1 << 20;
    stream.layout.parameters.codec.spin_step = 1 << 18;
  }
  stream.layout_hash = transport::layout_hash(s, stream);
  s.streams.push_back(stream);
  return s;
}

ServerTimeline FakeServer::make(const transport::SessionMessage& s) {
  return std::move(*ServerTimeline::create(s.streams[0].layout, s.epoch));
}

FakeServer::FakeServer(Epoch epoch, std::uint32_t capacity, std::uint32_t lead, const Groups& groups,
                       const WorldFeatures& world)
    : session(make_session(epoch, capacity, lead, groups, world)),
      timeline_(make(session)),
      target_(capacity, groups) {
  for (Slot slot = 0; slot < capacity; ++slot) {
    const auto place = static_cast<std::int32_t>(slot * 1000);
    BodyState body{{place, 100'000, -place}, {64, 0, 128}};
    if (groups.orientation) body.w = {1 << 20, 0, static_cast<std::int32_t>(slot) << 16};
    target_.spawn(slot, 0, 0, body);
  }
  timeline_.start(0, target_, {{0, -20, 0}, 300});
  hashes[0] = timeline_.hash();
}

transport::DeltaMessage FakeServer::advance(std::int64_t server_time_ns) {
  // The target is the prediction disturbed: about a third of the bodies move off by more than the threshold.
  for (Slot slot = 0; slot < target_.capacity(); ++slot) {
    BodyState body = timeline_.state().body(slot);
    for (std::size_t i = 0; i < 3; ++i) body.p[i] += body.v[i] / 64;
    random_ ^= random_ << 13U;
    random_ ^= random_ >> 7U;
    random_ ^= random_ << 17U;
    if (random_ % 3 == 0 && !undisturbed) {
      body.p[random_ % 3] += static_cast<std::int32_t>(random_ % 3000) - 1500;
      body.v[random_ % 2] += static_cast<std::int32_t>(random_ % 900) - 450;
      body.w[random_ % 3] /= 2;
    }
    if (target_.groups().orientation) body.q = turned(body.q, body.w);
    target_.set_body(slot, body);
  }
  std::vector<LifecycleRecord> records;
  if (teleport_ >= 0) {
    const auto slot = static_cast<Slot>(teleport_);
    LifecycleRecord record;
    record.kind = LifecycleKind::kTeleport;
    record.slot = slot;
    record.groups = bits_of(target_.groups());
    record.body = {{900'000, 900'000, 900'000}, {}};
    target_.set_body(slot, record.body);
    records.push_back(record);
    teleport_ = -1;
  }
  const auto result = timeline_.advance(target_, records, kNoBudget, nullptr, {}, std::exchange(news, {}));
  hashes[result.frame] = result.hash;
  transport::DeltaMessage delta;
  delta.epoch = session.epoch;
  delta.frame = result.frame;
  delta.last_input = result.last_input;
  delta.server_time_ns = server_time_ns;
  delta.hash = result.hash;
  delta.payload.assign(result.payload.begin(), result.payload.end());
  return delta;
}

transport::ScheduledInputMessage FakeServer::schedule(std::int32_t gravity_y, std::int32_t gravity_x) {
  ScheduledDrive input;
  input.number = ++last_number_;
  input.frame = frame() + 1 + session.lead;
  input.drive = {{gravity_x, gravity_y, 0}, 300};
  EXPECT_TRUE(timeline_.schedule(input).has_value());
  transport::ScheduledInputMessage message;
  message.epoch = session.epoch;
  message.number = input.number;
  message.frame = input.frame;
  message.kind = static_cast<std::uint32_t>(transport::ScheduledKind::kDrive);
  message.values = {gravity_x, gravity_y, 0, 300};
  return message;
}

transport::SnapshotMessage FakeServer::snapshot() {
  transport::SnapshotMessage message;
  message.epoch = session.epoch;
  message.frame = frame();
  timeline_.snapshot(message.bytes);
  message.total_bytes = static_cast<std::uint32_t>(message.bytes.size());
  return message;
}

namespace {

template <class M>
std::vector<M> split(const M& whole, transport::Bytes M::*bytes, std::size_t parts) {
  std::vector<M> out(parts, whole);
  const transport::Bytes& all = whole.*bytes;
  const std::size_t step = (all.size() + parts - 1) / parts;
  for (std::size_t i = 0; i < parts; ++i) {
    const auto at = [&](std::size_t n) {
      return all.begin() + static_cast<std::ptrdiff_t>(std::min(n * step, all.size()));
    };
    out[i].part = static_cast<std::uint32_t>(i);
    out[i].parts = static_cast<std::uint32_t>(parts);
    (out[i].*bytes).assign(at(i), at(i + 1));
  }
  return out;
}

}  // namespace

std::vector<transport::DeltaMessage> split(const transport::DeltaMessage& whole, std::size_t parts) {
  return split(whole, &transport::DeltaMessage::payload, parts);
}

std::vector<transport::SnapshotMessage> split(const transport::SnapshotMessage& whole, std::size_t parts) {
  return split(whole, &transport::SnapshotMessage::bytes, parts);
}

void ClientTest::start(std::uint32_t lead, transport::Role role) {
  CoreOptions options;
  options.session = "default";
  options.id = kClient;
  options.role = role;
  options.lead = lead;
  options.log = [this](LogLevel, std::string_view line) { log.emplace_back(line); };
  options.measure_ns = measure_ns;
  options.echo = echo;
  options.max_delay_ms = max_delay_ms;
  options.cap_kbit_s = cap_kbit_s;
  options.gateway_caps = gateway_caps;
  core = std::make_unique<ClientCore>(std::move(options), port, &recorder);
}

void ClientTest::poll(std::int64_t later_ns) {
  now_ns += later_ns;
  core->poll({now_ns, wall_ns()});
}

void ClientTest::frame(std::int64_t later_ns) {
  deliver(server.advance(wall_ns() + later_ns));
  poll(later_ns);
}

void ClientTest::join() {
  if (!core) start();
  port.sessions.push_back(from_server(server.session));
  poll();
  ASSERT_EQ(core->phase(), ClientPhase::kJoining);
  deliver(server.advance(wall_ns()));
  port.snapshots.push_back(from_server(server.snapshot()));
  poll();
  ASSERT_EQ(core->phase(), ClientPhase::kPlaying);
}

void ClientTest::expect_agreed() const {
  for (const auto& [frame, hash] : recorder.hashes)
    EXPECT_EQ(hash, server.hashes.at(frame)) << "frame " << frame;
  ASSERT_NE(core->timeline(), nullptr);
  EXPECT_EQ(core->timeline()->hash(), server.hashes.at(core->timeline()->applied()));
  EXPECT_EQ(figures().hash_mismatches, 0U);
}

}  // namespace tandem::client
